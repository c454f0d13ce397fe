"""A plan as a ROS 2 bag (MCAP storage), written with the package ``rosbags``; no ROS installation is needed.

============================  ==================================  ===================================================
topic                         type                                what
============================  ==================================  ===================================================
``/robot_description``        ``std_msgs/msg/String``             the crane's URDF
``/joint_states``             ``sensor_msgs/msg/JointState``      ``slewing`` rad, ``trolley`` m, ``hoist`` m of rope
``/joint_trajectory``         ``trajectory_msgs/msg/JointTra...`` one per lift, at its start: the same joints
``/lift/path``                ``nav_msgs/msg/Path``               one per lift: the load's corner in ``site``
``/tf``                       ``tf2_msgs/msg/TFMessage``          crane and load in the frame ``site``
============================  ==================================  ===================================================

Needs ``pip install 'bimvox[ros2]'``.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain, pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.kinematics import joint_names, joints_of
from bimvox.crane.tower_crane import TowerCrane
from bimvox.crane.urdf import urdf
from bimvox.errors import InputError
from bimvox.log.moving import tracks_of
from bimvox.log.plan_log import PlanLog
from bimvox.log.schema import of_crane
from bimvox.records.motion import LiftMotion
from bimvox.records.track import LoadTrack
from bimvox.units import NS_PER_S

_BAG_VERSION = 9


def write_ros2_bag(log: PlanLog, folder: Path) -> int:
    """Write a plan as a ROS 2 bag into a new folder and return the number of messages.

    Raises:
        InputError: If the package is not installed.
    """
    try:
        from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        raise InputError(
            "ROS 2 bags need the package rosbags, which is not installed", hint="pip install 'bimvox[ros2]'"
        ) from error
    store = get_typestore(Stores.ROS2_JAZZY)
    writer = Writer(folder, version=_BAG_VERSION, storage_plugin=StoragePlugin.MCAP)
    # This compresses the chunks of the MCAP file, which every reader supports.
    writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    with writer:
        bag = _Bag(writer, store)
        _write(bag, log)
    return bag.messages


class _Bag:
    """Serializes messages from plain values and writes them."""

    def __init__(self, writer: Any, store: Any) -> None:
        self._writer, self._store = writer, store
        self._connections: dict[str, Any] = {}
        self.messages = 0

    def make(self, kind: str, **fields: Any) -> Any:
        return self._store.types[kind](**fields)

    def header(self, time_ns: int, frame: str) -> Any:
        stamp = self.time(time_ns, "builtin_interfaces/msg/Time")
        return self.make("std_msgs/msg/Header", stamp=stamp, frame_id=frame)

    def time(self, time_ns: int, kind: str) -> Any:
        seconds, rest = divmod(int(time_ns), NS_PER_S)
        return self.make(kind, sec=seconds, nanosec=rest)

    def vector(self, xyz: Any) -> Any:
        x, y, z = (float(value) for value in xyz)
        return self.make("geometry_msgs/msg/Vector3", x=x, y=y, z=z)

    def quaternion(self, xyzw: Any) -> Any:
        x, y, z, w = (float(value) for value in xyzw)
        return self.make("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)

    def transform(self, time_ns: int, parent: str, child: str, xyz: Any, xyzw: Any) -> Any:
        moved = self.make("geometry_msgs/msg/Transform", translation=self.vector(xyz), rotation=self.quaternion(xyzw))
        return self.make(
            "geometry_msgs/msg/TransformStamped",
            header=self.header(time_ns, parent),
            child_frame_id=child,
            transform=moved,
        )

    def write(self, topic: str, time_ns: int, message: Any) -> None:
        kind = message.__msgtype__
        if topic not in self._connections:
            self._connections[topic] = self._writer.add_connection(topic, kind, typestore=self._store)
        self._writer.write(self._connections[topic], int(time_ns), self._store.serialize_cdr(message, kind))
        self.messages += 1


def _write(bag: _Bag, log: PlanLog) -> None:
    site = log.plan.site
    motions = {motion.order: motion for motion in log.motions}
    tracks = tracks_of(log)
    begins = min((track.start_ns for track in tracks), default=0)
    for number, crane in enumerate(site.cranes):
        prefix = of_crane("", number)
        robot = bag.make("std_msgs/msg/String", data=urdf(crane, prefix))
        bag.write(f"/{prefix}robot_description", begins, robot)
    lifts = (_lift(bag, log, track, motions.get(track.lift.order)) for track in tracks)
    messages: Iterable[tuple[str, int, Any]] = chain.from_iterable(lifts)
    if site.has_several_cranes:
        messages = sorted(messages, key=lambda message: message[1])  # lifts overlap
    for topic, time_ns, message in messages:
        bag.write(topic, time_ns, message)


def _lift(bag: _Bag, log: PlanLog, track: LoadTrack, motion: LiftMotion | None) -> Iterator[tuple[str, int, Any]]:
    """Yield topic, time and message of all messages of a lift, ordered by time."""
    site = log.plan.site
    yield "/lift/path", track.start_ns, _path(bag, track)
    loads = _loads(bag, track, f"component/{site.components[track.lift.component].id}")
    if motion is None or not site.cranes:
        for time_ns, transform in loads.items():
            yield "/tf", time_ns, bag.make("tf2_msgs/msg/TFMessage", transforms=[transform])
        return
    crane, prefix = site.cranes[motion.crane], of_crane("", motion.crane)
    times, axes = motion.samples()
    joints, names = joints_of(crane, axes), tuple(f"{prefix}{name}" for name in joint_names(crane))
    yield "/joint_trajectory", int(times[0]), _trajectory(bag, times, joints, names)
    for time_ns, values in zip(times.tolist(), joints, strict=True):
        state = bag.make(
            "sensor_msgs/msg/JointState",
            header=bag.header(time_ns, ""),
            name=list(names),
            position=values.copy(),
            velocity=np.zeros(0),
            effort=np.zeros(0),
        )
        yield "/joint_states", time_ns, state
        frames = _chain(bag, time_ns, crane, values, prefix)
        load = loads.get(time_ns)
        transforms = frames if load is None else [*frames, load]
        yield "/tf", time_ns, bag.make("tf2_msgs/msg/TFMessage", transforms=transforms)


def _path(bag: _Bag, track: LoadTrack) -> Any:
    poses = []
    for time_ns, corner in zip(track.time_ns.tolist(), track.corner_m, strict=True):
        x, y, z = (float(value) for value in corner)
        point, upright = bag.make("geometry_msgs/msg/Point", x=x, y=y, z=z), bag.quaternion((0, 0, 0, 1))
        pose = bag.make("geometry_msgs/msg/Pose", position=point, orientation=upright)
        poses.append(bag.make("geometry_msgs/msg/PoseStamped", header=bag.header(time_ns, "site"), pose=pose))
    return bag.make("nav_msgs/msg/Path", header=bag.header(track.start_ns, "site"), poses=poses)


def _loads(bag: _Bag, track: LoadTrack, frame: str) -> dict[int, Any]:
    return {
        time_ns: bag.transform(time_ns, "site", frame, corner, tilt)
        for time_ns, corner, tilt in zip(track.time_ns.tolist(), track.corner_m, track.tilt, strict=True)
    }


def _trajectory(bag: _Bag, times: NDArray[np.int64], joints: NDArray[np.float64], names: tuple[str, ...]) -> Any:
    none = np.zeros(0)
    points = [
        bag.make(
            "trajectory_msgs/msg/JointTrajectoryPoint",
            positions=values.copy(),
            velocities=none,
            accelerations=none,
            effort=none,
            time_from_start=bag.time(time_ns - int(times[0]), "builtin_interfaces/msg/Duration"),
        )
        for time_ns, values in zip(times.tolist(), joints, strict=True)
    ]
    header = bag.header(int(times[0]), "")
    return bag.make("trajectory_msgs/msg/JointTrajectory", header=header, joint_names=list(names), points=points)


def _chain(bag: _Bag, time_ns: int, crane: TowerCrane, joints: NDArray[np.float64], prefix: str) -> list[Any]:
    """Return the crane's frames, as in its URDF."""
    slew, radius, rope = (float(value) for value in joints)
    base_m, top_m, jib = crane.base_m, crane.jib_height_m, crane.luffing
    none, turn = (0, 0, 0, 1), (0, 0, np.sin(slew / 2), np.cos(slew / 2))
    frames: list[tuple[str, Any, Any]] = [("crane_base", base_m, none)]
    if jib is not None:
        half = radius / 2.0  # the second joint is the luff angle
        frames += [
            ("platform", (0, 0, jib.pivot_height_m - float(base_m[2])), turn),
            ("jib", (jib.pivot_offset_m, 0, 0), (0, -np.sin(half), 0, np.cos(half))),
            ("tip", (jib.length_m, 0, 0), (0, np.sin(half), 0, np.cos(half))),
        ]
    else:
        frames += [("jib", (0, 0, top_m - float(base_m[2])), turn), ("trolley", (radius, 0, 0), none)]
    frames.append(("hook", (0, 0, -rope), none))
    names = ["site", *(f"{prefix}{name}" for name, _, _ in frames)]
    return [
        bag.transform(time_ns, parent, child, at, rotation)
        for (parent, child), (_, at, rotation) in zip(pairwise(names), frames, strict=True)
    ]
