"""The empty hook between two lifts, under the same collision rule.

The empty hook is one cell at the lower end of its slings, where the load's top was, so that it starts where the loaded
hook ended.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.crane.tower_crane import TowerCrane
from bimvox.grid.summed_area import box_sum
from bimvox.motion.rigged_crane import HOOK_OFFSET
from bimvox.records.lift import YardPlace
from bimvox.site.collision import NOTHING_CLEARED, CollisionSpace
from bimvox.site.hook_room import hook_room
from bimvox.site.site import Site

HOOK_CELL = np.array([[0, 0, 0, 1, 1, 1]], np.int32)
_BLOCK = 8
"""Edge of the blocks of columns that are checked together first."""


def empty_hook_clearance(
    site: Site,
    crane: TowerCrane,
    space: CollisionSpace,
    place: YardPlace,
    left_vox: NDArray[np.int32],
    above: Sequence[NDArray[np.int32]] = (),
) -> CollisionSpace:
    """Return the collision rule for the empty hook between two lifts; it may go as far as the jib reaches.

    Args:
        site: The site.
        crane: The crane.
        space: The rule for the next part's own lift: its table holds the part just set, not the next part itself.
        place: Where the next part waits; the hook comes onto it from above.
        left_vox: (N, 3) cells of the slings' end on the last moves to the set point: the hook may leave along the path
            that it came by, even if neighbours share those cells.
        above: (N, 3) cells of other things that the table may lack: the hook is kept above them too.
    """
    top = top_of_table(space.table)
    for cells in above:
        np.maximum.at(top, (cells[:, 0], cells[:, 1]), cells[:, 2] + np.int32(1))
    floor, ceiling = hook_room(site, crane, top, None)
    floor = floor.copy()
    _reach_ends(site, crane, top, floor, [place.shape.cells + np.array(place.cell_vox, np.int32), left_vox])
    # The next part is not in the table: keep the hook above it.
    for cells in (place.shape.cells + np.array(place.cell_vox, np.int32), *above):
        np.maximum.at(floor, (cells[:, 0], cells[:, 1]), cells[:, 2] + np.int32(1))
    low, cleared = NOTHING_CLEARED
    if len(left_vox):
        low = left_vox.min(axis=0).astype(np.int32)
        cleared = np.zeros(left_vox.max(axis=0) - low + 1, np.bool_)
        cleared[tuple((left_vox - low).T)] = True
    return CollisionSpace(space.table, HOOK_CELL, HOOK_OFFSET, floor, low, cleared, ceiling)


def _reach_ends(
    site: Site,
    crane: TowerCrane,
    top: NDArray[np.int32],
    floor: NDArray[np.int32],
    ends: Sequence[NDArray[np.int32]],
) -> None:
    """Admit the columns next to both ends in ``floor`` (in place) although their middles may be just out of reach.

    At its ends the hook is above a centre of mass, where its load may be; the columns around it count as its own.
    """
    wide = hook_room(site, crane, top, None, slack_m=2.0 * site.frame.voxel_size_m).floor
    for cells in ends:
        if len(cells):
            low = np.maximum(cells[:, :2].min(axis=0) - 1, 0)
            near = (slice(low[0], cells[:, 0].max() + 2), slice(low[1], cells[:, 1].max() + 2))
            floor[near] = wide[near]


@kernel
def top_of_table(table: NDArray[np.int32]) -> NDArray[np.int32]:
    """(X, Y) int32 height map from a summed-area table: one above the highest occupied cell of each column."""
    nx, ny = table.shape[0] - 1, table.shape[1] - 1
    top = np.zeros((nx, ny), np.int32)
    # Most columns are as low as their neighbours: the top of a block bounds the tops of its columns.
    for i0 in range(0, nx, _BLOCK):
        for j0 in range(0, ny, _BLOCK):
            i1, j1 = min(i0 + _BLOCK, nx), min(j0 + _BLOCK, ny)
            highest = _top_of_box(table, i0, j0, i1, j1, table.shape[2] - 1)
            # The ground is level, mostly.
            level = highest > 0 and box_sum(table, i0, j0, highest - 1, i1, j1, highest) == (i1 - i0) * (j1 - j0)
            for i in range(i0, i1):
                for j in range(j0, j1):
                    top[i, j] = highest if level else _top_of_box(table, i, j, i + 1, j + 1, highest)
    return top


@leaf_kernel
def _top_of_box(table: NDArray[np.int32], x0: int, y0: int, x1: int, y1: int, highest: int) -> int:
    """One above the highest occupied cell of the columns [x0, x1) x [y0, y1); no cell above ``highest`` is occupied."""
    low, high = 0, highest
    while low < high:
        middle = (low + high) // 2
        if box_sum(table, x0, y0, middle, x1, y1, highest) == 0:
            high = middle
        else:
            low = middle + 1
    return low
