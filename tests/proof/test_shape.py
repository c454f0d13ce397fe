"""Points over every triangle of a part are looked at: each must lie in its cells."""

import numpy as np
import pytest

from bimvox.proof.shape import _look

BORDER = 1e-3
EVERYWHERE = np.full(3, -np.inf), np.full(3, np.inf)


def spread(triangle, spacing):
    """Return the points of one triangle: its edges are cut into as many parts as the longest one needs."""
    longest = np.linalg.norm(triangle - np.roll(triangle, 1, axis=0), axis=1).max()
    parts = int(np.clip(np.ceil(longest / spacing), 1, 64))
    i, j = np.triu_indices(parts + 1)
    return parts, np.stack([i, j - i, parts - j], axis=1) / parts @ triangle


def around(point, shape):
    """Return the cells around a point, a border's width to either side."""
    low, high = np.floor(point - BORDER).astype(int), np.floor(point + BORDER).astype(int)
    cells = {(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])}
    return [cell for cell in cells if all(0 <= n < m for n, m in zip(cell, shape, strict=True))]


@pytest.mark.parametrize("clipped", [False, True])
def test_every_point_of_every_triangle_is_looked_at(clipped):
    rng = np.random.default_rng(7)
    dense = rng.random((9, 8, 7)) < 0.7
    corners = rng.uniform(0.5, 6.5, (40, 1, 3)) + rng.uniform(-2.5, 2.5, (40, 3, 3)).round(1)
    corners[:3] = corners[:3].round()
    low, high = (np.full(3, 1.5), np.full(3, 5.5)) if clipped else EVERYWHERE
    touched, wanted, looked, bare = np.zeros_like(dense), np.zeros_like(dense), 0, []
    for triangle in corners:
        parts, points = spread(triangle, 0.5)
        for point in points[((points >= low) & (points <= high)).all(axis=1)]:
            found = [cell for cell in around(point, dense.shape) if dense[cell]]
            looked += 1
            bare += [] if found else [(parts, point)]
            for cell in found:
                wanted[cell] = True
    found = _look(dense, touched, corners, low, high, 0.5, BORDER)
    assert found[:2] == (looked, len(bare))
    assert len(bare) > 30
    np.testing.assert_array_equal(touched, wanted)
    fewest = min(parts for parts, _ in bare)
    first = [point for parts, point in bare if parts == fewest]
    assert min(np.abs(first - found[2]).max(axis=1)) < 1e-12
