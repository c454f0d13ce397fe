"""Many ROS 2 messages at once in CDR, their serialization: messages of one form differ in numbers alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.log.mcap.packed import Packed
from bimvox.units import NS_PER_S

Bytes = NDArray[np.uint8]
_LITTLE_ENDIAN = np.array([0, 1, 0, 0], np.uint8)
"""Before every message; nothing is aligned to it."""
_WIDEST = 8
"""The largest alignment, that of doubles."""


class Cdr:
    """N messages, or elements of a sequence, written field by field.

    Args:
        count: N.
        at: Where in its message each begins.
    """

    def __init__(self, count: int, at: int = 0) -> None:
        self._count, self._at, self.end = count, at, at
        self._columns: list[Bytes] = []

    def text(self, text: str) -> None:
        """Write a text that all have."""
        data = text.encode() + b"\0"
        self.number(len(data))
        self._put(np.frombuffer(data, np.uint8), 1)

    def texts(self, texts: Sequence[str]) -> None:
        """Write a sequence of texts that all have."""
        self.number(len(texts))
        for text in texts:
            self.text(text)

    def number(self, value: int) -> None:
        """Write a number of 32 bits that all have."""
        self._put(np.array([value], "<u4").view(np.uint8), 4)

    def time(self, time_ns: ArrayLike) -> None:
        """Write (N,) times or durations, nanoseconds."""
        parts = np.divmod(np.asarray(time_ns, np.int64), NS_PER_S)
        self._put(np.stack(parts, axis=1).astype("<u4").view(np.uint8), 4)

    def doubles(self, values: NDArray[np.float64]) -> None:
        """Write (N, K) doubles."""
        self._put(np.ascontiguousarray(values, "<f8").view(np.uint8), _WIDEST)

    def sequence(self, values: NDArray[np.float64]) -> None:
        """Write (N, K) doubles as a sequence in each."""
        self.number(values.shape[1])
        if values.shape[1]:
            self.doubles(values)

    def rows(self) -> Bytes:
        """Return (N, size) what was written."""
        return np.concatenate(self._columns, axis=1)

    def packed(self) -> Packed:
        """Return the messages."""
        rows = np.concatenate([np.broadcast_to(_LITTLE_ENDIAN, (self._count, 4)), self.rows()], axis=1)
        end = np.arange(1, self._count + 1, dtype=np.int64) * rows.shape[1]
        return Packed(rows.ravel(), end - rows.shape[1], end)

    def packed_with(self, count: int, element: Callable[[Cdr, slice], None]) -> Packed:
        """Return the one message that was written, and in it a sequence.

        Args:
            count: Number of elements.
            element: Writes some of the elements, a part of all.
        """
        self.number(count)
        first = Cdr(min(count, 1), self.end)
        element(first, slice(1))
        others = Cdr(count - first._count, first.end)
        element(others, slice(1, None))
        if (others.end - first.end) % _WIDEST:
            raise AssertionError("the elements of the sequence are not aligned alike")
        parts = (_LITTLE_ENDIAN, self.rows(), first.rows(), others.rows())
        flat = np.concatenate([part.ravel() for part in parts])
        return Packed(flat, np.zeros(1, np.int64), np.array([flat.size]))

    def _put(self, column: Bytes, alignment: int) -> None:
        gap = -self.end % alignment
        if gap:
            self._columns.append(np.zeros((self._count, gap), np.uint8))
        self._columns.append(np.broadcast_to(column, (self._count, column.shape[-1])))
        self.end += gap + column.shape[-1]
