"""Two who work on the same: what each of them is told, and what they tell each other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol


class Side(Protocol):
    """One of two who work on the same pieces, of some kinds."""

    def claim(self, kind: int) -> int | None:
        """Return the number of a piece of that kind that nobody has claimed, in ascending order; None for no more."""

    def give(self, found: Any) -> None:
        """Let the other side have something; it can be pickled."""

    def take(self) -> Any:
        """Wait for what the other side gives next; None where it gives nothing more."""


Together = Callable[[Sequence[int], Callable[[Side], None]], Side]
"""Begins work on so many pieces of each kind in a copy of what is here, where one can be made; returns this side."""


class Alone:
    """The only side there is.

    Args:
        counts: How many pieces there are of each kind.
    """

    def __init__(self, counts: Sequence[int]) -> None:
        self._left = [iter(range(count)) for count in counts]

    def claim(self, kind: int) -> int | None:
        """Return the number of the next piece of that kind; None for no more."""
        return next(self._left[kind], None)

    def give(self, found: Any) -> None:
        """Nobody is there to have it."""

    def take(self) -> Any:
        """Nobody is there to give anything."""
        return None


def alone(counts: Sequence[int], _: Callable[[Side], None]) -> Side:
    """Let nobody work beside."""
    return Alone(counts)
