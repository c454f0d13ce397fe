"""Streams of messages put into one, by time."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np

from bimvox.log.rows import Rows

Timed = tuple[int, str, Any]
"""Time on the site's clock (ns), topic, message."""

_NEVER = np.iinfo(np.int64).max


def merged(streams: Sequence[Iterable[Timed | Rows]], cuts_ns: Sequence[int] = ()) -> Iterator[tuple[int, str, bytes]]:
    """Yield the messages of all streams by time; at equal times in the order of the streams.

    Args:
        streams: Each with its messages by time, one by one or in rows.
        cuts_ns: Ascending times; what comes before one is held in memory at once.

    Yields:
        Time, topic, serialized message.
    """
    waiting = [_Stream(stream) for stream in streams]
    for cut_ns in (*cuts_ns, _NEVER):
        rows = [rows for stream in waiting for rows in stream.before(cut_ns)]
        if not rows:
            continue
        order = np.argsort(np.concatenate([one.time_ns for one in rows]), kind="stable").tolist()
        times = np.concatenate([one.time_ns for one in rows]).tolist()
        topics = [one.topic for one in rows for _ in one.data]
        data = [message for one in rows for message in one.data]
        for n in order:
            yield times[n], topics[n], data[n]


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
