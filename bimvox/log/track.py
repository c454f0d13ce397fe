"""The track of a lift's load, from the motion of its crane or without a crane."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.motion.swept import cells_of_axes, load_frame
from bimvox.planning.stacks import from_box_to_origin_m, lying_width_vox
from bimvox.records.lift import Guide, Lift, YardPlace
from bimvox.records.motion import LiftMotion, PhaseName
from bimvox.records.track import LiftTimes, LoadTrack, headings_off_rad
from bimvox.site.component import Component, StoredPose
from bimvox.site.flip_box import flipped_at_vox, is_flipped
from bimvox.site.lifting import crane_for
from bimvox.site.site import Site
from bimvox.site.tandem import part_on

_TURN_SAMPLES = 19
_IN_LINE_M = 0.01
"""A load this close in plan to the line above its place is on its last moves."""
NOMINAL_MOVE_NS = 1_000_000_000
"""Time of a unit move on a site without a crane, and from arrival to assembly."""


def nominal_track(site: Site, lift: Lift, start_ns: int) -> LoadTrack:
    """Return the track of a lift without a crane: the voxel path at a nominal time per move."""
    assert lift.path_vox is not None
    time_ns = start_ns + NOMINAL_MOVE_NS * np.arange(len(lift.path_vox), dtype=np.int64)
    arrived_ns = int(time_ns[-1])
    end_ns = arrived_ns + NOMINAL_MOVE_NS
    return LoadTrack(
        lift=lift,
        start_ns=start_ns,
        lifted_ns=start_ns,
        arrived_ns=arrived_ns,
        assembled_ns=end_ns,
        end_ns=end_ns,
        time_ns=time_ns,
        corner_m=site.frame.corner_of(lift.path_vox),
        tilt=_quaternions(np.zeros(len(time_ns)), StoredPose.AS_BUILT),
    )


def lift_times(lift: Lift, motion: LiftMotion) -> LiftTimes:
    """Return when the load of a lift enters each state."""
    arrived_ns = motion.start_ns + int(motion.loaded.time_ns[-1])
    return LiftTimes(
        lift=lift,
        start_ns=motion.start_ns,
        lifted_ns=motion.start_ns + int(motion.raising.time_ns[0]),
        arrived_ns=arrived_ns,
        assembled_ns=max([arrived_ns, *(p.end_ns for p in motion.phases if p.name is PhaseName.SET)]),
        end_ns=motion.end_ns,
    )


def crane_track(site: Site, lift: Lift, motion: LiftMotion) -> LoadTrack:
    """Return the track of a lift from the crane's motion."""
    component, place = part_on(site, lift.component, motion.crane), lift.place
    crane = site.crane_of(component)
    assert crane is not None
    assert place is not None
    times = lift_times(lift, motion)
    time_ns, axes = _with_turn(motion, *motion.samples())
    held = (time_ns >= times.lifted_ns) & (time_ns <= times.assembled_ns)
    time_ns, axes = time_ns[held], axes[held]
    load = load_frame(crane_for(site, crane, component), site.frame, component.hook_line_vox)
    corner_m = site.frame.corner_of(cells_of_axes(load, axes))
    angle_rad = np.zeros(len(time_ns))
    size_m = site.frame.voxel_size_m
    if is_flipped(component, place.pose):
        flipped_m, angle_rad, tipping = _flipped(site, component, place, motion, (time_ns, axes))
    elif place.pose is not StoredPose.AS_BUILT:
        upright_m = load.zero_height_m + size_m * place.cell_vox[2]
        # At its full height it may be moved to where it is turned.
        tipping = time_ns < motion.start_ns + int(motion.raising.time_ns[-1])
        tipping &= axes[:, 2] < float(motion.raising.height_m[-1]) - 1e-9
        low_m = float(motion.raising.height_m[0])
        raised = np.clip((axes[:, 2] - low_m) / max(upright_m - low_m, 1e-9), 0.0, 1.0)
        angle_rad = np.where(tipping, np.pi / 2 - np.arcsin(raised), 0.0)
    tilt = _quaternions(angle_rad, place.pose)
    if lift.guide is not None:
        corner_m, tilt = _guided(site, lift.guide, motion, time_ns, corner_m, tilt)
    if place.turn or lift.ever_with_jib:
        yaw_rad = _yaw_rad(motion, place.turn, time_ns)
        if lift.ever_with_jib:
            yaw_rad = yaw_rad + headings_off_rad(motion, time_ns, axes[:, 0])
        tilt = _turned_before(tilt, yaw_rad)
        # The part turns about its hook, and the corner of its reference cell with it.
        arm_m = -site.frame.voxel_size_m * (np.array(component.hook_line_vox[:2]) + 0.5)
        axis_m = corner_m[:, :2] - arm_m
        cos, sin = np.cos(yaw_rad), np.sin(yaw_rad)
        corner_m[:, 0] = axis_m[:, 0] + cos * arm_m[0] - sin * arm_m[1]
        corner_m[:, 1] = axis_m[:, 1] + sin * arm_m[0] + cos * arm_m[1]
    if is_flipped(component, place.pose):
        corner_m = np.where(tipping[:, None], flipped_m, corner_m)
    elif place.pose is not StoredPose.AS_BUILT:
        # Tipping holds the lowest corner on the foot side; the corner of the box rises by its width.
        width = lying_width_vox(component, place)
        tipped = site.frame.corner_of(np.repeat(np.array(place.cell_vox)[None], len(time_ns), axis=0))
        tipped[:, 2] += size_m * width * np.sin(angle_rad) + np.maximum(0.0, axes[:, 2] - upright_m)
        tipped += from_box_to_origin_m(site, component, place, angle_rad)
        corner_m = np.where(tipping[:, None], tipped, corner_m)
    return LoadTrack(
        lift=lift,
        start_ns=times.start_ns,
        lifted_ns=times.lifted_ns,
        arrived_ns=times.arrived_ns,
        assembled_ns=times.assembled_ns,
        end_ns=times.end_ns,
        time_ns=time_ns,
        corner_m=corner_m,
        tilt=tilt,
    )


def _flipped(
    site: Site,
    component: Component,
    place: YardPlace,
    motion: LiftMotion,
    samples: tuple[NDArray[np.int64], NDArray[np.float64]],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """Return corners, angles to upright, and whether it is not upright yet, of a part between two hooks.

    ``samples``: (N,) times and (N, 3) axes of its main hook.
    """
    (time_ns, axes), size_m = samples, site.frame.voxel_size_m
    ends_m, lifted_m = float(motion.raising.height_m[-1]), axes[:, 2] - float(motion.raising.height_m[0])
    rise_m = size_m * place.rise_vox
    tipping = time_ns < motion.start_ns + int(motion.raising.time_ns[-1])
    tipping &= axes[:, 2] < ends_m - 1e-9
    hoist_m = max(ends_m - float(motion.raising.height_m[0]) - rise_m, 1e-9)
    turned = np.where(tipping, np.clip((lifted_m - rise_m) / hoist_m, 0.0, 1.0), 1.0)
    angle_rad = np.pi / 2 - np.arcsin(turned)
    along, up = flipped_at_vox(component, place.pose, place.turn, turned)
    level = np.clip(lifted_m / rise_m, 0.0, 1.0)
    box_m = site.frame.corner_of(np.repeat(np.array(place.cell_vox)[None], len(time_ns), axis=0))
    box_m[:, 0 if place.pose is StoredPose.LYING_X else 1] += size_m * along * level
    box_m[:, 2] += size_m * up + np.minimum(lifted_m, rise_m)
    return box_m + from_box_to_origin_m(site, component, place, angle_rad), angle_rad, tipping


def _guided(
    site: Site,
    guide: Guide,
    motion: LiftMotion,
    time_ns: NDArray[np.int64],
    corner_m: NDArray[np.float64],
    tilt: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return corners and rotations with the load guided where it hangs above its place."""
    place_m = corner_m[-1]
    height_m = corner_m[:, 2] - place_m[2]
    last = (time_ns >= motion.start_ns + int(motion.loaded.time_ns[0])) & (height_m < guide.top_m)
    last &= (np.abs(corner_m[:, :2] - place_m[:2]) <= _IN_LINE_M).all(axis=1)
    poses = guide.at(height_m[last])
    corner_m, tilt = corner_m.copy(), tilt.copy()
    corner_m[last] = [
        guide.moved(place_m, (float(up), *pose)) for up, pose in zip(height_m[last], poses.tolist(), strict=True)
    ]
    tilt[last, :3] = np.sin(poses[:, 1:] / 2.0) * guide.axis
    tilt[last, 3] = np.cos(poses[:, 1] / 2.0)
    return corner_m, tilt


def _turned_before(tilt: NDArray[np.float64], yaw_rad: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (N, 4) quaternions of a part turned about z, then tipped ((N, 4), about x or y)."""
    x, y, _, w = tilt.T
    cos, sin = np.cos(yaw_rad / 2), np.sin(yaw_rad / 2)
    return np.stack([x * cos + y * sin, y * cos - x * sin, w * sin, w * cos], axis=1)


def _turn_ns(motion: LiftMotion) -> tuple[int, int]:
    """Return when a part is turned back in the yard; an empty span at the start of the transit if it is not."""
    left_ns = motion.start_ns + int(motion.loaded.time_ns[0])
    for phase in motion.phases:
        if phase.name is PhaseName.TURN and phase.end_ns <= left_ns:
            return phase.start_ns, phase.end_ns
    return left_ns, left_ns


def _with_turn(
    motion: LiftMotion, time_ns: NDArray[np.int64], axes: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the samples of a motion, with additional ones while the hook stands still and the part is turned."""
    spans = [span for span in (_turn_ns(motion), motion.turned_ns) if span is not None and span[0] < span[1]]
    if not spans:
        return time_ns, axes
    more = time_ns
    for start_ns, end_ns in spans:
        more = np.union1d(more, np.linspace(start_ns, end_ns, _TURN_SAMPLES).astype(np.int64))
    return more, np.stack([np.interp(more, time_ns, axis) for axis in axes.T], axis=1)


def _yaw_rad(motion: LiftMotion, turn: int, time_ns: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return (N,) the angle about z from the built-in position; it goes to 0 the shorter way, at a constant rate."""
    stored_rad = np.pi / 2 * (turn if turn <= 2 else turn - 4)
    start_ns, end_ns = _turn_ns(motion)
    left = (end_ns - time_ns) / max(end_ns - start_ns, 1)
    yaw: NDArray[np.float64] = stored_rad * np.clip(left, 0.0, 1.0)
    return yaw


def _quaternions(angle_rad: NDArray[np.float64], pose: StoredPose) -> NDArray[np.float64]:
    """Return (N, 4) x, y, z, w of a part tipped by these angles from upright towards its stored pose."""
    quaternions = np.zeros((len(angle_rad), 4))
    quaternions[:, 3] = np.cos(angle_rad / 2)
    if pose is StoredPose.LYING_X:
        quaternions[:, 1] = np.sin(angle_rad / 2)
    elif pose is StoredPose.LYING_Y:
        quaternions[:, 0] = -np.sin(angle_rad / 2)
    return quaternions
