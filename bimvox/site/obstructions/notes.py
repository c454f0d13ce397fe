"""Notes about obstructions: the first name theirs, the others are counted."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from enum import Enum
from functools import lru_cache

import numpy as np

from bimvox.grid.frame import GridFrame
from bimvox.site.checks import shown_m
from bimvox.site.component import IntVec

MOST_NAMED = 99
"""So many notes name their obstruction."""


class Where(Enum):
    """Where an obstruction is."""

    INSIDE = 0
    CLIPPED = 1
    OUTSIDE = 2


KINDS = {Where.CLIPPED: "clipped to the site", Where.OUTSIDE: "outside the site"}
"""What is counted."""


def note_about(name: str, where: Where, frame: GridFrame, shape: IntVec) -> str:
    """Return the note about an obstruction of an id that is not wholly inside the site."""
    if where is Where.OUTSIDE:
        return f"obstruction {name!r} lies outside the site, which is {_extent(frame, shape)}"
    return f"obstruction {name!r} is clipped to the site"


class Notes:
    """Gathers notes."""

    def __init__(self) -> None:
        self._named: list[str] = []
        self._left = MOST_NAMED
        self._more: Counter[str] = Counter()

    def add(self, kind: str, note: Callable[[], str], *, always: bool) -> None:
        """Add a note.

        Args:
            kind: What is counted if the note does not fit.
            note: Makes the note; there may be a million of them.
            always: Whether it is kept even if it does not fit.
        """
        self._left -= not always
        if always or self._left >= 0:
            self._named.append(note())
        else:
            self._more[kind] += 1

    def lines(self) -> tuple[str, ...]:
        """Return the notes in their order, and one about the others."""
        if not self._more:
            return tuple(self._named)
        counts = ", ".join(f"{count:,} {kind}" for kind, count in sorted(self._more.items()))
        return (*self._named, f"more obstructions: {counts}")


@lru_cache(maxsize=16)
def _extent(frame: GridFrame, shape: IntVec) -> str:
    """Return from where to where a grid reaches, as messages state it; a million obstructions may lie outside."""
    low, high = (shown_m(frame.corner_of(np.array(cell))) for cell in ((0, 0, 0), shape))
    return f"from {low} to {high} m"
