"""One lift as a problem for the environment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.env.distance import UNREACHABLE, distance_field
from bimvox.site.collision import CollisionSpace
from bimvox.site.component import IntVec

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
