"""One lift as a problem for the environment, with the exact distance-to-go; and the default one, the paper's site."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.compiled import kernel
from bimvox.env.actions import ACTION_COUNT, MOVES
from bimvox.grid.summed_area import summed_area_table
from bimvox.site.collision import NOTHING_CLEARED, CollisionSpace, placement_is_free
from bimvox.site.component import IntVec

UNREACHABLE = -1
"""Entry of a distance field from which the target cannot be reached."""

_FARTHEST = 2**15 - 1
"""Largest distance of a field; anything farther counts as unreachable (int16 halves the memory of a large site)."""


@kernel
def distance_field(space: CollisionSpace, target: NDArray[np.int32]) -> NDArray[np.int16]:
    """Return the (X, Y, Z) int16 moves to a target, (3,) int32, by breadth-first search.

    ``UNREACHABLE`` if there is no path or the placement is not free; all cells are if the target is not free.
    """
    nx, ny, nz = space.table.shape[0] - 1, space.table.shape[1] - 1, space.table.shape[2] - 1
    unseen, blocked = np.int16(-3), np.int16(-2)
    field = np.full((nx, ny, nz), unseen, np.int16)
    if placement_is_free(space, target[0], target[1], target[2]):
        frontier = np.empty((1024, 3), np.int32)
        upcoming = np.empty((1024, 3), np.int32)
        frontier[0] = target
        count = 1
        field[target[0], target[1], target[2]] = 0
        distance = 0
        while count > 0 and distance < _FARTHEST:
            distance += 1
            found = 0
            if upcoming.shape[0] < ACTION_COUNT * count:
                upcoming = np.empty((2 * ACTION_COUNT * count, 3), np.int32)
            for c in range(count):
                for a in range(ACTION_COUNT):
                    x, y, z = frontier[c, 0] + MOVES[a, 0], frontier[c, 1] + MOVES[a, 1], frontier[c, 2] + MOVES[a, 2]
                    if x < 0 or y < 0 or z < 0 or x >= nx or y >= ny or z >= nz or field[x, y, z] != unseen:
                        continue
                    if placement_is_free(space, x, y, z):
                        field[x, y, z] = distance
                        upcoming[found, 0], upcoming[found, 1], upcoming[found, 2] = x, y, z
                        found += 1
                    else:
                        field[x, y, z] = blocked
            frontier, upcoming = upcoming, frontier
            count = found
    for x in range(nx):
        for y in range(ny):
            for z in range(nz):
                if field[x, y, z] < 0:
                    field[x, y, z] = UNREACHABLE
    return field


S = TypeVar("S", bound=np.generic)


@dataclass(frozen=True, slots=True, eq=False)
class LiftProblem:
    """One component to be brought from the yard to its place.

    Attributes:
        space: Decides whether a placement is free. Problems of one stage of assembly share its table.
        start_vox: Reference cell of the transit start.
        target_vox: Reference cell of the target.
        starts_vox: (S, 3) int32 all transit starts to learn from, ``start_vox`` among them.
        distance: (X, Y, Z) int16 moves to the target, for the teacher. None if the problem is not for training.
    """

    space: CollisionSpace
    start_vox: IntVec
    target_vox: IntVec
    starts_vox: NDArray[np.int32]
    distance: NDArray[np.int16] | None = None

    @property
    def grid_shape(self) -> IntVec:
        """(X, Y, Z) of the site."""
        x, y, z = self.space.table.shape
        return (x - 1, y - 1, z - 1)

    def distance_from(self, cell_vox: ArrayLike) -> int:
        """Return the moves to the target from a reference cell, ``UNREACHABLE`` (-1) if there is no path."""
        if self.distance is None:
            raise ValueError("this problem was made without its distance field")
        x, y, z = np.asarray(cell_vox)
        return int(self.distance[x, y, z])


def lift_problem(space: CollisionSpace, start_vox: IntVec, target_vox: IntVec) -> LiftProblem:
    """Return a problem for a roll-out: without a distance field, not for training."""
    return LiftProblem(plain_clearance(space), start_vox, target_vox, np.asarray([start_vox], np.int32), distance=None)


def training_problem(
    space: CollisionSpace, start_vox: IntVec, target_vox: IntVec, starts_vox: Sequence[IntVec] | ArrayLike = ()
) -> LiftProblem:
    """Return a problem for training, with its distance field.

    Args:
        space: Decides whether a placement is free.
        start_vox: Reference cell of the transit start.
        target_vox: Reference cell of the target.
        starts_vox: (S, 3) further transit starts in the yard; those that cannot reach the target are left out.

    Returns:
        The problem; ``starts_vox`` is empty if no start can reach the target (:func:`is_learnable`).
    """
    plain = plain_clearance(space)
    distance = distance_field(plain, np.asarray(target_vox, np.int32))
    candidates = np.concatenate(
        [np.asarray([start_vox], np.int32), np.asarray(starts_vox, np.int32).reshape(-1, 3)], axis=0
    )
    inside = ((candidates >= 0) & (candidates < distance.shape)).all(axis=1)
    candidates = candidates[inside]
    starts = np.unique(candidates[distance[tuple(candidates.T)] > 0], axis=0).astype(np.int32)
    return LiftProblem(plain, start_vox, target_vox, starts, distance)


def is_learnable(problem: LiftProblem) -> bool:
    """Return whether a problem has a distance field and at least one start from which the target can be reached."""
    return (
        problem.distance is not None
        and problem.distance_from(problem.target_vox) != UNREACHABLE
        and bool(len(problem.starts_vox))
    )


def plain_clearance(space: CollisionSpace) -> CollisionSpace:
    """Return a collision rule whose arrays are contiguous and writable; an array is copied only if it is not.

    Numba compiles a kernel once more for every combination of read-only and other arguments; this keeps it to one.
    """
    return CollisionSpace(
        table=_plain(space.table, np.int32),
        boxes=_plain(space.boxes, np.int32),
        hook_offset=_plain(space.hook_offset, np.int32),
        hook_floor=_plain(space.hook_floor, np.int32),
        cleared_low=_plain(space.cleared_low, np.int32),
        cleared=_plain(space.cleared, np.bool_),
        hook_ceiling=_plain(space.hook_ceiling, np.int32),
    )


def _plain(array: NDArray[S], dtype: type[S]) -> NDArray[S]:
    """Return the array itself if it fits, so that problems keep sharing a table."""
    if array.dtype == dtype and array.flags.c_contiguous and array.flags.writeable:
        return array
    return np.array(array, dtype, order="C")


_SITE_SHAPE: IntVec = (15, 15, 6)
"""Cells, the slab's layer k = 0 included."""

_CONSTRUCTION_AREA = (5, 10)
"""Cells [5, 10) in x and in y; the rest of the slab is yard."""

TARGET_VOX: IntVec = (7, 7, 1)


def default_problem(column_length_vox: int = 4, obstructions: tuple[tuple[IntVec, IntVec], ...] = ()) -> LiftProblem:
    """Return the paper's experiment: one column, upright, from anywhere in the yard to the middle; no crane, no rope.

    Args:
        column_length_vox: Length of the column. It lies in the yard along +x or +y, is upended about its lowest-index
            end and hoisted by one voxel, so it hangs at k = 2.
        obstructions: Half-open boxes (lowest corner, highest corner) of blocked cells.
    """
    occupied = np.zeros(_SITE_SHAPE, np.bool_)
    occupied[:, :, 0] = True
    for (x0, y0, z0), (x1, y1, z1) in obstructions:
        occupied[x0:x1, y0:y1, z0:z1] = True
    space = CollisionSpace(
        summed_area_table(occupied),
        np.array([[0, 0, 0, 1, 1, column_length_vox]], np.int32),
        np.array([0, 0, column_length_vox], np.int32),
        np.zeros(_SITE_SHAPE[:2], np.int32),
        *NOTHING_CLEARED,
    )
    starts = _yard_starts(occupied, column_length_vox)
    return training_problem(space, starts[0], TARGET_VOX, starts)


def _yard_starts(occupied: np.ndarray[tuple[int, int, int], np.dtype[np.bool_]], length_vox: int) -> list[IntVec]:
    """Return the transit starts of a column that fits lying in the yard, along either axis."""
    low, high = _CONSTRUCTION_AREA
    yard = np.ones(_SITE_SHAPE[:2], np.bool_)
    yard[low:high, low:high] = False
    yard &= ~occupied[:, :, 1]
    starts: list[IntVec] = []
    for x in range(_SITE_SHAPE[0]):
        for y in range(_SITE_SHAPE[1]):
            along_x = x + length_vox <= _SITE_SHAPE[0] and yard[x : x + length_vox, y].all()
            along_y = y + length_vox <= _SITE_SHAPE[1] and yard[x, y : y + length_vox].all()
            if along_x or along_y:
                starts.append((x, y, 2))
    return starts
