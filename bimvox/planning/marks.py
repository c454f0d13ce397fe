"""The verifier's raw cells: how many things occupy each, kept from lift to lift, so that only changes are marked."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np

from bimvox.planning.moment import Thing
from bimvox.site.component import IntVec


class Marks:
    """Counts of things by cell.

    Args:
        shape: (X, Y, Z) of the site.
        present: What is there at first.

    Attributes:
        counts: (X, Y, Z) uint16.
    """

    def __init__(self, shape: IntVec, present: Sequence[Thing] = ()) -> None:
        self.counts = np.zeros(shape, np.uint16)
        self._present: dict[int, Thing] = {}
        self.move_to(present)

    def move_to(self, present: Sequence[Thing]) -> None:
        """Make it so that just these things are there."""
        wanted = {id(thing): thing for thing in present}
        for key in self._present.keys() - wanted.keys():
            self.counts[tuple(self._present[key].cells.T)] -= 1
        for key in wanted.keys() - self._present.keys():
            self.counts[tuple(wanted[key].cells.T)] += 1
        self._present = wanted

    @contextmanager
    def without(self, things: Sequence[Thing]) -> Iterator[None]:
        """Take some of the things away for a while."""
        before = self._present
        gone = {id(thing) for thing in things}
        self.move_to([thing for key, thing in before.items() if key not in gone])
        try:
            yield
        finally:
            self.move_to(list(before.values()))
