"""A picture of one lift: the layer of the component from above, and the row of the component from the front."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.env.problem import LiftProblem
from bimvox.site.collision import placement_is_free
from bimvox.site.component import IntVec

FREE, BLOCKED, TARGET, COMPONENT, EDGE = (250, 250, 250), (52, 52, 56), (226, 119, 178), (31, 119, 214), (190, 190, 195)
"""Colours: placements that are free, placements that are not, the target, the component, the line between the views."""

LEAST_EDGE_PX = 480
"""The longer edge of the picture is at least this long."""

_GAP = 1


def lift_pixels(problem: LiftProblem, cell_vox: IntVec) -> NDArray[np.uint8]:
    """Return (H, W, 3) uint8 pixels of a lift with its reference cell at a cell.

    A square is a placement of the reference cell. The upper view is its layer from above (x to the right, y up), the
    lower one its row from the front (x to the right, z up).
    """
    nx, ny, nz = problem.grid_shape
    x, y, z = cell_vox
    above, front = np.empty((ny, nx, 3), np.uint8), np.empty((nz, nx, 3), np.uint8)
    for i in range(nx):
        for j in range(ny):
            above[ny - 1 - j, i] = FREE if placement_is_free(problem.space, i, j, z) else BLOCKED
        for k in range(nz):
            front[nz - 1 - k, i] = FREE if placement_is_free(problem.space, i, y, k) else BLOCKED
    tx, ty, tz = problem.target_vox
    above[ny - 1 - ty, tx], front[nz - 1 - tz, tx] = TARGET, TARGET
    above[ny - 1 - y, x], front[nz - 1 - z, x] = COMPONENT, COMPONENT
    between = np.full((_GAP, nx, 3), EDGE, np.uint8)
    picture = np.concatenate([above, between, front])
    scale = -(-LEAST_EDGE_PX // max(picture.shape[:2]))
    return np.ascontiguousarray(picture.repeat(scale, axis=0).repeat(scale, axis=1))
