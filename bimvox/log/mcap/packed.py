"""Many byte strings in one array, because a log has about a million messages: too many for a Python object each."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
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


# Merges streams of messages by time.


class Block(NamedTuple):
    """Consecutive messages.

    Attributes:
        time_ns: (N,) int64, ascending.
        topics: Names of their topics.
        topic: (N,) int64 index into them.
        data: N serialized messages.
    """

    time_ns: NDArray[np.int64]
    topics: tuple[str, ...]
    topic: NDArray[np.int64]
    data: Packed


_NEVER = np.iinfo(np.int64).max


def merged(streams: Sequence[Iterable[Timed | Rows]], cuts_ns: Sequence[int] = ()) -> Iterator[Block]:
    """Yield the messages of all streams by time; at equal times in the order of the streams.

    Args:
        streams: Each with its messages ordered by time, single or in rows.
        cuts_ns: Ascending times; the messages between two of them are in memory together and form a block.
    """
    waiting = [_Stream(stream) for stream in streams]
    for cut_ns in (*cuts_ns, _NEVER):
        rows = [rows for stream in waiting for rows in stream.before(cut_ns)]
        if not rows:
            continue
        topics = tuple(dict.fromkeys(one.topic for one in rows))
        number = {topic: n for n, topic in enumerate(topics)}
        times_ns = np.concatenate([one.time_ns for one in rows])
        order = np.argsort(times_ns, kind="stable")
        of_topic = np.repeat([number[one.topic] for one in rows], [len(one.data) for one in rows])
        data = joined([one.data for one in rows])
        yield Block(times_ns[order], topics, of_topic[order], data.picked(order))


class _Stream:
    def __init__(self, messages: Iterable[Timed | Rows]) -> None:
        self._messages = iter(messages)
        self._left: Rows | Timed | None = None

    def before(self, cut_ns: int) -> Iterator[Rows]:
        """Return all messages before a time; the rest of a started row is kept for the next call."""
        single: list[Timed] = []
        while (message := self._next()) is not None:
            if isinstance(message, Rows):
                count = len(message.data) if cut_ns == _NEVER else int(np.searchsorted(message.time_ns, cut_ns))
                if single:
                    yield rows_of(single)
                    single = []
                if count:
                    yield _part_of(message, slice(count))
                if count < len(message.data):
                    self._left = _part_of(message, slice(count, None))
                    return
                continue
            time_ns, topic, _ = message
            if time_ns >= cut_ns:
                self._left = message
                break
            if single and single[-1][1] != topic:
                yield rows_of(single)
                single = []
            single.append(message)
        if single:
            yield rows_of(single)

    def _next(self) -> Rows | Timed | None:
        left, self._left = self._left, None
        return next(self._messages, None) if left is None else left


def _part_of(rows: Rows, which: slice) -> Rows:
    return Rows(rows.time_ns[which], rows.topic, rows.data.picked(which))
