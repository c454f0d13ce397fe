"""The lifts to plan: one site, five kinds of parts, starts on one side, places on the other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bimvox.env.problem import LiftProblem, lift_problem
from bimvox.grid.summed_area import summed_area_table
from bimvox.site.collision import NOTHING_CLEARED, CollisionSpace

SHAPE = (200, 200, 60)
BOXES = 150
PARTS = ((1, 1, 4), (8, 1, 1), (1, 8, 1), (6, 4, 1), (5, 1, 3))
"""Edges in cells: a column, two beams, a slab, a wall."""


@dataclass(frozen=True, slots=True, eq=False)
class Problems:
    """The lifts.

    Attributes:
        lifts: The lifts, with collision rule, start and target.
        free: Per kind of part (X, Y, Z) bool, allowed reference cells: the input of point planners.
        kind: (N,) kind of each lift's part.
    """

    lifts: tuple[LiftProblem, ...]
    free: tuple[NDArray[np.bool_], ...]
    kind: NDArray[np.int64]


def make(count: int, seed: int) -> Problems:
    """Make lifts of parts among random boxes; every target can be reached.

    Args:
        count: Number of lifts.
        seed: The same seed gives the same lifts.
    """
    from bimvox.env.problem import distance_field

    rng = np.random.default_rng(seed)
    occupied = np.zeros(SHAPE, np.bool_)
    for _ in range(BOXES):
        size = rng.integers((5, 5, 5), (30, 30, 45))
        low = (rng.random(3) * (np.array(SHAPE) - size) * (1, 1, 0)).astype(np.int64)
        x, y, z = low + size
        occupied[low[0] : x, low[1] : y, low[2] : z] = True
    table = summed_area_table(occupied)
    lifts: list[LiftProblem] = []
    kinds, free = [], []
    for kind, part in enumerate(PARTS):
        boxes = np.array([[0, 0, 0, *part]], np.int32)
        space = CollisionSpace(table, boxes, np.zeros(3, np.int32), np.zeros(SHAPE[:2], np.int32), *NOTHING_CLEARED)
        placements = _free(occupied, part)
        free.append(placements)
        wanted = count // len(PARTS) + (kind < count % len(PARTS))
        starts = np.argwhere(placements[:30, :, :2])
        targets = np.argwhere(placements[60:]) + np.array((60, 0, 0))
        reach = np.zeros(SHAPE, np.bool_)
        while reach.sum() < 0.5 * placements.sum():  # not from inside an enclosed yard
            reach = distance_field(space, starts[rng.integers(len(starts))].astype(np.int32)) >= 0
        while wanted:
            start, target = (rows[rng.integers(len(rows))] for rows in (starts, targets))
            if reach[tuple(start)] and reach[tuple(target)]:
                lifts.append(lift_problem(space, _cell(start), _cell(target)))
                kinds.append(kind)
                wanted -= 1
    return Problems(tuple(lifts), tuple(free), np.array(kinds))


def _cell(row: NDArray[np.int64]) -> tuple[int, int, int]:
    x, y, z = (int(n) for n in row)
    return (x, y, z)


def _free(occupied: NDArray[np.bool_], part: tuple[int, int, int]) -> NDArray[np.bool_]:
    """Return where the lowest corner of a box may be."""
    blocked = occupied.copy()
    for axis, length in enumerate(part):
        grown = blocked.copy()
        for shift in range(1, length):
            ahead = np.ones_like(blocked)
            kept = [slice(None)] * 3
            moved = [slice(None)] * 3
            kept[axis], moved[axis] = slice(None, -shift), slice(shift, None)
            ahead[tuple(kept)] = blocked[tuple(moved)]
            grown |= ahead
        blocked = grown
    return ~blocked
