"""The egocentric pyramid: what is free around the component, the way to the goal, the last action.

The pyramid is a window of ``WINDOW`` cells around the component on each of four levels (scale 1, 2, 4, 8):

* scale 1: whether the component can be at each neighbouring placement, by the one collision rule
  (:func:`bimvox.site.collision.placement_is_free`): 0 free, 1 blocked;
* scale s: one cell represents the block of placements s * (i, j, k) +- s/2, answered by
  :func:`bimvox.env.observation.swept_fill`. 0: every placement is free. 1: none is, or the hook is not allowed at
  the middle one. In between: the filled share of the swept box, raised above ``PARTLY`` so that a thin wall shows.

Its size depends neither on the site nor on the component, so one network serves every lift. It holds nothing of the
distance field, which belongs to the teacher.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import leaf_kernel
from bimvox.env.actions import ACTION_COUNT
from bimvox.env.dynamics import LiftState
from bimvox.env.observation import WAY_SIZE, Corner, bounding_box, swept_fill, write_goal
from bimvox.site.collision import CollisionSpace, placement_is_free

WINDOW = (7, 7, 5)
"""Cells of the window along x, y, z; odd, so that the component is in the middle."""

SCALES = (1, 2, 4, 8)
"""Cells of the site per cell of the window, one level each."""

PARTLY = 0.25
"""Least value of a coarse cell whose placements are neither all free nor all blocked."""

WINDOW_SIZE = WINDOW[0] * WINDOW[1] * WINDOW[2]
OBSERVATION_SIZE = WINDOW_SIZE * len(SCALES) + WAY_SIZE + ACTION_COUNT


@leaf_kernel
def observe(space: CollisionSpace, target: NDArray[np.int32], state: LiftState, out: NDArray[np.float32]) -> None:
    """Write the observation of one lift into ``out``, (OBSERVATION_SIZE,) float32 in [-1, 1]."""
    x, y, z = state.x, state.y, state.z
    low, high = bounding_box(space.boxes)
    n = 0
    for scale in SCALES:
        for i in range(-(WINDOW[0] // 2), WINDOW[0] // 2 + 1):
            for j in range(-(WINDOW[1] // 2), WINDOW[1] // 2 + 1):
                for k in range(-(WINDOW[2] // 2), WINDOW[2] // 2 + 1):
                    u, v, w = x + scale * i, y + scale * j, z + scale * k
                    if scale == 1:
                        out[n] = 0.0 if placement_is_free(space, u, v, w) else 1.0
                    else:
                        out[n] = _coarse_cell(space, low, high, (u, v, w), scale // 2)
                    n += 1
    write_goal(target[0] - x, target[1] - y, target[2] - z, out[n : n + WAY_SIZE])
    n += WAY_SIZE
    for action in range(ACTION_COUNT):
        out[n + action] = 1.0 if state.last_action == action else 0.0


@leaf_kernel
def _coarse_cell(space: CollisionSpace, low: Corner, high: Corner, cell: Corner, reach: int) -> float:
    """Return how blocked the placements within ``reach`` of a cell are."""
    filled, volume = swept_fill(space, low, high, cell, (reach, reach, reach))
    if volume == 0:
        return 1.0
    if filled == 0:
        return 0.0
    return float(PARTLY + (1.0 - PARTLY) * filled / volume)
