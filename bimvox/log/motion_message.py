"""``bimvox.LiftMotion``: the exact samples of a lift's motion, in columns, one message a lift.

A crane's motion has about 700 samples a lift. As messages of their own they cost 31 bytes and an entry of 16 bytes each
before their first value; in columns they cost only themselves. A column is the bytes of its 64-bit values' second
differences, all lowest bytes first, which compress to five sixths of the values' own.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from google.protobuf.descriptor_pb2 import FileDescriptorProto
from numpy.typing import NDArray

from bimvox.log.crane_command import TIMESTAMP, Field, class_of, descriptor_of, text_of
from bimvox.log.mcap.form import stamp
from bimvox.records.motion import LiftMotion
from bimvox.site.site import Site

MOTIONS = "/motions"
"""Its topic."""
MESSAGE = "LiftMotion"

FIELDS = (
    Field(1, TIMESTAMP, "time", "Start of the lift, on the site's clock."),
    Field(2, "uint32", "lift_order", "Order of the lift, from 0."),
    Field(3, "string", "component_id", "GlobalId, made unique."),
    Field(4, "string", "crane", "Name of the crane."),
    Field(5, "bytes", "time_ns", "Column of int64: every sample's time since the start."),
    Field(6, "bytes", "slew_rad", "Column of double: from the site's +x axis, counter-clockwise, unwrapped."),
    Field(7, "bytes", "radius_m", "Column of double: from the slewing axis to the hook."),
    Field(8, "bytes", "height_m", "Column of double: hook above the site's z = 0."),
)

_ABOUT = """\
The exact samples of a lift; in between, the axes move linearly. A column of N values has 8 N bytes: byte b of word n is
at N b + n, lowest byte first. Words are zigzag-coded (0, -1, 1, -2 ...) differences, modulo 2^64, of the differences
of the values' 64 bits; before the first value and the first difference is 0. In Python:

  words = numpy.frombuffer(column, numpy.uint8).reshape(8, -1).T.copy().view("<u8")[:, 0]
  values = ((words >> 1) ^ -(words & 1)).cumsum().cumsum().view("<f8")  # of time_ns: "<i8"
"""


def motion_descriptor() -> FileDescriptorProto:
    """Return the descriptor of the file that defines the message."""
    return descriptor_of(MESSAGE, FIELDS, {})


def motion_text() -> str:
    """Return the definition as ``.proto`` text."""
    return text_of(MESSAGE, _ABOUT.strip(), FIELDS, {})


LiftMotionMessage: Any = class_of(motion_descriptor())
"""The protobuf class."""

Samples = tuple[NDArray[np.int64], NDArray[np.float64]]
"""(N,) int64 times since the start of a lift, ns, and (N, 3) float64 slew (rad), radius (m) and height (m)."""


def motion_message(site: Site, motion: LiftMotion) -> Any:
    """Return the message with the samples of a motion."""
    time_ns, axes = motion.samples()
    slew, radius, height = map(column_of, axes.T)
    return LiftMotionMessage(
        time=stamp(motion.start_ns),
        lift_order=motion.order,
        component_id=site.components[motion.component].id,
        crane=site.cranes[motion.crane].name,
        time_ns=column_of(time_ns - motion.start_ns),
        slew_rad=slew,
        radius_m=radius,
        height_m=height,
    )


def add_samples(found: dict[int, dict[str, Samples]], data: bytes) -> None:
    """Add the samples of a message to those by lift order and name of the crane.

    Raises:
        ValueError: If its columns are damaged, or that crane has samples of the lift already.
    """
    message = LiftMotionMessage.FromString(data)
    number, own = message.lift_order + 1, found.setdefault(message.lift_order, {})
    if message.crane in own:
        raise ValueError(f"lift {number} has two motions")
    columns = (message.time_ns, message.slew_rad, message.radius_m, message.height_m)
    if len({len(column) for column in columns}) > 1 or len(columns[0]) % _WORD:
        raise ValueError(f"the columns of the motion of lift {number} differ in length")
    time_ns, *axes = map(_bits_of, columns)
    own[message.crane] = time_ns.view(np.int64), np.stack(axes, axis=1).view(np.float64)


def column_of(values: NDArray[np.int64] | NDArray[np.float64]) -> bytes:
    """Return values as a column."""
    steps = np.ascontiguousarray(values).view(np.int64)
    for _ in range(2):
        steps = np.diff(steps, prepend=0)
    words = ((steps << 1) ^ (steps >> 63)).astype("<i8")
    return words.view(np.uint8).reshape(-1, _WORD).T.tobytes()


def _bits_of(column: bytes) -> NDArray[np.uint64]:
    """Return the bits of the values of a column."""
    words = np.frombuffer(column, np.uint8).reshape(_WORD, -1).T.copy().view("<u8")[:, 0].astype(np.uint64)
    bits: NDArray[np.uint64] = ((words >> 1) ^ -(words & 1)).cumsum(dtype=np.uint64).cumsum(dtype=np.uint64)
    return bits


_WORD = 8
SamplesByLift = Mapping[int, Mapping[str, Samples]]
