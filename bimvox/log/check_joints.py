"""Proves that the joint states that viewers are shown are those of the proven motions."""

from __future__ import annotations

import numpy as np
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from numpy.typing import NDArray

from bimvox.crane.kinematics import axes_of_joints, joint_names
from bimvox.crane.tower_crane import TowerCrane
from bimvox.log import schema as topics
from bimvox.log.check import allowed_off, at_times
from bimvox.log.mcap.reader import Contents
from bimvox.log.plan_log import PlanLog
from bimvox.log.rate import LogRate
from bimvox.records.proof import Check

_SAME = 1e-6
"""Metres and radians: axes are written as joints and read again."""


def check_joint_states(contents: Contents, log: PlanLog) -> Check:
    """Check that joint states are on the motion's axes, and straight lines between them close to all of its samples."""
    check = Check("joint_states", unit="m")
    shown = [_shown(contents, crane, number) for number, crane in enumerate(log.plan.site.cranes)]
    for motion in log.motions:
        name, (shown_ns, axes) = f"lift {motion.number}", shown[motion.crane]
        time_ns, wanted = motion.samples()
        # One lift may begin when another ends: of two messages at a border, its own is the one inside.
        first = max(0, int(np.searchsorted(shown_ns, time_ns[0], side="right")) - 1)
        last = int(np.searchsorted(shown_ns, time_ns[-1], side="left")) + 1
        own_ns, axes = shown_ns[first:last], axes[first:last]
        ends = len(own_ns) > 1 and (own_ns[0], own_ns[-1]) == (time_ns[0], time_ns[-1])
        if not ends or (np.diff(own_ns) <= 0).any() or not np.isin(own_ns, time_ns).all():
            check.look(False, f"{name}: its joint states are missing or have other times")
            continue
        off = np.abs(at_times(time_ns, own_ns, axes) - wanted)
        at_shown = np.isin(time_ns, own_ns)
        allowed = np.full_like(off, _SAME)
        if log.rate is LogRate.MOTION:
            allowed[~at_shown] += allowed_off(wanted)[~at_shown]
        worst = int(np.argmax((off / allowed).max(axis=1)))
        good = bool((off <= allowed).all())
        if good:
            check.measure(float(off[:, 1:].max()))
        check.look(
            good,
            f"{name}: at {time_ns[worst] / 1e9:.3f} s its joint states lead away from the motion",
            samples=len(off),
        )
    return check


def _shown(contents: Contents, crane: TowerCrane, number: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the times of a crane's joint states, and the axes at them ((N, 3) slew, radius, height)."""
    topic, names = topics.of_crane(topics.JOINTS, number), joint_names(crane)
    found = [message for message in contents.messages if message.topic == topic]
    states = [{joint.name: joint.position for joint in JointStates.FromString(m.data).joints} for m in found]
    joints = np.array([[state.get(name, np.nan) for name in names] for state in states], np.float64).reshape(-1, 3)
    return np.array([message.time_ns for message in found], np.int64), axes_of_joints(crane, joints)
