"""What the log has about lifts, lift by lift: paths, what moves (frames, load, joints, commands), exact samples."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache
from itertools import chain, tee
from typing import Any, NamedTuple

import numpy as np
from foxglove_schemas_protobuf.JointState_pb2 import JointState
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.PosesInFrame_pb2 import PosesInFrame
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from numpy.typing import NDArray

from bimvox.crane.kinematics import joint_names, joints_of
from bimvox.crane.tower_crane import TowerCrane
from bimvox.kept import kept
from bimvox.log import schema as topics
from bimvox.log.crane_command import command_rows
from bimvox.log.driven import Driven, driven
from bimvox.log.mcap.form import Form, pose, stamp
from bimvox.log.mcap.packed import Rows, Timed, rows_of
from bimvox.log.motion_message import MOTIONS, motion_message
from bimvox.log.plan_log import LogRate, PlanLog, shown_values
from bimvox.log.track import crane_track, lift_times, nominal_track
from bimvox.log.transforms import CraneTransforms, load_transforms
from bimvox.motion.commands import commands, commands_at
from bimvox.records.lift import Lift
from bimvox.records.motion import LiftMotion, by_each_crane
from bimvox.records.track import LiftTimes, LoadTrack
from bimvox.site.site import Site
from bimvox.workers import ALONE, Workers


def tracks_of(record: PlanLog) -> tuple[LoadTrack, ...]:
    """Return the load's track of every planned lift that the log carries, in order."""
    site = record.plan.site
    if record.motions:
        return tuple(
            crane_track(site, lift, motion) for lift, motion in zip(record.planned, record.motions, strict=True)
        )
    tracks: list[LoadTrack] = []
    for lift in record.planned:
        tracks.append(nominal_track(site, lift, tracks[-1].end_ns if tracks else 0))
    return tuple(tracks)


def times_of(record: PlanLog) -> tuple[LiftTimes, ...]:
    """Return when the load of every planned lift that the log carries enters each state, by start."""
    if not record.motions:
        return tracks_of(record)
    lifts = zip(record.planned, record.motions, strict=True)
    return tuple(sorted((lift_times(*pair) for pair in lifts), key=lambda one: one.start_ns))


def lift_rows(record: PlanLog, motion: LiftMotion) -> list[Rows]:
    """Return the messages of every sample of one lift's motion: frames, load, joints, commands."""
    site = record.plan.site
    (lift,) = (lift for lift in record.planned if lift.order == motion.order)
    return [rows for topic in _moving_rows(site, LogRate.FULL, lift, motion) for rows in topic]


def lift_streams(record: PlanLog, workers: Workers = ALONE) -> Iterator[Iterator[Timed | Rows]]:
    """Yield the streams of what is about lifts: paths, each topic of each crane, and the exact samples.

    ``workers`` make the messages of lifts ahead.
    """
    site = record.plan.site
    if not record.motions:
        tracks = tracks_of(record)
        yield (path_message(site, track.lift, track.start_ns) for track in tracks)
        yield (rows for track in tracks for rows in load_transforms(track, site.components[track.lift.component].id))
        yield (_load_rows(track, 0) for track in tracks)
        yield iter(())
        return
    cranes = range(len(site.cranes))
    # A lift is made when the first stream needs it, and kept until the last one has used it.
    paths, samples, *lifts = tee(_lifts(record, workers), 2 + _MAKERS * len(cranes))
    yield (rows for lift in paths for rows in lift.path)
    for n in range(_MAKERS):
        for number in cranes:
            yield _of_crane(lifts[number * _MAKERS + n], number, n)
    yield (rows for lift in samples for rows in lift.samples)


def _of_crane(lifts: Iterator[_LiftMessages], number: int, n: int) -> Iterator[Rows]:
    """Yield the messages that one maker of a crane has made."""
    return (rows for lift in lifts if lift.crane == number for rows in lift.moving[n])


class _LiftMessages(NamedTuple):
    """All messages about a lift.

    Attributes:
        crane: Index of its crane.
        path: Its path.
        moving: Frames, load, joints and commands.
        samples: Its exact samples.
    """

    crane: int
    path: list[Rows]
    moving: tuple[list[Rows], ...]
    samples: list[Rows]


_TOGETHER = 4
"""Lifts that a worker makes at once."""


def _lifts(record: PlanLog, workers: Workers) -> Iterator[_LiftMessages]:
    """Return the messages about each lift, in the order in which they begin."""
    every = zip(record.planned, record.motions, strict=True)
    halves = [(lift, own) for lift, motion in every for own in by_each_crane([motion])]
    lifts = sorted(halves, key=lambda one: (one[1].start_ns, one[1].order))
    parts = [lifts[first : first + _TOGETHER] for first in range(0, len(lifts), _TOGETHER)]
    made = workers.each(_messages, [(record.plan.site, record.rate, part) for part in parts])
    return chain.from_iterable(made)


def _messages(site: Site, rate: LogRate, lifts: Sequence[tuple[Lift, LiftMotion]]) -> list[_LiftMessages]:
    """Return the messages about lifts."""
    return [
        _LiftMessages(
            motion.crane,
            [] if _is_second(site, motion) else [rows_of([path_message(site, lift, motion.start_ns)])],
            _moving_rows(site, rate, lift, motion),
            [rows_of([(motion.start_ns, MOTIONS, motion_message(site, motion))])],
        )
        for lift, motion in lifts
    ]


def _is_second(site: Site, motion: LiftMotion) -> bool:
    """Return whether a motion is that of the second crane of a lift by two: the load is on the first one's topics."""
    component = site.components[motion.component]
    return component.tandem is not None and motion.crane == component.tandem.second


def _moving_rows(site: Site, rate: LogRate, lift: Lift, motion: LiftMotion) -> tuple[list[Rows], ...]:
    """Return frames, load, joints and commands of a lift's motion."""
    one = driven(site, lift, motion, rate)
    one = one.without_load() if _is_second(site, motion) else one
    return tuple([*make(one)] for make in _makers(site, motion.crane, rate))


Maker = Callable[[Driven], Iterable[Rows]]
"""Makes the messages of a lift on one topic."""
_MAKERS = 4


@kept
def _makers(site: Site, number: int, rate: LogRate) -> tuple[Maker, ...]:
    """Return the makers of a crane's frames, load, joints and commands."""
    crane, ids = site.cranes[number], [component.id for component in site.components]
    period_s, named = site.rules.sample_period_s, site.names_cranes
    joints_topic, command_topic = (topics.of_crane(topic, number) for topic in (topics.JOINTS, topics.COMMAND))
    form = _joints_form(crane)

    def load(lift: Driven) -> Iterable[Rows]:
        return [_load_rows(lift.track, number, lift.load_shown)] if lift.load_shown.any() else []

    def joints(lift: Driven) -> Iterable[Rows]:
        positions = joints_of(crane, lift.axes[lift.shown])
        return [Rows(lift.shown_ns, joints_topic, form.serialized(lift.shown_ns, shown_values(positions)))]

    def told(lift: Driven) -> Iterable[Rows]:
        found = commands_at(lift.motion, lift.shown_ns) if rate is LogRate.MOTION else commands(lift.motion, period_s)
        return [command_rows(found, ids, crane, topic=command_topic, named=named)]

    return CraneTransforms(crane, number).rows, load, joints, told


def _load_rows(track: LoadTrack, number: int, shown: NDArray[np.bool_] | slice = slice(None)) -> Rows:
    """Return the poses of a load; optionally only those that are shown."""
    time_ns, rows = track.time_ns[shown], np.concatenate([track.corner_m, track.tilt], axis=1)[shown]
    return Rows(time_ns, topics.of_crane(topics.LOAD, number), _load_form().serialized(time_ns, shown_values(rows)))


@cache
def _load_form() -> Form:
    at = PoseInFrame(frame_id="site", pose=Pose(position=Vector3(), orientation=Quaternion()))
    position, turn = at.pose.position, at.pose.orientation

    def load_pose(time_ns: int, row: Sequence[float]) -> Any:
        at.timestamp.CopyFrom(stamp(time_ns))
        position.x, position.y, position.z, turn.x, turn.y, turn.z, turn.w = row
        return at

    return Form(load_pose, 7)


def _joints_form(crane: TowerCrane) -> Form:
    states = JointStates(joints=[JointState(name=name) for name in joint_names(crane)])

    def joints(time_ns: int, row: Sequence[float]) -> Any:
        states.timestamp.CopyFrom(stamp(time_ns))
        for state, value in zip(states.joints, row, strict=True):
            state.position = value
        return states

    return Form(joints, len(states.joints))


# The planned path of a lift as a message: the poses of its load.


def path_message(site: Site, lift: Lift, time_ns: int) -> Timed:
    """Return the message of a planned lift's path."""
    assert lift.path_vox is not None
    corners_m = site.frame.corner_of(lift.path_vox)
    poses = _poses_form().serialized(np.zeros(len(corners_m), np.int64), corners_m)
    head = PosesInFrame(timestamp=stamp(time_ns), frame_id="site").SerializeToString()
    # Protobuf merges concatenated messages into one with all fields.
    message = PosesInFrame.FromString(b"".join([head, *poses]))
    return time_ns, topics.of_crane(topics.PLANNED, site.components[lift.component].crane), message


@cache
def _poses_form() -> Form:
    return Form(lambda _, corner_m: PosesInFrame(poses=[pose(corner_m)]), 3)
