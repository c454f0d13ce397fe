"""Where others go on a planned site: work places in the building, in the yard and around, and a road to the yard.

The site file does not say it: crews work all over the building, in the yard and on the sides, and lorries drive
straight to the side of the site that is nearest to the yard.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.live.traffic import Ground
from bimvox.site.site import Site

AREAS, PLACES = 7, 12
"""Number of areas, and of work places in each: the building in two halves, the yard, and the site's four sides."""
_AROUND_M = (2.0, 15.0)
"""How far outside the grid the work places of its sides are."""
_OUTSIDE_M = 30.0
NO_TRACK = (np.zeros((0, 3)), np.zeros(1, np.int64), np.zeros(0, np.bool_))


def ground_of(site: Site) -> Ground:
    """Return where others go on a site; the same for every call."""
    draw, size, origin = np.random.default_rng(0), site.frame.voxel_size_m, np.array(site.frame.origin_m[:2])
    built = np.zeros(site.shape[:2], np.bool_)
    for part in site.components:
        columns = part.shape.cells[:, :2] + np.array(part.target_vox[:2])
        built[tuple(columns.T)] = True
    columns = np.argwhere(built)
    low, high = columns.min(axis=0), columns.max(axis=0) + 1
    box = np.stack(np.meshgrid(*(np.arange(a, b) for a, b in zip(low, high, strict=True)), indexing="ij"), -1)
    inside = box.reshape(-1, 2)
    longer = int(np.argmax(high - low))
    first_half = inside[:, longer] < (low + high)[longer] // 2
    groups = (inside[first_half], inside[~first_half], np.argwhere(site.yard), *_around(site))
    chosen = [group[draw.integers(len(group), size=PLACES)] for group in groups]
    places_m = (np.concatenate(chosen) + 0.5) * size + origin
    return Ground(places_m, np.arange(AREAS + 1) * PLACES, _road_m(site), *NO_TRACK)


def _around(site: Site) -> list[NDArray[np.int64]]:
    """Return the columns outside the grid, side by side."""
    near, far = (round(away_m / site.frame.voxel_size_m) for away_m in _AROUND_M)
    nx, ny = site.shape[:2]
    x, y = np.arange(nx), np.arange(ny)
    out = np.arange(near, far)
    pairs = ((-out, y), (nx + out, y), (x, -out), (x, ny + out))
    return [np.stack(np.meshgrid(a, b, indexing="ij"), -1).reshape(-1, 2) for a, b in pairs]


def _road_m(site: Site) -> NDArray[np.float64]:
    """Return a road from outside to the side of the site that is nearest to the yard: lorries stand there."""
    size, origin = site.frame.voxel_size_m, np.array(site.frame.origin_m[:2])
    low, high = origin, origin + np.array(site.shape[:2]) * size
    stand = (np.argwhere(site.yard).mean(axis=0) + 0.5) * size + origin
    sides = [(stand[axis] - low[axis], axis, -1.0) for axis in (0, 1)]
    sides += [(high[axis] - stand[axis], axis, 1.0) for axis in (0, 1)]
    away_m, axis, way = min(sides)
    edge, gate = stand.copy(), stand.copy()
    edge[axis] += way * away_m
    gate[axis] += way * (away_m + _OUTSIDE_M)
    return np.array([gate, 0.5 * (gate + edge), edge])
