"""The motions of lifts, for playback on the page."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.kinematics import hook_of
from bimvox.crane.tower_crane import TowerCrane
from bimvox.planning.stacks import from_box_to_origin_m
from bimvox.records.lift import Guide
from bimvox.records.motion import LiftMotion, PhaseName
from bimvox.records.track import LoadTrack, headings_off_rad
from bimvox.rendering.page.blob import Blob, rounded
from bimvox.rendering.page.keyframes import keyframes
from bimvox.site.component import StoredPose
from bimvox.site.site import Site

TICKS_PER_S = 10_000
LENGTH_STEPS_PER_M = 10_000
ANGLE_STEPS_PER_RAD = 1_000_000
_NS_PER_TICK = 10**9 // TICKS_PER_S


def crane_motion(site: Site, motion: LiftMotion, track: LoadTrack, blob: Blob) -> dict[str, Any]:
    """Return one lift of the crane: keyframes of slew, radius and height, and the load's pose below the hook.

    Times count from the lift's start. While a part stored lying is tipped up, the height and rotation of its frame have
    separate keyframes; after that its pose below the hook is constant.
    """
    crane = site.cranes[motion.crane]
    time_ns, axes = motion.samples()
    events = (track.lifted_ns, track.arrived_ns, track.assembled_ns)
    ends = [motion.start_ns + int(t) for part in motion.trajectories for t in (part.time_ns[0], part.time_ns[-1])]
    chosen = keyframes(
        time_ns,
        axes,
        [*events, *ends, *(phase.start_ns for phase in motion.phases)],
        lambda values: hook_of(crane, values[..., 0], values[..., 1], values[..., 2]),
    )
    scale = np.array([ANGLE_STEPS_PER_RAD, LENGTH_STEPS_PER_M, LENGTH_STEPS_PER_M])
    hung = int(np.searchsorted(track.time_ns, motion.start_ns + int(motion.loaded.time_ns[0])))
    below_m = track.corner_m[hung] - hook_of(
        crane, motion.loaded.slew_rad[0], motion.loaded.radius_m[0], motion.loaded.height_m[0]
    )
    return {
        "kind": "crane",
        **({"crane": motion.crane} if site.has_several_cranes else {}),
        "keys": blob.put_steps(_rows(time_ns[chosen] - motion.start_ns, axes[chosen] * scale)),
        "below_m": rounded(below_m),
        "tip": _tip(site, track, motion, blob),
        "yaw": _yaw(track, motion),
        **({"with_jib": _with_jib(motion)} if track.lift.ever_with_jib else {}),
        **({} if track.lift.guide is None else {"guide": _guide(track.lift.guide, crane, motion)}),
        "phases": [[phase.name.value, _seconds(phase.start_ns - motion.start_ns)] for phase in motion.phases],
        **_times(track),
    }


def carried_motion(track: LoadTrack, blob: Blob) -> dict[str, Any]:
    """Return one lift without a crane: keyframes of the load's frame."""
    chosen = keyframes(track.time_ns, track.corner_m, [track.arrived_ns], lambda values: values)
    rows = _rows(track.time_ns[chosen] - track.start_ns, track.corner_m[chosen] * LENGTH_STEPS_PER_M)
    return {"kind": "carried", "keys": blob.put_steps(rows), "tip": None, "yaw": None, "phases": [], **_times(track)}


def _guide(guide: Guide, crane: TowerCrane, motion: LiftMotion) -> dict[str, Any]:
    """Return the poses of a guided load by the height of its hook above ``hook_m``, ascending."""
    last = motion.loaded
    height_m, aside_m, tilt_rad = np.array(guide.poses)[::-1].T
    return {
        "hook_m": rounded(hook_of(crane, last.slew_rad[-1], last.radius_m[-1], last.height_m[-1])),
        "height_m": rounded(height_m),
        "aside_m": rounded(aside_m),
        "tilt_rad": [round(float(angle), 6) for angle in tilt_rad],
        "ahead": [round(float(n), 9) for n in guide.ahead[:2]],
        "centre_m": rounded(np.array(guide.centre_m)),
    }


def _yaw(track: LoadTrack, motion: LiftMotion) -> dict[str, Any] | None:
    """Return by how much and when a part stored turned is turned back; None if it was not."""
    left_ns = motion.start_ns + int(motion.loaded.time_ns[0])
    turns = (phase for phase in motion.phases if phase.name is PhaseName.TURN and phase.end_ns <= left_ns)
    phase = next(turns, None)
    if phase is None or not len(track.tilt):
        return None
    _, _, z, w = track.tilt[0]
    return {
        "rad": round(2.0 * float(np.arctan2(z, w)), 6),
        "start_s": _seconds(phase.start_ns - motion.start_ns),
        "end_s": _seconds(phase.end_ns - motion.start_ns),
    }


def _with_jib(motion: LiftMotion) -> dict[str, Any]:
    """Return from when and which slewing angle on a load turns with the jib, and its turn to the final heading."""
    found: dict[str, Any] = {
        "from_s": _seconds(int(motion.loaded.time_ns[0])),
        "slew_rad": round(float(motion.loaded.slew_rad[0]), 6),
        "turn": None,
    }
    if motion.turned_ns is not None:
        ends_ns = np.array(motion.turned_ns)
        slew_rad = np.interp(ends_ns - motion.start_ns, motion.loaded.time_ns, motion.loaded.slew_rad)
        begins_rad, ends_rad = headings_off_rad(motion, ends_ns, slew_rad)
        start_s, end_s = (_seconds(int(at - motion.start_ns)) for at in ends_ns)
        found["turn"] = {"rad": round(float(begins_rad - ends_rad), 6), "start_s": start_s, "end_s": end_s}
    return found


def _tip(site: Site, track: LoadTrack, motion: LiftMotion, blob: Blob) -> dict[str, Any] | None:
    """Return keyframes of the frame's height and rotation during tipping; None if the part was not stored lying."""
    place = track.lift.place
    if place is None or place.pose is StoredPose.AS_BUILT:
        return None
    end_ns = motion.start_ns + int(motion.raising.time_ns[-1])
    during = track.time_ns < end_ns
    time_ns = track.time_ns[during]
    part = track.tilt[during]
    angle_rad = 2.0 * np.arctan2(np.hypot(part[:, 0], part[:, 1]), np.hypot(part[:, 2], part[:, 3]))
    component = site.components[track.lift.component]
    box_m = track.corner_m[during] - from_box_to_origin_m(site, component, place, angle_rad)
    values = np.stack([box_m[:, 2], angle_rad], axis=1)
    arm_m = max(place.shape.size_vox) * site.frame.voxel_size_m

    def far_end_m(at: NDArray[np.float64]) -> NDArray[np.float64]:
        turned = arm_m * np.stack([np.cos(at[..., 1]), np.sin(at[..., 1])], axis=-1)
        return np.concatenate([at[..., :1], turned], axis=-1)

    chosen = keyframes(time_ns, values, [], far_end_m)
    scale = np.array([LENGTH_STEPS_PER_M, ANGLE_STEPS_PER_RAD])
    return {
        "keys": blob.put_steps(_rows(time_ns[chosen] - motion.start_ns, values[chosen] * scale)),
        "corner_m": rounded(box_m[0] if len(box_m) else track.corner_m[0]),
        "offset_m": rounded(from_box_to_origin_m(site, component, place, np.zeros(1))[0]),
        "end_s": _seconds(end_ns - motion.start_ns),
    }


def _times(track: LoadTrack) -> dict[str, Any]:
    return {
        "lifted_s": _seconds(track.lifted_ns - track.start_ns),
        "arrived_s": _seconds(track.arrived_ns - track.start_ns),
        "assembled_s": _seconds(track.assembled_ns - track.start_ns),
        "length_s": _seconds(track.end_ns - track.start_ns),
    }


def _rows(time_ns: NDArray[np.int64], values: NDArray[np.float64]) -> NDArray[np.int64]:
    ticks = (time_ns + _NS_PER_TICK // 2) // _NS_PER_TICK
    return np.concatenate([ticks[:, None], np.rint(values).astype(np.int64)], axis=1)


def _seconds(ns: int) -> float:
    return int(ns) / 1e9
