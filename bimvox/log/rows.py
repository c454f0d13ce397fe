"""Many messages of one form at once: serialized by numpy, not one by one.

A log holds about 3,000 messages a lift that differ in a time stamp and a few doubles. Messages whose time stamp takes
as many bytes and whose same doubles are zero (protobuf leaves those out) have the same layout; where in it the values
are is found by serializing one of them with other values. The bytes are those of protobuf's own serialization.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.log.messages import NS_PER_S

Example = Callable[[int, Sequence[float]], Any]
"""From a time (ns) and values to the message."""

_SECONDS = (0, 0x2A, 0x2AAA, 0x15_5555, 0xAAA_AAAA, 0x5_5555_5555)
_NANOS = (0, 0x2A, 0x2AAA, 0x15_5555, 0xAAA_AAAA, 0x2AAA_AAAA)
"""Values that take so many bytes, to be looked for."""
_SECONDS_TAG, _NANOS_TAG = 0x08, 0x10
_LONGER = np.array([1, *(1 << (7 * n) for n in range(1, 9))], np.int64)
_DOUBLE = 0x4A5B_6C7D_0000_0000
"""Bits of the first of the doubles to be looked for."""


class Rows(NamedTuple):
    """Serialized messages of one topic.

    Attributes:
        time_ns: (N,) int64, ascending.
        topic: Its name.
        data: N messages.
    """

    time_ns: NDArray[np.int64]
    topic: str
    data: list[bytes]


def rows_of(topic: str, time_ns: NDArray[np.int64], values: NDArray[np.float64], example: Example) -> Rows:
    """Return a message for each time.

    Args:
        topic: Their topic.
        time_ns: (N,) int64, ascending, not negative.
        values: (N, K) float64: the doubles of the messages; each is written as it is.
        example: Makes one message; the time is in it as time stamps only, each value in one place.
    """
    time_ns = np.asarray(time_ns, np.int64)
    data: list[bytes] = [b""] * len(time_ns)
    if not data:
        return Rows(time_ns, topic, data)
    values = np.ascontiguousarray(values, np.float64).reshape(len(time_ns), -1)
    seconds, nanos = np.divmod(time_ns, NS_PER_S)
    of_seconds, of_nanos = _varint_length(seconds), _varint_length(nanos)
    present = (values.view(np.uint64) != 0) @ (1 << np.arange(values.shape[1], dtype=np.int64))
    keys = (present << 8) + (of_seconds << 4) + of_nanos
    order = np.argsort(keys, kind="stable")
    borders = [0, *(np.flatnonzero(np.diff(keys[order])) + 1).tolist(), len(order)]
    for at, end in pairwise(borders):
        rows = order[at:end]
        lengths = int(of_seconds[rows[0]]), int(of_nanos[rows[0]])
        messages = _same_layout(seconds[rows], nanos[rows], values[rows], lengths, example)
        for row, message in zip(rows.tolist(), messages, strict=True):
            data[row] = message
    return Rows(time_ns, topic, data)


def _same_layout(
    seconds: NDArray[np.int64],
    nanos: NDArray[np.int64],
    values: NDArray[np.float64],
    lengths: tuple[int, int],
    example: Example,
) -> list[bytes]:
    first = _bytes(example(int(seconds[0]) * NS_PER_S + int(nanos[0]), values[0].tolist()))
    if len(seconds) == 1:
        return [first]
    used = np.flatnonzero(values[0].view(np.uint64))
    wanted = np.zeros(values.shape[1], np.uint64)
    wanted[used] = np.uint64(_DOUBLE) + used.astype(np.uint64)
    sentinel = _bytes(example(_SECONDS[lengths[0]] * NS_PER_S + _NANOS[lengths[1]], wanted.view(np.float64).tolist()))
    places: list[int] = []
    columns: list[NDArray[np.uint8]] = []
    stamp = [_stamp(np.array([part[n]]), n, tag) for part, n, tag in _parts(lengths)]
    pattern = b"".join(one.tobytes() for one in stamp)
    stamps = np.concatenate(
        [_stamp(part, n, tag) for part, (_, n, tag) in zip((seconds, nanos), _parts(lengths), strict=True)], axis=1
    )
    at = sentinel.find(pattern) if pattern else -1
    while at >= 0:
        places += range(at, at + len(pattern))
        columns.append(stamps)
        at = sentinel.find(pattern, at + len(pattern))
    bits = wanted[used].tobytes()
    for n in range(len(used)):
        at = sentinel.index(bits[8 * n : 8 * n + 8])
        places += range(at, at + 8)
    columns.append(np.ascontiguousarray(values[:, used]).view(np.uint8))
    table = np.tile(np.frombuffer(sentinel, np.uint8), (len(seconds), 1))
    table[:, places] = np.concatenate(columns, axis=1)
    whole, size = table.tobytes(), table.shape[1]
    messages = [whole[at : at + size] for at in range(0, len(whole), size)]
    if messages[0] != first:
        raise AssertionError("a message's bytes are not where they were found")
    return messages


def _parts(lengths: tuple[int, int]) -> tuple[tuple[tuple[int, ...], int, int], ...]:
    return (_SECONDS, lengths[0], _SECONDS_TAG), (_NANOS, lengths[1], _NANOS_TAG)


def _stamp(values: NDArray[np.int64], length: int, tag: int) -> NDArray[np.uint8]:
    """(N, L) one field of a time stamp: its tag and its value, nothing where it is zero."""
    if not length:
        return np.zeros((len(values), 0), np.uint8)
    septets = (values[:, None] >> (7 * np.arange(length))) & 0x7F
    more = np.where(np.arange(length) < length - 1, 0x80, 0)
    return np.concatenate([np.full((len(values), 1), tag), septets | more], axis=1).astype(np.uint8)


def _varint_length(values: NDArray[np.int64]) -> NDArray[np.int64]:
    """Bytes of each value; a zero is left out."""
    return np.searchsorted(_LONGER, values, side="right")


def _bytes(message: Any) -> bytes:
    data: bytes = message.SerializeToString(deterministic=True)
    return data
