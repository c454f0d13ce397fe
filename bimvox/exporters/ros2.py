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

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.crane.kinematics import joint_names, joints_of
from bimvox.crane.links import links_of, urdf
from bimvox.crane.tower_crane import TowerCrane
from bimvox.errors import InputError
from bimvox.log.mcap.packed import Block, Packed, joined
from bimvox.log.moving import tracks_of
from bimvox.log.plan_log import PlanLog
from bimvox.log.schema import of_crane
from bimvox.records.motion import LiftMotion
from bimvox.records.track import LoadTrack
from bimvox.site.site import Site
from bimvox.units import NS_PER_S

_BAG_VERSION = 9
_ROBOT = "std_msgs/msg/String"
_TYPES = {
    "/lift/path": "nav_msgs/msg/Path",
    "/joint_trajectory": "trajectory_msgs/msg/JointTrajectory",
    "/joint_states": "sensor_msgs/msg/JointState",
    "/tf": "tf2_msgs/msg/TFMessage",
}
_TOPICS = tuple(_TYPES)
"""Of the messages about a lift."""
_PATH, _TRAJECTORY, _STATES, _FRAMES = range(len(_TOPICS))
_UPRIGHT = (0.0, 0.0, 0.0, 1.0)
Poses = NDArray[np.float64]
"""(N, 7) x, y, z, and a quaternion x, y, z, w."""


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
    connections: dict[str, Any] = {}
    messages = 0
    with writer:
        for block in _blocks(log):
            for time_ns, n, data in zip(block.time_ns.tolist(), block.topic.tolist(), block.data, strict=True):
                topic = block.topics[n]
                if topic not in connections:
                    kind = _TYPES.get(topic, _ROBOT)
                    connections[topic] = writer.add_connection(topic, kind, typestore=store)
                writer.write(connections[topic], time_ns, data)
            messages += len(block.data)
    return messages


def _blocks(log: PlanLog) -> Iterator[Block]:
    """Yield all messages, ordered by time."""
    site, tracks = log.plan.site, tracks_of(log)
    motions = {motion.order: motion for motion in log.motions}
    begins = min((track.start_ns for track in tracks), default=0)
    for number, crane in enumerate(site.cranes):
        prefix = of_crane("", number)
        robot = Cdr(1)
        robot.text(urdf(crane, prefix))
        yield Block(np.array([begins]), (f"/{prefix}robot_description",), np.zeros(1, np.int64), robot.packed())
    lifts = (
        block
        for track in tracks
        for block in (
            _lift(log, track, motions.get(track.lift.order)),
            *_second(site, motions.get(track.lift.order)),
        )
    )
    yield from _by_time([*lifts]) if site.has_several_cranes else lifts


def _by_time(blocks: Sequence[Block]) -> Iterator[Block]:
    """Yield messages of lifts that overlap as one block."""
    if blocks:
        time_ns = np.concatenate([block.time_ns for block in blocks])
        order = np.argsort(time_ns, kind="stable")
        topic = np.concatenate([block.topic for block in blocks])
        yield Block(time_ns[order], _TOPICS, topic[order], joined([block.data for block in blocks]).picked(order))


def _lift(log: PlanLog, track: LoadTrack, motion: LiftMotion | None) -> Block:
    """Return all messages of a lift, ordered by time."""
    site = log.plan.site
    frame = f"component/{site.components[track.lift.component].id}"
    poses = np.concatenate([track.corner_m, track.tilt], axis=1)
    if motion is None or not site.cranes:
        data = joined([_path(track), _frames(track.time_ns, {frame: ("site", poses)})])
        topic = np.concatenate([[_PATH], np.full(len(track.time_ns), _FRAMES)])
        return Block(np.concatenate([[track.start_ns], track.time_ns]), _TOPICS, topic, data)
    crane, prefix = site.cranes[motion.crane], of_crane("", motion.crane)
    times_ns, axes = motion.samples()
    joints, names = joints_of(crane, axes), tuple(f"{prefix}{name}" for name in joint_names(crane))
    chain = _chain(crane, joints, prefix)
    at = np.searchsorted(track.time_ns, times_ns, side="right") - 1
    carries = track.time_ns[at] == times_ns
    empty, loaded = np.flatnonzero(~carries), np.flatnonzero(carries)
    moved = {child: (parent, where[loaded]) for child, (parent, where) in chain.items()}
    data = joined(
        [
            _path(track),
            _trajectory(times_ns, joints, names),
            _states(times_ns, joints, names),
            _frames(times_ns[empty], {child: (parent, where[empty]) for child, (parent, where) in chain.items()}),
            _frames(times_ns[loaded], moved | {frame: ("site", poses[at[loaded]])}),
        ]
    )
    # Of each sample the joints, then the frames.
    samples = np.arange(len(times_ns))
    order = np.argsort(np.concatenate([[-2, -1], 2 * samples, 2 * empty + 1, 2 * loaded + 1]), kind="stable")
    topic = np.concatenate([[_PATH, _TRAJECTORY], np.tile([_STATES, _FRAMES], len(times_ns))])
    time_ns = np.concatenate([[track.start_ns, times_ns[0]], np.repeat(times_ns, 2)])
    return Block(time_ns, _TOPICS, topic, data.picked(order))


def _second(site: Site, motion: LiftMotion | None) -> Iterator[Block]:
    """Yield the messages of the second crane of a lift by two; the load is a child of the site."""
    if motion is None or motion.second is None:
        return
    crane, prefix = site.cranes[motion.second.crane], of_crane("", motion.second.crane)
    times_ns, axes = motion.second.samples()
    joints, names = joints_of(crane, axes), tuple(f"{prefix}{name}" for name in joint_names(crane))
    parts = [
        _trajectory(times_ns, joints, names),
        _states(times_ns, joints, names),
        _frames(times_ns, _chain(crane, joints, prefix)),
    ]
    samples = np.arange(len(times_ns))
    order = np.argsort(np.concatenate([[-1], 2 * samples, 2 * samples + 1]), kind="stable")
    topic = np.concatenate([[_TRAJECTORY], np.tile([_STATES, _FRAMES], len(times_ns))])
    time_ns = np.concatenate([times_ns[:1], np.repeat(times_ns, 2)])
    yield Block(time_ns, _TOPICS, topic, joined(parts).picked(order))


def _header(cdr: Cdr, time_ns: ArrayLike, frame: str) -> None:
    cdr.time(time_ns)
    cdr.text(frame)


def _path(track: LoadTrack) -> Packed:
    cdr = Cdr(1)
    _header(cdr, [track.start_ns], "site")

    def pose(cdr: Cdr, some: slice) -> None:
        corner_m = track.corner_m[some]
        _header(cdr, track.time_ns[some], "site")
        cdr.doubles(np.concatenate([corner_m, np.tile(_UPRIGHT, (len(corner_m), 1))], axis=1))

    return cdr.packed_with(len(track.time_ns), pose)


def _trajectory(times_ns: NDArray[np.int64], joints: NDArray[np.float64], names: tuple[str, ...]) -> Packed:
    cdr = Cdr(1)
    _header(cdr, times_ns[:1], "")
    cdr.texts(names)

    def point(cdr: Cdr, some: slice) -> None:
        cdr.sequence(joints[some])
        for _ in ("velocities", "accelerations", "effort"):
            cdr.number(0)
        cdr.time(times_ns[some] - times_ns[0])

    return cdr.packed_with(len(times_ns), point)


def _states(times_ns: NDArray[np.int64], joints: NDArray[np.float64], names: tuple[str, ...]) -> Packed:
    cdr = Cdr(len(times_ns))
    _header(cdr, times_ns, "")
    cdr.texts(names)
    cdr.sequence(joints)
    for _ in ("velocity", "effort"):
        cdr.number(0)
    return cdr.packed()


def _frames(times_ns: NDArray[np.int64], frames: dict[str, tuple[str, Poses]]) -> Packed:
    """Return the messages of frames: by their names each frame's parent, and where it is in it."""
    cdr = Cdr(len(times_ns))
    cdr.number(len(frames))
    for child, (parent, poses) in frames.items():
        _header(cdr, times_ns, parent)
        cdr.text(child)
        cdr.doubles(poses)
    return cdr.packed()


def _chain(crane: TowerCrane, joints: NDArray[np.float64], prefix: str) -> dict[str, tuple[str, Poses]]:
    """Return the crane's frames, as in its URDF: by their names each frame's parent, and where it is in it."""
    result = {}
    for joint in links_of(crane).joints:
        poses = np.tile([*joint.origin_m, *_UPRIGHT], (len(joints), 1))
        if joint.turns:
            poses[:, [3 + joint.along, 6]] = joint.moved(joints)
        elif joint.limits is not None:
            poses[:, joint.along] = joint.moved(joints)[:, 0]
        parent = joint.parent if joint.parent == "site" else f"{prefix}{joint.parent}"
        result[f"{prefix}{joint.child}"] = (parent, poses)
    return result


# Many ROS 2 messages at once in CDR, their serialization: messages of one form differ in numbers alone.

_Bytes = NDArray[np.uint8]
_LITTLE_ENDIAN = np.array([0, 1, 0, 0], np.uint8)
"""Before every message; nothing is aligned to it."""
_WIDEST = 8
"""The largest alignment, that of doubles."""


class Cdr:
    """N messages, or elements of a sequence, written field by field.

    Args:
        count: N.
        at: Where in its message each begins.
    """

    def __init__(self, count: int, at: int = 0) -> None:
        self._count, self._at, self.end = count, at, at
        self._columns: list[_Bytes] = []

    def text(self, text: str) -> None:
        """Write a text that all have."""
        data = text.encode() + b"\0"
        self.number(len(data))
        self._put(np.frombuffer(data, np.uint8), 1)

    def texts(self, texts: Sequence[str]) -> None:
        """Write a sequence of texts that all have."""
        self.number(len(texts))
        for text in texts:
            self.text(text)

    def number(self, value: int) -> None:
        """Write a number of 32 bits that all have."""
        self._put(np.array([value], "<u4").view(np.uint8), 4)

    def time(self, time_ns: ArrayLike) -> None:
        """Write (N,) times or durations, nanoseconds."""
        parts = np.divmod(np.asarray(time_ns, np.int64), NS_PER_S)
        self._put(np.stack(parts, axis=1).astype("<u4").view(np.uint8), 4)

    def doubles(self, values: NDArray[np.float64]) -> None:
        """Write (N, K) doubles."""
        self._put(np.ascontiguousarray(values, "<f8").view(np.uint8), _WIDEST)

    def sequence(self, values: NDArray[np.float64]) -> None:
        """Write (N, K) doubles as a sequence in each."""
        self.number(values.shape[1])
        if values.shape[1]:
            self.doubles(values)

    def rows(self) -> _Bytes:
        """Return (N, size) what was written."""
        return np.concatenate(self._columns, axis=1)

    def packed(self) -> Packed:
        """Return the messages."""
        rows = np.concatenate([np.broadcast_to(_LITTLE_ENDIAN, (self._count, 4)), self.rows()], axis=1)
        end = np.arange(1, self._count + 1, dtype=np.int64) * rows.shape[1]
        return Packed(rows.ravel(), end - rows.shape[1], end)

    def packed_with(self, count: int, element: Callable[[Cdr, slice], None]) -> Packed:
        """Return the one message that was written, and in it a sequence.

        ``element`` writes some of its ``count`` elements.
        """
        self.number(count)
        first = Cdr(min(count, 1), self.end)
        element(first, slice(1))
        others = Cdr(count - first._count, first.end)
        element(others, slice(1, None))
        if (others.end - first.end) % _WIDEST:
            raise AssertionError("the elements of the sequence are not aligned alike")
        parts = (_LITTLE_ENDIAN, self.rows(), first.rows(), others.rows())
        flat = np.concatenate([part.ravel() for part in parts])
        return Packed(flat, np.zeros(1, np.int64), np.array([flat.size]))

    def _put(self, column: _Bytes, alignment: int) -> None:
        gap = -self.end % alignment
        if gap:
            self._columns.append(np.zeros((self._count, gap), np.uint8))
        self._columns.append(np.broadcast_to(column, (self._count, column.shape[-1])))
        self.end += gap + column.shape[-1]
