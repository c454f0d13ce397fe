"""The topics of what moves: frames, load, joints and commands, lift by lift."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache
from itertools import chain, tee
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.JointState_pb2 import JointState
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from numpy.typing import NDArray

from bimvox.crane.kinematics import joint_names, joints_of
from bimvox.crane.tower_crane import TowerCrane
from bimvox.log import schema as topics
from bimvox.log.crane_command import command_rows
from bimvox.log.driven import Driven, driven
from bimvox.log.mcap.form import Form
from bimvox.log.mcap.messages import stamp
from bimvox.log.mcap.rows import Rows
from bimvox.log.plan_log import PlanLog
from bimvox.log.rate import LogRate
from bimvox.log.track import crane_track, lift_times, nominal_track
from bimvox.log.transforms import CraneTransforms, load_transforms
from bimvox.motion.commands import commands, commands_at
from bimvox.records.motion import LiftMotion
from bimvox.records.track import LiftTimes, LoadTrack
from bimvox.site.site import Site


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
    """Return the messages of every sample of one lift's motion: frames, load, joints, commands.

    Args:
        record: The plan.
        motion: One of its motions.
    """
    site = record.plan.site
    (lift,) = (lift for lift in record.planned if lift.order == motion.order)
    one = driven(site, lift, motion, LogRate.FULL)
    return [rows for make in _makers(site, motion.crane, LogRate.FULL) for rows in make(one)]


def moving_streams(record: PlanLog) -> Iterator[Iterator[Rows]]:
    """Yield the streams of what moves: frames, load, joints and commands, each crane by crane."""
    site = record.plan.site
    if not record.motions:
        tracks = tracks_of(record)
        yield (rows for track in tracks for rows in load_transforms(track, site.components[track.lift.component].id))
        yield (_load_rows(track, 0) for track in tracks)
        return
    cranes = range(len(site.cranes))
    # A lift is made when the first stream needs it, and kept until the last one has used it.
    lifts = [tee(_driven(record, number), _MAKERS) for number in cranes]
    makers = [_makers(site, number, record.rate) for number in cranes]
    for n in range(_MAKERS):
        for number in cranes:
            yield chain.from_iterable(map(makers[number][n], lifts[number][n]))


def _driven(record: PlanLog, number: int) -> Iterator[Driven]:
    """Yield the lifts of a crane as it drives them."""
    for lift, motion in zip(record.planned, record.motions, strict=True):
        if motion.crane == number:
            yield driven(record.plan.site, lift, motion, record.rate)


Maker = Callable[[Driven], Iterable[Rows]]
"""Makes the messages of a lift on one topic."""
_MAKERS = 4


def _makers(site: Site, number: int, rate: LogRate) -> tuple[Maker, ...]:
    """Return the makers of a crane's frames, load, joints and commands."""
    crane, ids = site.cranes[number], [component.id for component in site.components]
    joints_topic, command_topic = (topics.of_crane(topic, number) for topic in (topics.JOINTS, topics.COMMAND))
    form = _joints_form(crane)

    def load(lift: Driven) -> Iterable[Rows]:
        return [_load_rows(lift.track, number, lift.load_shown)]

    def joints(lift: Driven) -> Iterable[Rows]:
        positions = joints_of(crane, lift.axes[lift.shown])
        return [Rows(lift.shown_ns, joints_topic, form.serialized(lift.shown_ns, positions))]

    def told(lift: Driven) -> Iterable[Rows]:
        if rate is LogRate.MOTION:
            found = commands_at(lift.motion, lift.shown_ns)
        else:
            found = commands(lift.motion, site.rules.sample_period_s)
        return [command_rows(found, ids, crane, topic=command_topic, named=site.has_several_cranes)]

    return CraneTransforms(crane, number).rows, load, joints, told


def _load_rows(track: LoadTrack, number: int, shown: NDArray[np.bool_] | slice = slice(None)) -> Rows:
    """Return the poses of a load; optionally only those that are shown."""
    time_ns, rows = track.time_ns[shown], np.concatenate([track.corner_m, track.tilt], axis=1)[shown]
    return Rows(time_ns, topics.of_crane(topics.LOAD, number), _load_form().serialized(time_ns, rows))


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
