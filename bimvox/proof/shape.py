"""The verifier's test of voxelization: a part's cells cover its true surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.grid.frame import GridFrame
from bimvox.records.proof import Check
from bimvox.site.component import Component

_BORDER_M = 2e-4  # a point this close to a cell border may count to either side (the voxelizer's tolerance is 0.1 mm)
_FINEST = 64


def check_shape(check: Check, component: Component, frame: GridFrame) -> None:
    """Check that points spread over a part's triangles, half a cell apart, lie in its cells at its place."""
    own = component.shape.cells
    dense = np.zeros(own.max(axis=0) + 3, np.bool_)
    dense[tuple((own + 1).T)] = True
    low = np.array(component.target_vox) - 1
    points = _spread(component.mesh.triangles_m, frame.voxel_size_m / 2)
    scaled = (points - np.array(frame.origin_m)) / frame.voxel_size_m
    covered = _covered(dense, scaled, low, _BORDER_M / frame.voxel_size_m)
    bare = points[~covered]
    where = f" at ({bare[0][0]:.3f}, {bare[0][1]:.3f}, {bare[0][2]:.3f}) m" if len(bare) else ""
    check.look(not len(bare), f"{component.id}: its surface{where} lies outside its cells", samples=len(points))


@kernel
def _covered(
    dense: NDArray[np.bool_], scaled: NDArray[np.float64], low: NDArray[np.int64], border: float
) -> NDArray[np.bool_]:
    """Return (N,) whether any cell around each point, a border's width to either side, is among the set cells."""
    covered = np.zeros(scaled.shape[0], np.bool_)
    nx, ny, nz = dense.shape
    for n in range(scaled.shape[0]):
        for corner in range(8):
            x = int(np.floor(scaled[n, 0] + border * (2 * (corner // 4) - 1))) - low[0]
            y = int(np.floor(scaled[n, 1] + border * (2 * (corner // 2 % 2) - 1))) - low[1]
            z = int(np.floor(scaled[n, 2] + border * (2 * (corner % 2) - 1))) - low[2]
            if 0 <= x < nx and 0 <= y < ny and 0 <= z < nz and dense[x, y, z]:
                covered[n] = True
                break
    return covered


def _spread(triangles_m: NDArray[np.float64], spacing_m: float) -> NDArray[np.float64]:
    """Return points over every triangle, corners included, at most ``spacing_m`` apart (or ``_FINEST`` an edge)."""
    longest = np.linalg.norm(triangles_m - np.roll(triangles_m, 1, axis=1), axis=2).max(axis=1)
    parts = np.clip(np.ceil(longest / spacing_m), 1, _FINEST).astype(int)
    found = []
    for count in np.unique(parts):
        i, j = np.triu_indices(count + 1)
        weights = np.stack([i, j - i, count - j], axis=1) / count
        found.append((weights @ triangles_m[parts == count]).reshape(-1, 3))
    return np.concatenate(found)
