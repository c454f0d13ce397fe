"""What the policy sees: an egocentric occupancy pyramid, the way to the goal, the last action.

The pyramid is a window of ``WINDOW`` cells about the component on each of four levels (scale 1, 2, 4, 8):

* scale 1: whether the component may be at each neighbouring placement, by the one rule of collision
  (:func:`bimvox.site.collision.placement_is_free`): 0 free, 1 blocked;
* scale s: one cell stands for the block of placements s * (i, j, k) +- s/2. 0: nothing in the box that the component
  sweeps over the whole block, so all of it is free. 1: something in the box that it fills wherever in the block it is,
  or the hook may not be at the block's centre. Between: the share of the swept box that is filled, lifted above
  ``PARTLY`` so that a thin wall shows. Outside the site counts as filled. All from the summed-area table.

Its size does not depend on the site's, nor on the component's: one network serves every lift. Nothing in it comes from
the distance field: that is the teacher's.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import leaf_kernel
from bimvox.env.actions import ACTION_COUNT
from bimvox.env.state import LiftState
from bimvox.grid.summed_area import box_sum
from bimvox.site.collision import CollisionSpace, hook_is_free, placement_is_free

WINDOW = (7, 7, 5)
"""Cells of the window along x, y, z; odd, so that the component is in the middle."""

SCALES = (1, 2, 4, 8)
"""Cells of the site per cell of the window, one level each."""

PARTLY = 0.25
"""Least value of a coarse cell whose placements are neither surely free nor surely blocked."""

GOAL_SIZE = 12
"""Per axis: sign, offset clipped at four cells, logarithm of the offset, share of the Manhattan distance."""

WINDOW_SIZE = WINDOW[0] * WINDOW[1] * WINDOW[2]
OBSERVATION_SIZE = WINDOW_SIZE * len(SCALES) + GOAL_SIZE + ACTION_COUNT
OBSERVATION_NAME = f"pyramid-{WINDOW[0]}x{WINDOW[1]}x{WINDOW[2]}-{'-'.join(str(s) for s in SCALES)}-v1"
"""Names layout and meaning of the vector; a stored policy fits only the observation that it was trained on."""

LOG_FARTHEST = float(np.log(1024.0))


@leaf_kernel
def observe(space: CollisionSpace, target: NDArray[np.int32], state: LiftState, out: NDArray[np.float32]) -> None:
    """Write the observation of one lift.

    Args:
        space: What decides whether a placement is free.
        target: (3,) int32 reference cell of the target.
        state: Where the component is.
        out: (OBSERVATION_SIZE,) float32, overwritten; every entry in [-1, 1].
    """
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
                        out[n] = _block_filled(space, low, high, u, v, w, scale // 2)
                    n += 1
    write_goal(target[0] - x, target[1] - y, target[2] - z, out[n : n + GOAL_SIZE])
    n += GOAL_SIZE
    for action in range(ACTION_COUNT):
        out[n + action] = 1.0 if state.last_action == action else 0.0


@leaf_kernel
def bounding_box(boxes: NDArray[np.int32]) -> tuple[tuple[int, int, int], tuple[int, int, int]]:
    """Return the lowest and highest corner of a shape's boxes, relative to its reference cell."""
    x0, y0, z0, x1, y1, z1 = boxes[0, 0], boxes[0, 1], boxes[0, 2], boxes[0, 3], boxes[0, 4], boxes[0, 5]
    for b in range(1, boxes.shape[0]):
        x0, y0, z0 = min(x0, boxes[b, 0]), min(y0, boxes[b, 1]), min(z0, boxes[b, 2])
        x1, y1, z1 = max(x1, boxes[b, 3]), max(y1, boxes[b, 4]), max(z1, boxes[b, 5])
    return (x0, y0, z0), (x1, y1, z1)


@leaf_kernel
def _block_filled(
    space: CollisionSpace,
    low: tuple[int, int, int],
    high: tuple[int, int, int],
    x: int,
    y: int,
    z: int,
    reach: int,
) -> float:
    """Return how blocked the placements within ``reach`` of (x, y, z) are: one cell of a coarse level."""
    hook_x, hook_y = x + space.hook_offset[0], y + space.hook_offset[1]
    on_site = 0 <= hook_x < space.hook_floor.shape[0] and 0 <= hook_y < space.hook_floor.shape[1]
    # Beyond the border it is the share of filled cells that tells: a block may lie across it.
    if on_site and not hook_is_free(space, x, y, max(z, 0)):
        return 1.0
    table = space.table
    nx, ny, nz = table.shape[0] - 1, table.shape[1] - 1, table.shape[2] - 1
    x0, y0, z0 = x + low[0] - reach, y + low[1] - reach, z + low[2] - reach
    x1, y1, z1 = x + high[0] + reach, y + high[1] + reach, z + high[2] + reach
    inside_x0, inside_y0, inside_z0 = max(x0, 0), max(y0, 0), max(z0, 0)
    inside_x1, inside_y1, inside_z1 = min(x1, nx), min(y1, ny), min(z1, nz)
    if inside_x0 >= inside_x1 or inside_y0 >= inside_y1 or inside_z0 >= inside_z1:
        return 1.0
    volume = (x1 - x0) * (y1 - y0) * (z1 - z0)
    inside = (inside_x1 - inside_x0) * (inside_y1 - inside_y0) * (inside_z1 - inside_z0)
    filled = volume - inside
    filled += box_sum(table, inside_x0, inside_y0, inside_z0, inside_x1, inside_y1, inside_z1)
    if filled == 0:
        return 0.0
    core_x0, core_y0, core_z0 = x0 + 2 * reach, y0 + 2 * reach, z0 + 2 * reach
    core_x1, core_y1, core_z1 = x1 - 2 * reach, y1 - 2 * reach, z1 - 2 * reach
    if core_x0 < core_x1 and core_y0 < core_y1 and core_z0 < core_z1:
        if core_x0 < 0 or core_y0 < 0 or core_z0 < 0 or core_x1 > nx or core_y1 > ny or core_z1 > nz:
            return 1.0
        if box_sum(table, core_x0, core_y0, core_z0, core_x1, core_y1, core_z1) != 0:
            return 1.0
    return float(PARTLY + (1.0 - PARTLY) * filled / volume)


@leaf_kernel
def write_goal(dx: int, dy: int, dz: int, out: NDArray[np.float32]) -> None:
    """Write the way to the goal, ``GOAL_SIZE`` entries: precise when near, its order of magnitude when far."""
    total = max(1, abs(dx) + abs(dy) + abs(dz))
    for axis, d in enumerate((dx, dy, dz)):
        sign = 1.0 if d > 0 else (-1.0 if d < 0 else 0.0)
        out[axis] = sign
        out[3 + axis] = max(-1.0, min(1.0, d / 4.0))
        out[6 + axis] = sign * min(1.0, np.log(1.0 + abs(d)) / LOG_FARTHEST)
        out[9 + axis] = d / total
