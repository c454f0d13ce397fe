"""Serializes many messages of one form with a kernel that is derived from one example.

Messages of one form differ in their time stamps, in doubles and in numbers. One example with recognizable values shows
where each value is in the bytes; everything between them is copied. As in protobuf, a value of zero is left out (unless
its schema distinguishes zero from unset), and a nested message is preceded by its length. Therefore the kernel writes
each message from its end to its beginning: every length is known before it is written.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import copy
from typing import Any, NamedTuple

import numpy as np
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.KeyValuePair_pb2 import KeyValuePair
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from google.protobuf.timestamp_pb2 import Timestamp
from numpy.typing import NDArray

from bimvox.compiled import leaf_kernel
from bimvox.log.codec import ArrayWriter, encode
from bimvox.log.mcap.packed import Packed
from bimvox.units import NS_PER_S

Example = Callable[..., Any]
"""Makes a message from a time (ns), doubles, and numbers if the form has any."""

_TEXT, _DOUBLE, _ANY_DOUBLE, _NUMBER, _TIME, _OPEN, _CLOSE = range(7)
"""What a step writes: constant bytes, a double unless it is 0, any double, a number, a time stamp, the length of the
nested message that begins, nothing (the nested message ends).
"""
_VARINT, _FIXED64, _LENGTH, _FIXED32 = 0, 1, 2, 5
"""Protobuf's wire types."""
_VALUES = ((_DOUBLE, _ANY_DOUBLE), (_NUMBER,))
_MOST = {_TEXT: 0, _DOUBLE: 8, _ANY_DOUBLE: 8, _NUMBER: 10, _TIME: 13, _OPEN: 5, _CLOSE: 0}
"""The most bytes that a step writes in addition to its constant ones."""
_STAMP = "google.protobuf.Timestamp"
_SOME_NS = 0x5_5555_5555 * NS_PER_S + 0x2AAA_AAAA
_SOME_DOUBLE = 0x4A5B_6C7D_0000_0000
"""Bits of the first of the doubles in the example."""


class _Values(NamedTuple):
    """What differs between N messages.

    Attributes:
        time_ns: (N,) int64.
        doubles: (N, K) uint64 bits of the doubles.
        numbers: (N, M) int64.
    """

    time_ns: NDArray[np.int64]
    doubles: NDArray[np.uint64]
    numbers: NDArray[np.int64]


class _Made(NamedTuple):
    """Where N messages are written.

    Attributes:
        flat: Room for all of them.
        begin: (N,) int64 where each begins.
        end: (N,) int64 where each ends.
    """

    flat: NDArray[np.uint8]
    begin: NDArray[np.int64]
    end: NDArray[np.int64]


class Form:
    """Messages of one form.

    Args:
        example: Makes one message. The time occurs only as time stamps, each double and each number exactly once.
        doubles: Number of doubles.
        numbers: Field numbers of the top-level integers that differ, which are not negative; ascending.
    """

    def __init__(self, example: Example, doubles: int, numbers: Sequence[int] = ()) -> None:
        self._example, self._numbers = example, tuple(numbers)
        self._doubles = doubles
        bits = np.uint64(_SOME_DOUBLE) + np.arange(doubles, dtype=np.uint64)
        message = self._message(_SOME_NS, bits.view(np.float64).tolist(), [1] * len(self._numbers))
        steps = list(self._steps(message.DESCRIPTOR, message.SerializeToString(deterministic=True), top=True))
        found = [sorted(value for kind, value, _ in steps if kind in kinds) for kinds in _VALUES]
        if found != [list(range(doubles)), list(range(len(self._numbers)))]:
            raise AssertionError("a value of the example message does not occur exactly once")
        steps = _shortened(steps)
        ends = np.cumsum([len(text) for *_, text in steps], dtype=np.int64)
        begins = np.concatenate([[0], ends])[: len(ends)]
        self._text = np.frombuffer(b"".join(text for *_, text in steps), np.uint8).copy()
        self._program = np.array(
            [(kind, value, begin, end) for (kind, value, _), begin, end in zip(steps, begins, ends, strict=True)],
            np.int64,
        ).reshape(-1, 4)
        self._most = len(self._text) + sum(_MOST[kind] for kind, *_ in steps)
        self._plain: tuple[Form, ...] = (self,)

    def followed_by(self, other: Form) -> Form:
        """Return the form of messages with the fields of both forms, and the doubles of both in turn.

        Protobuf merges messages by concatenation, so such a message is the bytes of one, then of the other.

        Args:
            other: A form of the same type without numbers; none of its fields comes before the last field of this form.
        """
        more = other._program + np.array([0, 0, len(self._text), len(self._text)])
        more[np.isin(more[:, 0], _VALUES[0]), 1] += self._doubles
        form = copy(self)
        form._program = np.concatenate([self._program, more])
        form._text = np.concatenate([self._text, other._text])
        form._doubles, form._most = self._doubles + other._doubles, self._most + other._most
        form._plain = (*self._plain, *other._plain)
        return form

    def serialized(
        self, time_ns: NDArray[np.int64], doubles: NDArray[np.float64], numbers: NDArray[np.int64] | None = None
    ) -> Packed:
        """Return a message for each time, with the same bytes as protobuf's own serialization.

        Args:
            time_ns: (N,) int64, not negative.
            doubles: (N, K) float64; each is written as it is.
            numbers: (N, M) int64, not negative.
        """
        count = len(time_ns)
        values = np.ascontiguousarray(doubles, np.float64).reshape(count, self._doubles)
        if numbers is None:
            numbers = np.zeros((count, 0), np.int64)
        numbers = np.ascontiguousarray(numbers, np.int64).reshape(count, len(self._numbers))
        out = np.empty(count * self._most, np.uint8)
        begin, end = np.empty(count, np.int64), np.empty(count, np.int64)
        open_at = np.empty(len(self._program) + 1, np.int64)
        bits = values.view(np.uint64)
        _write(
            self._program,
            self._text,
            _Values(np.asarray(time_ns, np.int64), bits, numbers),
            open_at,
            _Made(out, begin, end),
        )
        made = Packed(out, begin, end)
        if count and made[0] != self._plainly(int(time_ns[0]), values[0].tolist(), numbers[0].tolist()):
            raise AssertionError("a message differs from protobuf's own serialization")
        return made

    def _plainly(self, time_ns: int, doubles: Sequence[float], numbers: Sequence[int]) -> bytes:
        """Return a message as protobuf serializes it."""
        parts, at = [], 0
        for form in self._plain:
            own = doubles[at : at + form._doubles]
            at += form._doubles
            parts.append(form._message(time_ns, own, numbers).SerializeToString(deterministic=True))
        return b"".join(parts)

    def _message(self, time_ns: int, doubles: Sequence[float], numbers: Sequence[int]) -> Any:
        return self._example(time_ns, doubles, numbers) if self._numbers else self._example(time_ns, doubles)

    def _steps(self, descriptor: Any, data: bytes, *, top: bool) -> Iterator[tuple[int, int, bytes]]:
        """Yield the steps that write a message: kind of step, index of the value, constant bytes before the value."""
        fields, at = descriptor.fields_by_number, 0
        while at < len(data):
            begin = at
            key, at = _varint(data, at)
            number, wire, tag = key >> 3, key & 7, data[begin:at]
            if wire == _FIXED64:
                at += 8
                value = int.from_bytes(data[at - 8 : at], "little") - _SOME_DOUBLE
                kind = _ANY_DOUBLE if fields[number].has_presence else _DOUBLE
                yield (kind, value, tag) if 0 <= value < self._doubles else (_TEXT, 0, data[begin:at])
            elif wire == _LENGTH:
                length, at = _varint(data, at)
                inner, at = data[at : at + length], at + length
                of = fields[number].message_type
                if of is None:
                    yield _TEXT, 0, data[begin:at]
                elif of.full_name == _STAMP and inner == _SOME_STAMP:
                    yield _TIME, 0, tag
                else:
                    yield _OPEN, 0, tag
                    yield from self._steps(of, inner, top=False)
                    yield _CLOSE, 0, b""
            elif wire == _VARINT:
                _, at = _varint(data, at)
                is_value = top and number in self._numbers and not fields[number].has_presence
                yield (_NUMBER, self._numbers.index(number), tag) if is_value else (_TEXT, 0, data[begin:at])
            else:
                at += 4 if wire == _FIXED32 else len(data)
                yield _TEXT, 0, data[begin:at]


def _varint(data: bytes, at: int) -> tuple[int, int]:
    """Return a varint, and where it ends."""
    value = shift = 0
    while data[at] & 0x80:
        value |= (data[at] & 0x7F) << shift
        at, shift = at + 1, shift + 7
    return value | data[at] << shift, at + 1


def _of_varint(value: int) -> bytes:
    out = bytearray()
    while value >= 0x80:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*out, value])


_SOME_STAMP = b"\x08" + _of_varint(_SOME_NS // NS_PER_S) + b"\x10" + _of_varint(_SOME_NS % NS_PER_S)


def _shortened(steps: Sequence[tuple[int, int, bytes]]) -> list[tuple[int, int, bytes]]:
    """Return the steps with constant nested messages as bytes, and adjoining bytes joined."""
    done: list[tuple[int, int, bytes]] = []
    for kind, value, text in steps:
        if kind == _CLOSE:
            if done[-1][0] == _OPEN:
                kind, text = _TEXT, done.pop()[2] + b"\x00"
            elif done[-1][0] == _TEXT and done[-2][0] == _OPEN:
                inner, tag = done.pop()[2], done.pop()[2]
                kind, text = _TEXT, tag + _of_varint(len(inner)) + inner
        if kind == _TEXT and done and done[-1][0] == _TEXT:
            text = done.pop()[2] + text
        done.append((kind, value, text))
    return done


@leaf_kernel
def _put_varint(out: NDArray[np.uint8], at: int, value: int) -> int:
    """Write a varint that ends before ``at``; return where it begins."""
    length = 1
    rest = value >> 7
    while rest:
        length += 1
        rest >>= 7
    begin = at - length
    for n in range(length - 1):
        out[begin + n] = (value & 0x7F) | 0x80
        value >>= 7
    out[at - 1] = value
    return begin


@leaf_kernel
def _write(
    program: NDArray[np.int64], text: NDArray[np.uint8], values: _Values, open_at: NDArray[np.int64], made: _Made
) -> None:
    """Write the messages backwards from the end of ``made.flat``, the last one first."""
    time_ns, doubles, numbers = values.time_ns, values.doubles, values.numbers
    out, begin, end = made.flat, made.begin, made.end
    at = len(out)
    for row in range(len(time_ns) - 1, -1, -1):
        end[row] = at
        depth = 0
        for step in range(len(program) - 1, -1, -1):
            kind, value = program[step, 0], program[step, 1]
            if kind == _CLOSE:
                open_at[depth] = at
                depth += 1
                continue
            if kind in (_DOUBLE, _ANY_DOUBLE):
                bits = doubles[row, value]
                if bits == 0 and kind == _DOUBLE:
                    continue
                at -= 8
                eight = out[at : at + 8]
                for n in range(8):
                    eight[n] = (bits >> np.uint64(8 * n)) & np.uint64(0xFF)
            elif kind == _NUMBER:
                if numbers[row, value] == 0:
                    continue
                at = _put_varint(out, at, numbers[row, value])
            elif kind == _TIME:
                last = at
                seconds = time_ns[row] // NS_PER_S
                nanos = time_ns[row] - seconds * NS_PER_S
                if nanos:
                    at = _put_varint(out, at, nanos) - 1
                    out[at] = 0x10
                if seconds:
                    at = _put_varint(out, at, seconds) - 1
                    out[at] = 0x08
                at -= 1
                out[at] = last - at - 1
            elif kind == _OPEN:
                depth -= 1
                at = _put_varint(out, at, open_at[depth] - at)
            own = text[program[step, 2] : program[step, 3]]
            at -= len(own)
            there = out[at : at + len(own)]
            for n in range(len(own)):  # counting from 0 lets the compiler vectorize it
                there[n] = own[n]
        begin[row] = at


# Times, vectors and poses in Foxglove's protobuf schemas.


def stamp(time_ns: int) -> Timestamp:
    """Return nanoseconds since the start of the log as a timestamp."""
    return Timestamp(seconds=time_ns // NS_PER_S, nanos=time_ns % NS_PER_S)


def nanoseconds(timestamp: Any) -> int:
    """Return a timestamp as nanoseconds since the start of the log."""
    return int(timestamp.seconds) * NS_PER_S + int(timestamp.nanos)


def vector(xyz: Sequence[float]) -> Any:
    """Return (3,) metres as a vector."""
    return Vector3(x=xyz[0], y=xyz[1], z=xyz[2])


_UPRIGHT = Quaternion(w=1.0)


def pose(position_m: Sequence[float]) -> Any:
    """Return a pose, not turned."""
    return Pose(position=vector(position_m), orientation=_UPRIGHT)


def colour(rgba: Sequence[float]) -> Any:
    """Return red, green, blue and opacity, each 0..1, as a colour."""
    return Color(r=rgba[0], g=rgba[1], b=rgba[2], a=rgba[3])


def pairs(values: Mapping[str, object]) -> list[Any]:
    """Return a mapping as key-value pairs, in its order."""
    return [KeyValuePair(key=key, value=str(value)) for key, value in values.items()]


# Values that are encoded once and used in many documents.

# Quotes within a string are escaped, so this matches only references to arrays.
_REFERENCE = re.compile(r'(?<="dtype":")(\w+)","start":(\d+)')


class Encoded:
    """A value as text, with its arrays.

    Args:
        value: Input of :func:`~bimvox.log.codec.encode`; it must not change.
    """

    def __init__(self, value: Any) -> None:
        arrays = ArrayWriter()
        found = _REFERENCE.split(json_text(encode(value, arrays)))
        self._texts, self._dtypes = found[0::3], found[1::3]
        self._starts = [int(start) for start in found[2::3]]
        self._flat = arrays.flat()

    def text(self, arrays: ArrayWriter) -> str:
        """Return the value as JSON; its arrays go to ``arrays``."""
        shift = {dtype: arrays.put_flat(flat) for dtype, flat in self._flat.items()}
        pieces = [self._texts[0]]
        for dtype, start, text in zip(self._dtypes, self._starts, self._texts[1:], strict=True):
            pieces.append(f'{dtype}","start":{start + shift[dtype]}{text}')
        return "".join(pieces)


def json_text(value: Any) -> str:
    """Return plain JSON values as text without blanks."""
    return _COMPACT.encode(value)


_COMPACT = json.JSONEncoder(ensure_ascii=False, separators=(",", ":"))
