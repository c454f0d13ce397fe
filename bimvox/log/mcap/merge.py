"""Merges streams of messages by time."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.log.mcap.packed import Packed, Rows, Timed, joined, rows_of


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
