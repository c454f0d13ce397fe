"""Many byte strings in one array, because a log has about a million messages: too many for a Python object each."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class Packed:
    """Byte strings, each a span of one array; in any order.

    Attributes:
        flat: (B,) uint8 the bytes.
        begin: (N,) int64 where each begins in it.
        end: (N,) int64 where each ends.
    """

    flat: NDArray[np.uint8]
    begin: NDArray[np.int64]
    end: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.begin)

    def __getitem__(self, number: int) -> bytes:
        return self.flat[self.begin[number] : self.end[number]].tobytes()

    def __iter__(self) -> Iterator[bytes]:
        flat = self.flat.data
        return (bytes(flat[a:b]) for a, b in zip(self.begin.tolist(), self.end.tolist(), strict=True))

    @property
    def size(self) -> NDArray[np.int64]:
        """(N,) length of each in bytes."""
        size: NDArray[np.int64] = self.end - self.begin
        return size

    def picked(self, which: slice | NDArray[np.int64]) -> Packed:
        """Return some of them in the given order; no bytes are copied."""
        return Packed(self.flat, self.begin[which], self.end[which])


def packed(strings: Sequence[bytes]) -> Packed:
    """Return byte strings as one array."""
    end = np.cumsum(np.fromiter(map(len, strings), np.int64, len(strings)))
    return Packed(np.frombuffer(b"".join(strings), np.uint8), np.concatenate([[0], end])[: len(end)], end)


def joined(parts: Sequence[Packed]) -> Packed:
    """Return the byte strings of all parts, in one array."""
    starts = np.cumsum([0, *(part.flat.size for part in parts)])[: len(parts)].tolist()
    return Packed(
        np.concatenate([part.flat for part in parts]),
        np.concatenate([part.begin + start for part, start in zip(parts, starts, strict=True)]),
        np.concatenate([part.end + start for part, start in zip(parts, starts, strict=True)]),
    )


# Many messages of one topic at once, serialized.
#
# A log has about 3,000 messages per lift, which differ in a time stamp and a few doubles. A
# :class:`~bimvox.log.mcap.form.Form` serializes them together.

Timed = tuple[int, str, Any]
"""Time on the site's clock (ns), topic, message."""


class Rows(NamedTuple):
    """Serialized messages of one topic.

    Attributes:
        time_ns: (N,) int64, ascending.
        topic: Its name.
        data: N messages.
    """

    time_ns: NDArray[np.int64]
    topic: str
    data: Packed


def rows_of(messages: Sequence[Timed]) -> Rows:
    """Return messages of one topic as rows."""
    times_ns, topics, contents = zip(*messages, strict=True)
    data = packed([content.SerializeToString(deterministic=True) for content in contents])
    return Rows(np.array(times_ns, np.int64), topics[0], data)
