"""Serialized ROS 2 messages are byte for byte those of another library."""

from __future__ import annotations

import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore

from bimvox.exporters.ros2 import Cdr

STORE = get_typestore(Stores.ROS2_JAZZY)
TIMES_NS = np.array([0, 1, 999_999_999, 1_000_000_000, 2**31 * 10**9 - 1])


def plainly(kind, **fields):
    return bytes(STORE.serialize_cdr(STORE.types[kind](**fields), kind))


def stamp(time_ns, kind="builtin_interfaces/msg/Time"):
    return STORE.types[kind](sec=int(time_ns) // 10**9, nanosec=int(time_ns) % 10**9)


def header(time_ns, frame):
    return STORE.types["std_msgs/msg/Header"](stamp=stamp(time_ns), frame_id=frame)


@pytest.mark.parametrize("frame", ["", "a", "site", "Stütze 1"])
@pytest.mark.parametrize("names", [(), ("slew",), ("crane_2/slewing", "trolley", "hoist")])
def test_many_messages_are_those_of_the_library(frame, names):
    positions = np.random.default_rng(3).normal(size=(len(TIMES_NS), len(names)))
    cdr = Cdr(len(TIMES_NS))
    cdr.time(TIMES_NS)
    cdr.text(frame)
    cdr.texts(names)
    cdr.sequence(positions)
    cdr.number(0)
    cdr.number(0)
    none = np.zeros(0)
    assert list(cdr.packed()) == [
        plainly(
            "sensor_msgs/msg/JointState",
            header=header(time_ns, frame),
            name=list(names),
            position=position,
            velocity=none,
            effort=none,
        )
        for time_ns, position in zip(TIMES_NS, positions, strict=True)
    ]


@pytest.mark.parametrize("count", [0, 1, 2, 5])
@pytest.mark.parametrize("names", [("ab",), ("abcdefg",)])
def test_a_sequence_of_many_elements_is_that_of_the_library(count, names):
    positions, times_ns = np.random.default_rng(5).normal(size=(count, 3)), TIMES_NS[:count]
    cdr = Cdr(1)
    cdr.time([7])
    cdr.text("site")
    cdr.texts(names)

    def point(cdr, some):
        cdr.sequence(positions[some])
        for _ in range(3):
            cdr.number(0)
        cdr.time(times_ns[some])

    none, kind = np.zeros(0), "trajectory_msgs/msg/JointTrajectoryPoint"
    points = [
        STORE.types[kind](
            positions=position,
            velocities=none,
            accelerations=none,
            effort=none,
            time_from_start=stamp(time_ns, "builtin_interfaces/msg/Duration"),
        )
        for position, time_ns in zip(positions, times_ns, strict=True)
    ]
    (made,) = cdr.packed_with(count, point)
    trajectory = "trajectory_msgs/msg/JointTrajectory"
    assert made == plainly(trajectory, header=header(7, "site"), joint_names=list(names), points=points)


def test_elements_that_are_not_aligned_alike_are_refused():
    def element(cdr, some):
        cdr.time(TIMES_NS[:3][some])
        cdr.number(1)

    with pytest.raises(AssertionError, match="not aligned alike"):
        Cdr(1).packed_with(3, element)
