"""A block of placements: one coarse cell of an observation, answered from the summed-area table."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import inline_kernel, leaf_kernel
from bimvox.grid.summed_area import box_sum
from bimvox.site.collision import CollisionSpace, hook_is_free

Corner = tuple[int, int, int]

SURELY_BLOCKED = (1, 0)
"""Result of :func:`swept_fill` if no placement of the block is free."""


@leaf_kernel
def bounding_box(boxes: NDArray[np.int32]) -> tuple[Corner, Corner]:
    """Return the lowest and the highest corner of a shape's boxes, relative to its reference cell."""
    x0, y0, z0, x1, y1, z1 = boxes[0, 0], boxes[0, 1], boxes[0, 2], boxes[0, 3], boxes[0, 4], boxes[0, 5]
    for b in range(1, boxes.shape[0]):
        x0, y0, z0 = min(x0, boxes[b, 0]), min(y0, boxes[b, 1]), min(z0, boxes[b, 2])
        x1, y1, z1 = max(x1, boxes[b, 3]), max(y1, boxes[b, 4]), max(z1, boxes[b, 5])
    return (x0, y0, z0), (x1, y1, z1)


@inline_kernel
def swept_fill(space: CollisionSpace, low: Corner, high: Corner, cell: Corner, reach: Corner) -> tuple[int, int]:
    """Return how full the box is that the component sweeps over a block of placements.

    Args:
        space: Decides whether a placement is free.
        low: Lowest corner of :func:`bounding_box`.
        high: Highest corner of :func:`bounding_box`.
        cell: Reference cell in the middle of the block.
        reach: Cells from the middle to the farthest placements, per axis.

    Returns:
        Filled cells and volume of the box; outside the site counts as filled. If none is filled, every placement of
        the block is free. ``SURELY_BLOCKED`` if no placement is free.
    """
    x, y, z = cell
    u, v, w = reach
    hook_x, hook_y = x + space.hook_offset[0], y + space.hook_offset[1]
    on_site = 0 <= hook_x < space.hook_floor.shape[0] and 0 <= hook_y < space.hook_floor.shape[1]
    # Beyond the border only the share of filled cells counts: a block may lie across it.
    if on_site and not hook_is_free(space, x, y, max(z, 0)):
        return SURELY_BLOCKED
    table = space.table
    nx, ny, nz = table.shape[0] - 1, table.shape[1] - 1, table.shape[2] - 1
    x0, y0, z0 = x + low[0] - u, y + low[1] - v, z + low[2] - w
    x1, y1, z1 = x + high[0] + u, y + high[1] + v, z + high[2] + w
    inside_x0, inside_y0, inside_z0 = max(x0, 0), max(y0, 0), max(z0, 0)
    inside_x1, inside_y1, inside_z1 = min(x1, nx), min(y1, ny), min(z1, nz)
    if inside_x0 >= inside_x1 or inside_y0 >= inside_y1 or inside_z0 >= inside_z1:
        return SURELY_BLOCKED
    volume = (x1 - x0) * (y1 - y0) * (z1 - z0)
    inside = (inside_x1 - inside_x0) * (inside_y1 - inside_y0) * (inside_z1 - inside_z0)
    filled = volume - inside
    filled += box_sum(table, inside_x0, inside_y0, inside_z0, inside_x1, inside_y1, inside_z1)
    if filled == 0:
        return filled, volume
    # The core is what the component fills wherever in the block it is. Several boxes have none in common.
    core_x0, core_y0, core_z0 = x0 + 2 * u, y0 + 2 * v, z0 + 2 * w
    core_x1, core_y1, core_z1 = x1 - 2 * u, y1 - 2 * v, z1 - 2 * w
    if core_x0 < core_x1 and core_y0 < core_y1 and core_z0 < core_z1:
        if core_x0 < 0 or core_y0 < 0 or core_z0 < 0 or core_x1 > nx or core_y1 > ny or core_z1 > nz:
            return SURELY_BLOCKED
        if space.boxes.shape[0] == 1 and box_sum(table, core_x0, core_y0, core_z0, core_x1, core_y1, core_z1) != 0:
            return SURELY_BLOCKED
    return filled, volume
