"""Spans and phases of the motions as JSON inside the log. The samples themselves are on ``/motions``."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.errors import LogFileError
from bimvox.log.codec import ArrayReader, ArrayWriter, DecodeError, decode, encode
from bimvox.log.motion_message import Samples, SamplesByLift
from bimvox.log.plan_json import lines_of
from bimvox.records.motion import LiftMotion, Phase, Trajectory, WindLimit
from bimvox.sparse import SPARSE


@dataclass(frozen=True, slots=True)
class _Part:
    """A trajectory without its samples; times from the start of the lift."""

    start_ns: int
    end_ns: int
    bound_s: float
    corner: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class _Record:
    """A motion without its samples."""

    order: int
    component: int
    start_ns: int
    end_ns: int
    phases: tuple[Phase, ...]
    approach: _Part | None
    raising: _Part
    loaded: _Part
    crane: int = field(default=0, metadata=SPARSE)
    departure: _Part | None = field(default=None, metadata=SPARSE)
    wind: WindLimit | None = field(default=None, metadata=SPARSE)
    second: _Record | None = field(default=None, metadata=SPARSE)


def motions_to_json(motions: Sequence[LiftMotion]) -> bytes:
    """Return everything about motions except their samples."""
    return lines_of("motions", encode([_record(motion) for motion in motions], ArrayWriter()))


def _record(motion: LiftMotion) -> _Record:
    return _Record(
        order=motion.order,
        component=motion.component,
        start_ns=motion.start_ns,
        end_ns=motion.end_ns,
        phases=motion.phases,
        approach=None if motion.approach is None else _part_of(motion.approach),
        raising=_part_of(motion.raising),
        loaded=_part_of(motion.loaded),
        crane=motion.crane,
        departure=None if motion.departure is None else _part_of(motion.departure),
        wind=motion.wind,
        second=None if motion.second is None else _record(motion.second),
    )


def motions_from_json(
    data: bytes, samples: SamplesByLift, cranes: Sequence[str], name: str, *, partial: bool = False
) -> tuple[LiftMotion, ...]:
    """Return the motions of a log.

    Args:
        data: The attachment.
        samples: The samples of every lift.
        cranes: The names of the site's cranes.
        name: Its source, for messages.
        partial: Leave out motions whose samples were lost.

    Raises:
        LogFileError: If it is damaged or does not fit the samples.
    """
    try:
        document = json.loads(data)
        if not isinstance(document, dict):
            document = {}
        records = decode(tuple[_Record, ...], document.get("motions"), ArrayReader({}), "motions")
        found = (_motion(record, samples.get(record.order, {}), cranes, partial) for record in records)
        return tuple(motion for motion in found if motion is not None)
    except (ValueError, RecursionError) as error:
        raise LogFileError(name, f"the motions in it cannot be read: {error}") from error


def _part_of(trajectory: Trajectory) -> _Part:
    return _Part(
        start_ns=int(trajectory.time_ns[0]),
        end_ns=int(trajectory.time_ns[-1]),
        bound_s=float(trajectory.bound_s),
        corner=tuple(int(n) for n in trajectory.corner),
    )


_LOST = np.zeros(0, np.int64), np.zeros((0, 3))


def _motion(record: _Record, of_lift: Mapping[str, Samples], cranes: Sequence[str], partial: bool) -> LiftMotion | None:
    second = None
    if record.second is not None:
        if record.second.second is not None or record.second.order != record.order:
            raise DecodeError(f"lift {record.order + 1}: the motion of its second crane is of another lift")
        second = _motion(record.second, of_lift, cranes, partial)
    own = cranes[record.crane] if 0 <= record.crane < len(cranes) else ""
    # A lift by one crane has one message, whatever crane that names: the proof compares it.
    others = tuple(of_lift.values()) if len(of_lift) == 1 and record.second is None else ()
    time_ns, axes = of_lift.get(own, others[0] if others else _LOST)
    if len(time_ns) < 2 or (second is None) != (record.second is None):
        if partial:
            return None
        raise DecodeError(f"lift {record.order + 1}: its samples are not all in the log")
    if time_ns[0] != 0 or time_ns[-1] != record.end_ns - record.start_ns or (np.diff(time_ns) <= 0).any():
        raise DecodeError(f"lift {record.order + 1}: its samples do not ascend from its start to its end")

    def cut(part: _Part) -> Trajectory:
        inside = (time_ns >= part.start_ns) & (time_ns <= part.end_ns)
        times = time_ns[inside]
        if not len(times) or times[0] != part.start_ns or times[-1] != part.end_ns:
            raise DecodeError(f"lift {record.order + 1}: its samples do not cover its motion")
        corner = np.array(part.corner, np.int64)
        if corner.size and (corner.min() < 0 or corner.max() >= len(times)):
            raise DecodeError(f"lift {record.order + 1}: a corner does not refer to a sample")
        slew_rad, radius_m, height_m = (_frozen(axis) for axis in axes[inside].T)
        return Trajectory(_frozen(times), slew_rad, radius_m, height_m, _frozen(corner), part.bound_s)

    return LiftMotion(
        order=record.order,
        component=record.component,
        approach=None if record.approach is None else cut(record.approach),
        raising=cut(record.raising),
        loaded=cut(record.loaded),
        phases=record.phases,
        start_ns=record.start_ns,
        end_ns=record.end_ns,
        crane=record.crane,
        departure=None if record.departure is None else cut(record.departure),
        wind=record.wind,
        second=second,
    )


def _frozen(array: NDArray[Any]) -> NDArray[Any]:
    array = np.ascontiguousarray(array)
    array.flags.writeable = False
    return array
