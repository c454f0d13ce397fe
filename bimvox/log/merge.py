"""Streams of messages put into one, by time."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.log.rows import Rows

Timed = tuple[int, str, Any]
"""Time on the site's clock (ns), topic, message."""


class Block(NamedTuple):
    """Messages that follow each other.

    Attributes:
        time_ns: (N,) int64, ascending.
        topics: Names of the topics that are among them.
        topic: (N,) int64 index into them.
        data: N serialized messages.
    """

    time_ns: NDArray[np.int64]
    topics: tuple[str, ...]
    topic: NDArray[np.int64]
    data: list[bytes]


_NEVER = np.iinfo(np.int64).max


def merged(streams: Sequence[Iterable[Timed | Rows]], cuts_ns: Sequence[int] = ()) -> Iterator[Block]:
    """Yield the messages of all streams by time; at equal times in the order of the streams.

    Args:
        streams: Each with its messages by time, one by one or in rows.
        cuts_ns: Ascending times; what comes before one is held in memory at once, and is a block.
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
        data = [message for one in rows for message in one.data]
        yield Block(times_ns[order], topics, of_topic[order], [data[n] for n in order.tolist()])


class _Stream:
    def __init__(self, messages: Iterable[Timed | Rows]) -> None:
        self._messages = iter(messages)
        self._left: Rows | None = None

    def before(self, cut_ns: int) -> Iterator[Rows]:
        """Everything before a time; what was begun is kept for the next time."""
        while True:
            rows = self._left if self._left is not None else self._next()
            self._left = None
            if rows is None:
                return
            count = len(rows.data) if cut_ns == _NEVER else int(np.searchsorted(rows.time_ns, cut_ns))
            if count < len(rows.data):
                self._left = Rows(rows.time_ns[count:], rows.topic, rows.data[count:])
            if count:
                yield Rows(rows.time_ns[:count], rows.topic, rows.data[:count])
            if self._left is not None:
                return

    def _next(self) -> Rows | None:
        for message in self._messages:
            if isinstance(message, Rows):
                if message.data:
                    return message
                continue
            time_ns, topic, content = message
            return Rows(np.array([time_ns], np.int64), topic, [content.SerializeToString(deterministic=True)])
        return None
