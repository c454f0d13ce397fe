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
from bimvox.records.motion import LiftMotion, Phase
from bimvox.records.trajectory import Trajectory
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
    """A motion without its samples; of schema version 1 with their place among the joint states."""

    order: int
    component: int
    start_ns: int
    end_ns: int
    phases: tuple[Phase, ...]
    approach: _Part | None
    raising: _Part
    loaded: _Part
    first_sample: int | None = field(default=None, metadata=SPARSE)
    samples: int | None = field(default=None, metadata=SPARSE)
    crane: int = field(default=0, metadata=SPARSE)
    departure: _Part | None = field(default=None, metadata=SPARSE)


@dataclass(frozen=True, slots=True, eq=False)
class JointSamples:
    """The joint states of a crane in a log of schema version 1.

    Attributes:
        sequence: (N,) int64 message numbers, ascending; without gaps unless messages were lost.
        time_ns: (N,) int64.
        axes: (N, 3) float64 slew (rad), radius (m), height (m).
    """

    sequence: NDArray[np.int64]
    time_ns: NDArray[np.int64]
    axes: NDArray[np.float64]


def motions_to_json(motions: Sequence[LiftMotion], *, earlier: bool = False) -> bytes:
    """Return everything about motions except their samples; optionally as in schema version 1."""
    records = []
    firsts: dict[int, int] = {}
    for motion in motions:
        first = firsts.get(motion.crane, 0)
        count = len(motion.samples()[0]) if earlier else 0
        records.append(
            _Record(
                order=motion.order,
                component=motion.component,
                start_ns=motion.start_ns,
                end_ns=motion.end_ns,
                first_sample=first if earlier else None,
                samples=count if earlier else None,
                phases=motion.phases,
                approach=None if motion.approach is None else _part_of(motion.approach),
                raising=_part_of(motion.raising),
                loaded=_part_of(motion.loaded),
                crane=motion.crane,
                departure=None if motion.departure is None else _part_of(motion.departure),
            )
        )
        firsts[motion.crane] = first + count
    return lines_of("motions", encode(records, ArrayWriter()))


def motions_from_json(
    data: bytes, samples: SamplesByLift | Sequence[JointSamples], name: str, *, partial: bool = False
) -> tuple[LiftMotion, ...]:
    """Return the motions of a log.

    Args:
        data: What :func:`motions_to_json` returned.
        samples: The samples by lift; of a log of schema version 1 the joint states of every crane.
        name: Its source, for messages.
        partial: Leave out motions whose samples were lost, instead of raising an error.

    Raises:
        LogFileError: If it is damaged or does not fit the samples.
    """
    try:
        document = json.loads(data)
        if not isinstance(document, dict):
            document = {}
        records = decode(tuple[_Record, ...], document.get("motions"), ArrayReader({}), "motions")
        found = (_motion(record, _samples_of(record, samples), partial) for record in records)
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


def _samples_of(record: _Record, samples: SamplesByLift | Sequence[JointSamples]) -> Samples:
    """Return the samples of a record; fewer than two if they were lost."""
    if isinstance(samples, Mapping):
        return samples.get(record.order, _LOST)
    if not 0 <= record.crane < len(samples):
        raise DecodeError(f"lift {record.order + 1}: there is no crane {record.crane}")
    if record.first_sample is None or record.samples is None:
        raise DecodeError(f"lift {record.order + 1}: its place among the joint states is missing")
    joints = samples[record.crane]
    low, high = np.searchsorted(joints.sequence, [record.first_sample, record.first_sample + record.samples])
    if high - low != record.samples:
        return _LOST
    return joints.time_ns[low:high] - record.start_ns, joints.axes[low:high]


_LOST = np.zeros(0, np.int64), np.zeros((0, 3))


def _motion(record: _Record, samples: Samples, partial: bool) -> LiftMotion | None:
    time_ns, axes = samples
    if len(time_ns) < 2:
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
    )


def _frozen(array: NDArray[Any]) -> NDArray[Any]:
    array = np.ascontiguousarray(array)
    array.flags.writeable = False
    return array
