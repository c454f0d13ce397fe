"""The verifiers' raw cells: how many things occupy each. Kept between lifts, so only changes are marked."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.proof.moment import Thing
from bimvox.site.component import IntVec


class Marks:
    """Counts of things by cell.

    Cells that an invalid plan puts outside the grid are ignored; other checks report them.

    Args:
        shape: (X, Y, Z) of the site.
        present: What is there initially.

    Attributes:
        counts: (X, Y, Z) uint16.
    """

    def __init__(self, shape: IntVec, present: Sequence[Thing] = ()) -> None:
        self.counts = np.zeros(shape, np.uint16)
        self._given: Sequence[Thing] = ()
        self._present: set[Thing] = set()
        self.move_to(present)

    def move_to(self, present: Sequence[Thing]) -> None:
        """Update the counts so that exactly these things are present."""
        if present is self._given:
            return
        wanted = set(present)
        for thing in self._present - wanted:
            self._mark(thing, -1)
        for thing in wanted - self._present:
            self._mark(thing, 1)
        self._given, self._present = present, wanted

    @contextmanager
    def without(self, things: Sequence[Thing]) -> Iterator[None]:
        """Remove some of the things temporarily; nothing else may change meanwhile."""
        gone = self._present.intersection(things)
        self._present -= gone
        for thing in gone:
            self._mark(thing, -1)
        try:
            yield
        finally:
            for thing in gone:
                self._mark(thing, 1)
            self._present |= gone

    def _mark(self, thing: Thing, number: int) -> None:
        """Add a number to the counts of the cells that count for a thing."""
        _count(self.counts, thing.cells, number)

    def hits(self, own: NDArray[np.int32], placements: NDArray[np.int32] | NDArray[np.int64]) -> NDArray[np.bool_]:
        """Return (N,) whether any of a part's cells ((C, 3)) is occupied at each placement ((N, 3))."""
        hit: NDArray[np.bool_] = hits(self.counts, own, np.ascontiguousarray(placements, np.int64))
        return hit

    def over(self, hooks: NDArray[np.int32] | NDArray[np.int64]) -> NDArray[np.bool_]:
        """Return (N,) whether anything is in or above each cell ((N, 3)); False outside the grid."""
        hit: NDArray[np.bool_] = over(self.counts, np.ascontiguousarray(hooks, np.int64))
        return hit


@kernel
def _count(counts: NDArray[np.uint16], cells: NDArray[np.int32], number: int) -> None:
    nx, ny, nz = counts.shape
    for n in range(cells.shape[0]):
        x, y, z = cells[n, 0], cells[n, 1], cells[n, 2]
        if 0 <= x < nx and 0 <= y < ny and 0 <= z < nz:
            counts[x, y, z] += number


@kernel
def hits(counts: NDArray[np.uint16], own: NDArray[np.int32], placements: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return (N,) whether any of a part's cells ((C, 3)) is counted at each placement; False outside the grid."""
    nx, ny, nz = counts.shape
    hit = np.zeros(placements.shape[0], np.bool_)
    for n in range(placements.shape[0]):
        for c in range(own.shape[0]):
            x, y, z = placements[n, 0] + own[c, 0], placements[n, 1] + own[c, 1], placements[n, 2] + own[c, 2]
            if 0 <= x < nx and 0 <= y < ny and 0 <= z < nz and counts[x, y, z]:
                hit[n] = True
                break
    return hit


@kernel
def over(counts: NDArray[np.uint16], hooks: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Find the top of each column once, and keep it for later placements."""
    nx, ny, nz = counts.shape
    hit = np.zeros(hooks.shape[0], np.bool_)
    column_x, column_y, top = np.int64(-1), np.int64(-1), 0
    for n in range(hooks.shape[0]):
        x, y = hooks[n, 0], hooks[n, 1]
        if not (0 <= x < nx and 0 <= y < ny):
            continue
        if x != column_x or y != column_y:
            column_x, column_y, top = x, y, nz
            while top > 0 and counts[x, y, top - 1] == 0:
                top -= 1
        hit[n] = top > hooks[n, 2]
    return hit
