"""Times, vectors and poses in Foxglove's protobuf schemas."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.KeyValuePair_pb2 import KeyValuePair
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from google.protobuf.timestamp_pb2 import Timestamp

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
