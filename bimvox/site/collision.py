"""The one definition of collision: whether a component's reference cell may be at a cell.

Environment, search, policy and trajectory check all call :func:`placement_is_free`. A placement is free if

* every box of the shape lies inside the grid and contains no occupied cell (summed-area table), and
* the hook line above it is free and the hook is allowed there (one map of the lowest admissible hook cell per column:
  rope, reach, capacity and zones constrain the hook, not the boxes),

or if the narrow phase has cleared it: in the last moves, where the broad phase hits only parts that the component
touches in the finished building (see ``bimvox.planning.contact.pairs``).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import inline_kernel, leaf_kernel
from bimvox.crane.reach import HOOK_FORBIDDEN as HOOK_FORBIDDEN
from bimvox.grid.summed_area import box_sum

NO_CEILING = np.zeros((0, 0), np.int32)
"""``hook_ceiling`` if only the grid's top limits the height."""


class CollisionSpace(NamedTuple):
    """Everything that decides whether a placement is free; a named tuple, so that kernels accept it.

    Attributes:
        table: (X + 1, Y + 1, Z + 1) int32 summed-area table of the occupied cells.
        boxes: (B, 6) int32 half-open boxes of the shape, relative to the reference cell.
        hook_offset: (3,) int32 cell of the hook line's foot relative to the reference cell.
        hook_floor: (X, Y) int32 lowest cell at which the hook line's foot may be; ``HOOK_FORBIDDEN`` where it may not
            be; zeros without the rope rule.
        cleared_low: (3,) int32 lowest corner of the window of placements that the narrow phase checked.
        cleared: (A, B, C) bool placements that it cleared; size 0 if there are none.
        hook_ceiling: (X, Y) int32 highest cell at which the hook line's foot may be (limiters, long slings, a luffing
            jib); size 0 if the jib is above the whole grid.
    """

    table: NDArray[np.int32]
    boxes: NDArray[np.int32]
    hook_offset: NDArray[np.int32]
    hook_floor: NDArray[np.int32]
    cleared_low: NDArray[np.int32]
    cleared: NDArray[np.bool_]
    hook_ceiling: NDArray[np.int32] = NO_CEILING


NOTHING_CLEARED = (np.zeros(3, np.int32), np.zeros((0, 0, 0), np.bool_))
"""``cleared_low`` and ``cleared`` if the narrow phase cleared nothing."""


@inline_kernel
def _boxes_are_free_over(space: CollisionSpace, x: int, y: int, z: int, last_x: int, last_y: int, last_z: int) -> bool:
    """Return whether the shape's swept boxes from one reference cell to another are free and inside the grid."""
    table, boxes = space.table, space.boxes
    for b in range(boxes.shape[0]):
        x0, y0, z0 = x + boxes[b, 0], y + boxes[b, 1], z + boxes[b, 2]
        x1, y1, z1 = last_x + boxes[b, 3], last_y + boxes[b, 4], last_z + boxes[b, 5]
        if x0 < 0 or y0 < 0 or z0 < 0 or x1 >= table.shape[0] or y1 >= table.shape[1] or z1 >= table.shape[2]:
            return False
        if box_sum(table, x0, y0, z0, x1, y1, z1) != 0:
            return False
    return True


@leaf_kernel
def boxes_are_free(space: CollisionSpace, x: int, y: int, z: int) -> bool:
    """Return whether the shape at reference cell (x, y, z) lies inside the grid and meets no occupied cell."""
    return _boxes_are_free_over(space, x, y, z, x, y, z)


@leaf_kernel
def hook_is_free(space: CollisionSpace, x: int, y: int, z: int) -> bool:
    """Return whether the hook line above a component at reference cell (x, y, z) is free and allowed."""
    hook_x, hook_y = x + space.hook_offset[0], y + space.hook_offset[1]
    floor = space.hook_floor
    if hook_x < 0 or hook_y < 0 or hook_x >= floor.shape[0] or hook_y >= floor.shape[1]:
        return False
    foot = z + space.hook_offset[2]
    if space.hook_ceiling.size > 0 and foot > space.hook_ceiling[hook_x, hook_y]:
        return False
    return bool(foot >= floor[hook_x, hook_y])


@leaf_kernel
def placement_is_free(space: CollisionSpace, x: int, y: int, z: int) -> bool:
    """Return whether the component may be at reference cell (x, y, z)."""
    i, j, k = x - space.cleared_low[0], y - space.cleared_low[1], z - space.cleared_low[2]
    cleared = space.cleared
    if 0 <= i < cleared.shape[0] and 0 <= j < cleared.shape[1] and 0 <= k < cleared.shape[2] and cleared[i, j, k]:
        return True
    return boxes_are_free(space, x, y, z) and hook_is_free(space, x, y, z)


@leaf_kernel
def range_is_free(space: CollisionSpace, around: tuple[int, int, int, int, int, int]) -> bool:
    """Return whether the union of a component's boxes over a range of placements is free.

    If it is not, single placements may still be free.

    Args:
        space: The collision rule.
        around: First and last placement, both inclusive; the first no higher than the last.
    """
    x, y, z, last_x, last_y, last_z = around
    if not _boxes_are_free_over(space, x, y, z, last_x, last_y, last_z):
        return False
    for i in range(x, last_x + 1):
        for j in range(y, last_y + 1):
            if not (hook_is_free(space, i, j, z) and hook_is_free(space, i, j, last_z)):
                return False
    return True


@leaf_kernel
def free_up_to(space: CollisionSpace, x: int, y: int, z: int) -> int:
    """Return the lowest z, from the given one up, at which a placement in this column is not free."""
    while z < space.table.shape[2] and placement_is_free(space, x, y, z):
        z += 1
    return z
