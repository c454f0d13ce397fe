"""Work on two cores: by this process, and by a copy of it.

Where there is only one core, or no copy can be made, or it does not answer, the work is done here: the result is the
same.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Callable, Sequence
from typing import Any

from bimvox.revision.sides import Alone, Side
from bimvox_pipeline.watch.copied import LIMIT_S, Copied, Link, can_copy

_NUMBER = struct.Struct("<H")
_MOST = 2_000
"""Pieces that are shared at most: their numbers lie in a pipe, which holds 64 KiB, or a page."""


class Beside:
    """Shares work with a copy on another core.

    Args:
        limit_s: Time after which a copy is given up.
    """

    def __init__(self, limit_s: float = LIMIT_S) -> None:
        self._limit_s = limit_s
        self._shared: list[_Shared] = []

    def share(self, counts: Sequence[int], work: Callable[[Side], None]) -> Side:
        """Begin work in a copy that does some pieces of it, and return this side, which does the others.

        Args:
            counts: How many pieces there are of each kind.
            work: What the copy does with its side.
        """
        if not can_copy() or not any(counts) or max(counts) > _MOST:
            return Alone(counts)
        try:
            shared = _Shared(counts, work, self._limit_s)
        except OSError:
            return Alone(counts)
        self._shared.append(shared)
        return shared

    def close(self) -> None:
        """Give up the copies that are still at work."""
        for shared in self._shared:
            shared.give_up()
        self._shared = []


class _Shared:
    """This side of work that a copy does its share of.

    Args:
        counts: How many pieces there are of each kind.
        work: What the copy does with its side.
        limit_s: Time after which the copy is given up.

    Raises:
        OSError: If no copy can be made.
    """

    def __init__(self, counts: Sequence[int], work: Callable[[Side], None], limit_s: float) -> None:
        self._pieces = _Pieces(counts)
        try:
            self._copy = Copied(lambda link: work(_Side(self._pieces, link)), limit_s)
        except OSError:
            self._pieces.close()
            raise

    @property
    def goes_on(self) -> bool:
        """Whether the copy was not given up."""
        return self._copy.goes_on

    def claim(self, kind: int) -> int | None:
        """Return the number of a piece of that kind that nobody has claimed; None for no more."""
        return self._pieces.claim(kind)

    def give(self, found: Any) -> None:
        """Let the copy have something."""
        self._copy.give(found)

    def take(self) -> Any:
        """Wait for what the copy gives next; None where it gives nothing more, or too late."""
        return self._copy.take()

    def give_up(self) -> None:
        """End the copy, if it goes on still."""
        if self._copy.goes_on:
            self._copy.give_up()
            self._pieces.close()


class _Side:
    """The copy's side."""

    def __init__(self, pieces: _Pieces, link: Link) -> None:
        self.claim, self.give, self.take = pieces.claim, link.give, link.take


class _Pieces:
    """Numbers of pieces, ascending, each given out once to whoever asks first: they lie in pipes.

    Args:
        counts: How many there are of each kind.
    """

    def __init__(self, counts: Sequence[int]) -> None:
        self._reads: list[int] = []
        for count in counts:
            read, write = os.pipe()
            os.write(write, b"".join(_NUMBER.pack(n) for n in range(count)))
            os.close(write)
            self._reads.append(read)

    def claim(self, kind: int) -> int | None:
        """Return the next number of a kind; None for no more."""
        number = os.read(self._reads[kind], _NUMBER.size)
        return int(_NUMBER.unpack(number)[0]) if number else None

    def close(self) -> None:
        """Give none out any more."""
        for read in self._reads:
            os.close(read)
