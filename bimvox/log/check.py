"""Proves that the parts of a log are consistent: the proven plan is what viewers show and cranes receive."""

from __future__ import annotations

import hashlib
from collections import defaultdict
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from numpy.typing import NDArray

from bimvox.crane.kinematics import axes_of_joints, joint_names, pose_limits
from bimvox.crane.tower_crane import TowerCrane
from bimvox.errors import enumerated
from bimvox.log import schema as topics
from bimvox.log.crane_command import CraneCommandMessage
from bimvox.log.mcap.form import nanoseconds
from bimvox.log.mcap.reader import Contents
from bimvox.log.plan_log import LogRate, PlanLog
from bimvox.proof.space import reference_cells
from bimvox.proof.tandem import as_crane_sees
from bimvox.records.lift import Lift
from bimvox.records.motion import LiftMotion, by_each_crane
from bimvox.records.proof import Check
from bimvox.site.build import with_digests
from bimvox.site.lifting import crane_for
from bimvox.site.site import Site

_SAME_M = 1e-6
SHA256 = "sha256 "
"""Begins the metadata keys of the digests of attached files."""
_OVER_BEND = 1e-3
_ROUNDING = 1e-9
_SHOWN_M = 0.01
"""How far what is shown may be from the motion between two shown samples, in each coordinate."""
_SHOWN_QUATERNION = 1e-3
"""The same for each component of a quaternion."""
_ABOVE_M = 0.01
"""A load this close in plan to the line above its place may be guided."""


def check_digests(contents: Contents, log: PlanLog) -> Check:
    """Check every digest that can be computed from the contents of the log.

    The site's three digests are computed from the site in the log, those of attached files from the files. The model
    is not in a log: its digest is only compared between metadata and site.
    """
    check = Check("digests")
    metadata = contents.metadata.get(topics.METADATA, {})
    site, again = log.plan.site, with_digests(log.plan.site)
    for name, stored, computed in (
        ("geometry", site.geometry_digest, again.geometry_digest),
        ("fixed part", site.fixed_digest, again.fixed_digest),
        ("site", site.digest, again.digest),
    ):
        check.look(stored == computed, f"the {name}'s digest is {stored[:16]}, its content's is {computed[:16]}")
    for key, wanted in (
        ("geometry_digest", again.geometry_digest),
        ("site_digest", again.digest),
        ("model_sha256", str(site.source.get("sha256", ""))),
    ):
        said = metadata.get(key, "")
        check.look(said == wanted, f"metadata {key} is {said[:16]!r}, the site's is {wanted[:16]!r}")
    for name, data in log.attachments.items():
        is_missing = SHA256 + name not in metadata
        fault = "the metadata does not have its digest" if is_missing else "digest mismatch with the metadata"
        check.look(metadata.get(SHA256 + name) == hashlib.sha256(data).hexdigest(), f"attached {name}: {fault}")
    check.look(
        log.version in topics.WRITERS,
        f"metadata bimvox is {log.version!r}: this bimvox proves logs of {enumerated(topics.WRITERS)} only; "
        "if such a version exists, verify the log with it",
    )
    for key in metadata:
        if key.startswith(SHA256):
            name = key.removeprefix(SHA256)
            check.look(
                name in log.attachments, f"attached {name}: the metadata has its digest, but the file is missing"
            )
    return check


def check_load_poses(contents: Contents, log: PlanLog) -> Check:
    """Check that the poses of every moving load match the crane's axes or, without a crane, the path."""
    check = Check("load_poses", unit="m")
    site = log.plan.site
    shown = [_load_poses(contents, number) for number in range(max(1, len(site.cranes)))]
    lifts = {lift.order: lift for lift in log.planned}
    if not site.cranes:
        _, corner_m, _ = shown[0]
        wanted = [site.frame.corner_of(lift.path_vox) for lift in log.planned if lift.path_vox is not None]
        there = {tuple(np.round(corner, 6)) for corner in corner_m.tolist()}
        for corners in wanted:
            whole = all(tuple(np.round(corner, 6)) in there for corner in corners.tolist())
            check.look(whole, "the poses of the load are missing for a planned path", samples=len(corners))
        return check
    for motion in log.motions:
        time_ns, corner_m, rotation = shown[motion.crane]
        sampled_ns = motion.start_ns + motion.loaded.time_ns
        low, high = np.searchsorted(time_ns, [sampled_ns[0], sampled_ns[-1] + 1])
        name, start_ns = f"lift {motion.number}", time_ns[low:high]
        if not _has_times(motion, start_ns, sampled_ns, every=log.rate is not LogRate.MOTION):
            check.look(False, f"{name}: poses of its load are missing or have other times")
            continue
        hangs_m, tilt = _hangs(site, motion, lifts.get(motion.order), start_ns)
        off_m = np.linalg.norm(corner_m[low:high] - hangs_m, axis=1)
        # A quaternion and its negative are the same rotation.
        off = np.minimum(*(np.abs(rotation[low:high] - sign * tilt).max(axis=1) for sign in (1.0, -1.0)))
        worst = int(np.argmax(np.where(off > _ROUNDING, np.inf, off_m)))
        check.measure(float(off_m[worst]))
        good = off_m[worst] <= _SAME_M and off[worst] <= _ROUNDING
        check.look(
            bool(good),
            f"{name}: at {start_ns[worst] / 1e9:.3f} s its load is shown {off_m[worst]:.4f} m from where it hangs, "
            f"or turned otherwise",
            samples=len(off_m),
        )
        if good:
            _check_between(check, log, motion, start_ns, np.concatenate([hangs_m, tilt], axis=1))
    return check


def _check_between(
    check: Check, log: PlanLog, motion: LiftMotion, shown_ns: NDArray[np.int64], shown: NDArray[np.float64]
) -> None:
    """Check that between two shown poses ((N, 7)) the load hangs close to a straight line, at every sample."""
    lifts = {lift.order: lift for lift in log.planned}
    time_ns = motion.start_ns + motion.loaded.time_ns
    hangs = np.concatenate(_hangs(log.plan.site, motion, lifts.get(motion.order), time_ns), axis=1)
    off = np.abs(_at_times(time_ns, shown_ns, shown) - hangs) / np.repeat([_SHOWN_M, _SHOWN_QUATERNION], [3, 4])
    worst = int(np.argmax(off.max(axis=1)))
    check.look(
        bool(off[worst].max() <= 1.0 + _ROUNDING),
        f"lift {motion.number}: at {time_ns[worst] / 1e9:.3f} s a line between the shown poses of its load leads away",
        samples=len(off),
    )


def _allowed_off(axes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (N, 3) how far slew (rad), radius and height (m) of what is shown may be from the motion's axes."""
    allowed = np.full_like(axes, _SHOWN_M)
    allowed[:, 0] /= np.maximum(axes[:, 1], 1.0)
    return allowed


def _at_times(
    time_ns: NDArray[np.int64], shown_ns: NDArray[np.int64], shown: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return (N, K) the values at times on straight lines between shown ones ((M,) times, (M, K) values)."""
    since, given = (time_ns - shown_ns[0]).astype(np.float64), (shown_ns - shown_ns[0]).astype(np.float64)
    return np.stack([np.interp(since, given, column) for column in shown.T], axis=1)


def check_commands(contents: Contents, log: PlanLog) -> Check:
    """Check that a crane that follows the commanded rates follows the motion, and rests at every lift's end.

    Between two commands its axes move linearly. Where the motion needs them, they keep the hook within ``_SHOWN_M``.
    At a fixed rate they are at most a period T apart, and derived from samples with the same spacing: each axis may
    deviate by at most twice a T^2 / 8.
    """
    check = Check("commands", unit="share of bend")
    site = log.plan.site
    if not site.cranes:
        return check
    at_fixed_rate = log.rate is not LogRate.MOTION
    commands = [_commands(contents, topics.of_crane(topics.COMMAND, number)) for number in range(len(site.cranes))]
    for motion in by_each_crane(log.motions):
        crane = site.cranes[motion.crane]
        time_ns, axes = motion.samples()
        allowed = _allowed_off(axes)
        if at_fixed_rate:
            most = np.array([axis.acceleration for axis in pose_limits(crane)])
            allowed = 2.0 * most * site.rules.sample_period_s**2 / 8.0 + _ROUNDING
        name, own = f"lift {motion.number}", commands[motion.crane].get(motion.order, [])
        others = [c.crane for c in own if site.names_cranes and c.crane != crane.name]
        if others:
            check.look(False, f"{name}: its commands are for crane {others[0]!r}, it is driven by {crane.name!r}")
            continue
        at_ns = np.array([nanoseconds(c.time) for c in own], np.int64)
        good = len(own) >= 2 and at_ns[0] == motion.start_ns and at_ns[-1] == motion.end_ns
        if not good or (np.diff(at_ns) <= 0).any():
            check.look(False, f"{name}: its commands do not reach from its start to its end")
            continue
        period_s = np.diff(at_ns).max() / 1e9
        if at_fixed_rate and period_s > site.rules.sample_period_s + _ROUNDING:
            # Of a log that claims years, the commands must not be made again.
            check.look(
                False, f"{name}: two of its commands are {period_s:g} s apart, not {site.rules.sample_period_s:g}"
            )
            continue
        rates = np.array([(c.slew_rate_rad_s, c.trolley_rate_m_s, c.hoist_rate_m_s) for c in own])
        step_s = np.diff(at_ns) / 1e9
        poses = axes[0] + np.concatenate([np.zeros((1, 3)), np.cumsum(rates[:-1] * step_s[:, None], axis=0)])
        since, given = (time_ns - motion.start_ns).astype(float), (at_ns - motion.start_ns).astype(float)
        held = np.stack([np.interp(since, given, axis) for axis in poses.T], axis=1)
        share = np.abs(held - axes) / allowed
        worst = int(np.argmax(share.max(axis=1)))
        check.measure(float(share[worst].max()))
        check.look(
            bool(share[worst].max() <= 1.0 + _OVER_BEND),
            f"{name}: at {time_ns[worst] / 1e9:.3f} s the commands lead away from the motion",
            samples=len(share),
        )
        check.look(not rates[-1].any(), f"{name}: its last command does not stop the crane")
    return check


def _load_poses(contents: Contents, number: int) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Return times, corners (N, 3) and quaternions (N, 4: x, y, z, w), for every pose of a crane's load."""
    topic = topics.of_crane(topics.LOAD, number)
    found = [message for message in contents.messages if message.topic == topic]
    time_ns = np.array([message.time_ns for message in found], np.int64)
    poses = [PoseInFrame.FromString(message.data).pose for message in found]
    corner_m = np.array([(p.position.x, p.position.y, p.position.z) for p in poses], np.float64).reshape(-1, 3)
    turns = [(p.orientation.x, p.orientation.y, p.orientation.z, p.orientation.w) for p in poses]
    return time_ns, corner_m, np.array(turns, np.float64).reshape(-1, 4)


def _commands(contents: Contents, topic: str) -> dict[int, list[Any]]:
    """Return the commands on a topic, by lift."""
    result: defaultdict[int, list[Any]] = defaultdict(list)
    for message in contents.messages:
        if message.topic == topic:
            command = CraneCommandMessage.FromString(message.data)
            result[command.lift_order].append(command)
    return result


def _has_times(motion: LiftMotion, shown_ns: NDArray[np.int64], sampled_ns: NDArray[np.int64], *, every: bool) -> bool:
    """Return whether poses have times of samples, of all or at least of both ends; others only in a turn."""
    more = np.setdiff1d(shown_ns, sampled_ns)
    first_ns, last_ns = motion.turned_ns or (0, -1)
    inside = bool(((more >= first_ns) & (more <= last_ns)).all())
    wanted_ns = sampled_ns if every else sampled_ns[[0, -1]]
    return inside and bool((np.diff(shown_ns) > 0).all()) and bool(np.isin(wanted_ns, shown_ns).all())


def _hangs(
    site: Site, motion: LiftMotion, lift: Lift | None, time_ns: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the lowest corner of the reference cell (N, 3) and the quaternion (N, 4) at times with the load."""
    since_ns = time_ns - motion.start_ns
    axes = np.stack([np.interp(since_ns, motion.loaded.time_ns, axis) for axis in motion.loaded.axes.T], axis=1)
    corner_m = _corners_m(site, motion, axes)
    turns = np.tile([0.0, 0.0, 0.0, 1.0], (len(corner_m), 1))
    if lift is not None and lift.ever_with_jib:
        corner_m, turns = _turned(site, motion, corner_m, _off_rad(motion, time_ns, axes[:, 0]))
    guide = None if lift is None else lift.guide
    if guide is None:
        return corner_m, turns
    place_m = corner_m[-1].copy()
    above = np.linalg.norm(corner_m[:, :2] - place_m[:2], axis=1) <= _ABOVE_M
    for n in np.flatnonzero(above & (corner_m[:, 2] - place_m[2] < guide.top_m)).tolist():
        height_m = float(corner_m[n, 2] - place_m[2])
        aside_m, tilt_rad = guide.at(np.array([height_m]))[0].tolist()
        corner_m[n] = guide.moved(place_m, (height_m, aside_m, tilt_rad))
        turns[n] = [*(np.sin(tilt_rad / 2.0) * guide.axis), np.cos(tilt_rad / 2.0)]
    return corner_m, turns


def _corners_m(site: Site, motion: LiftMotion, axes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (N, 3) lowest corner of the reference cell at hook poses with the load level and not turned, metres."""
    component = as_crane_sees(site, motion.crane).components[motion.component]
    crane = crane_for(site, site.cranes[motion.crane], component)
    cells = reference_cells(crane, site.frame, axes, component.hook_line_vox)
    return site.frame.corner_of(cells)


def _off_rad(motion: LiftMotion, time_ns: NDArray[np.int64], slew_rad: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (N,) the angle of a load that turns with the jib to its final heading: as the jib has turned since.

    From the start of the turn to its final heading to its end, the rest goes to 0 in proportion to the time.
    """
    off_rad: NDArray[np.float64] = slew_rad - motion.loaded.slew_rad[0]
    if motion.turned_ns is None:
        return off_rad
    first_ns, last_ns = motion.turned_ns
    begins = motion.loaded.slew_rad[np.searchsorted(motion.loaded.time_ns, first_ns - motion.start_ns)]
    least_rad = float(np.remainder(begins - motion.loaded.slew_rad[0] + np.pi, 2.0 * np.pi) - np.pi)
    rest = np.clip((last_ns - time_ns) / (last_ns - first_ns), 0.0, 1.0)
    return np.asarray(np.where(time_ns < first_ns, off_rad, rest * least_rad), np.float64)


def _turned(
    site: Site, motion: LiftMotion, corner_m: NDArray[np.float64], off_rad: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return corners (N, 3) turned by angles (N,) about the hook's vertical, and the quaternions (N, 4)."""
    x, y, _ = site.components[motion.component].hook_line_vox
    arm = complex(x + 0.5, y + 0.5) * site.frame.voxel_size_m
    moved = arm - arm * np.exp(1j * off_rad)
    none = np.zeros_like(off_rad)
    turns = np.stack([none, none, np.sin(off_rad / 2.0), np.cos(off_rad / 2.0)], axis=1)
    return corner_m + np.stack([moved.real, moved.imag, none], axis=1), turns


# Proves that the joint states that viewers are shown are those of the proven motions.

_SAME = 1e-6
"""Metres and radians: axes are written as joints and read again."""


def check_joint_states(contents: Contents, log: PlanLog) -> Check:
    """Check that joint states are on the motion's axes, and straight lines between them close to all of its samples."""
    check = Check("joint_states", unit="m")
    shown = [_shown(contents, crane, number) for number, crane in enumerate(log.plan.site.cranes)]
    for motion in by_each_crane(log.motions):
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
        off = np.abs(_at_times(time_ns, own_ns, axes) - wanted)
        at_shown = np.isin(time_ns, own_ns)
        allowed = np.full_like(off, _SAME)
        if log.rate is LogRate.MOTION:
            allowed[~at_shown] += _allowed_off(wanted)[~at_shown]
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
