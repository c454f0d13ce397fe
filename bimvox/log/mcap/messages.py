"""Times, vectors and poses in Foxglove's protobuf schemas."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.KeyValuePair_pb2 import KeyValuePair
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from google.protobuf.timestamp_pb2 import Timestamp

from bimvox.log.codec import ArrayWriter, encode
from bimvox.units import NS_PER_S


def stamp(time_ns: int) -> Timestamp:
    """Return nanoseconds since the start of the log as a timestamp."""
    return Timestamp(seconds=time_ns // NS_PER_S, nanos=time_ns % NS_PER_S)


def nanoseconds(timestamp: Any) -> int:
    """Return a timestamp as nanoseconds since the start of the log."""
    return int(timestamp.seconds) * NS_PER_S + int(timestamp.nanos)


def vector(xyz: Sequence[float]) -> Any:
    """Return (3,) metres as a vector."""
    return Vector3(x=xyz[0], y=xyz[1], z=xyz[2])


def about_z(angle_rad: float) -> Any:
    """Return a turn about z as a quaternion."""
    return Quaternion(z=math.sin(angle_rad / 2), w=math.cos(angle_rad / 2))


_UPRIGHT = about_z(0.0)


def pose(position_m: Sequence[float], yaw_rad: float = 0.0) -> Any:
    """Return a pose, upright, turned about z."""
    return Pose(position=vector(position_m), orientation=about_z(yaw_rad) if yaw_rad else _UPRIGHT)


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
