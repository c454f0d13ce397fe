"""The default lift of ``gymnasium.make("bimvox/Lift-v0")``: the site of Zhu, Pauwels and de Vries (2021)."""

from __future__ import annotations

import numpy as np

from bimvox.env.problem import LiftProblem, training_problem
from bimvox.grid.summed_area import summed_area_table
from bimvox.site.collision import NOTHING_CLEARED, CollisionSpace
from bimvox.site.component import IntVec

SITE_SHAPE: IntVec = (15, 15, 6)
"""Cells, the slab's layer k = 0 included."""

CONSTRUCTION_AREA = (5, 10)
"""Cells [5, 10) in x and in y; the rest of the slab is yard."""

TARGET_VOX: IntVec = (7, 7, 1)


def default_problem(column_length_vox: int = 4, obstructions: tuple[tuple[IntVec, IntVec], ...] = ()) -> LiftProblem:
    """Return the paper's experiment: one column, upright, from anywhere in the yard to the middle; no crane, no rope.

    Args:
        column_length_vox: Length of the column. It lies in the yard along +x or +y, is upended about its lowest-index
            end and hoisted by one voxel, so it hangs at k = 2.
        obstructions: Half-open boxes (lowest corner, highest corner) of blocked cells.
    """
    occupied = np.zeros(SITE_SHAPE, np.bool_)
    occupied[:, :, 0] = True
    for (x0, y0, z0), (x1, y1, z1) in obstructions:
        occupied[x0:x1, y0:y1, z0:z1] = True
    space = CollisionSpace(
        summed_area_table(occupied),
        np.array([[0, 0, 0, 1, 1, column_length_vox]], np.int32),
        np.array([0, 0, column_length_vox], np.int32),
        np.zeros(SITE_SHAPE[:2], np.int32),
        *NOTHING_CLEARED,
    )
    starts = yard_starts(occupied, column_length_vox)
    return training_problem(space, starts[0], TARGET_VOX, starts)


def yard_starts(occupied: np.ndarray[tuple[int, int, int], np.dtype[np.bool_]], length_vox: int) -> list[IntVec]:
    """Return the transit starts of a column that fits lying in the yard, along either axis."""
    low, high = CONSTRUCTION_AREA
    yard = np.ones(SITE_SHAPE[:2], np.bool_)
    yard[low:high, low:high] = False
    yard &= ~occupied[:, :, 1]
    starts: list[IntVec] = []
    for x in range(SITE_SHAPE[0]):
        for y in range(SITE_SHAPE[1]):
            along_x = x + length_vox <= SITE_SHAPE[0] and yard[x : x + length_vox, y].all()
            along_y = y + length_vox <= SITE_SHAPE[1] and yard[x, y : y + length_vox].all()
            if along_x or along_y:
                starts.append((x, y, 2))
    return starts
