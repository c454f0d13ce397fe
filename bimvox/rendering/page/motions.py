"""The motions of lifts, for playback on the page."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.kinematics import hook_of
from bimvox.crane.tower_crane import TowerCrane
from bimvox.planning.stacks import from_box_to_origin_m
from bimvox.records.declared import LATER, Count, Maybe, Record
from bimvox.records.lift import Guide
from bimvox.records.motion import LiftMotion, PhaseName
from bimvox.records.track import LoadTrack, headings_off_rad
from bimvox.rendering.page.geometry import NUMBERS, Blob, rounded
from bimvox.site.component import StoredPose
from bimvox.site.config.validation import Point2, Point3
from bimvox.site.flip_box import is_flipped
from bimvox.site.site import Site

TICKS_PER_S = 10_000
LENGTH_STEPS_PER_M = 10_000
ANGLE_STEPS_PER_RAD = 1_000_000
_NS_PER_TICK = 10**9 // TICKS_PER_S

_TIP = Record(
    "PageTip",
    "The upending of a part that is stored lying.",
    (
        "keys",
        NUMBERS,
        "Columns of steps: time, height of its box's lowest corner, angle to upright; between two hooks\n"
        "also how far that corner has moved along the axis that it lies along.",
    ),
    ("corner_m", Point3, "Lowest corner of its box."),
    ("offset_m", Point3, "From there to its own lowest corner."),
    ("end_s", float, "When it stands."),
    ("two_hooks", bool, "Whether it is turned over between two hooks.", LATER, False),
)
_TURN = Record(
    "PageTurn",
    "A turn back to the final heading.",
    ("rad", float, "Angle before it; 0 after it."),
    ("start_s", float, "When it begins."),
    ("end_s", float, "When it ends."),
)
_WITH_JIB = Record(
    "PageWithJib",
    "A load that turns with the jib.",
    ("from_s", float, "From when on."),
    ("slew_rad", float, "The slewing angle then."),
    ("turn", Maybe(_TURN), "Its turn to the final heading."),
)
_GUIDE = Record(
    "PageGuide",
    "A load that people hold aside and tilt on its last moves.",
    ("hook_m", Point3, "The hook at the set place."),
    ("height_m", tuple[float, ...], "Heights of the hook above it, ascending."),
    ("aside_m", tuple[float, ...], "How far aside at each."),
    ("tilt_rad", tuple[float, ...], "The tilt at each."),
    ("ahead", Point2, "The direction of aside."),
    ("centre_m", Point3, "The centre of mass at its place."),
)
_SECOND = Record(
    "PageSecond",
    "The second crane of a part that two carry.",
    ("crane", Count, "Its number, from 0."),
    ("starts_s", float, "When its motion starts, from the lift's start; below zero before it."),
    ("keys", NUMBERS, "Keyframes as those of the first crane, from that start on."),
)
MOTION = Record(
    "PageMotion",
    "A motion; times are seconds from the lift's start, linear between keyframes.",
    ("kind", Literal["crane", "carried"], "``carried``: without a crane.", LATER),
    ("crane", Maybe(Count), "Its crane, from 0; only with several.", LATER, None),
    ("keys", NUMBERS, "Columns of steps, by ``scales``, each column delta-encoded: time, then slewing angle, radius,"
     " height; of a\ncarried part time, x, y, z.", LATER),
    ("below_m", Maybe(Point3), "From the hook to the part's lowest corner.", LATER, None),
    ("tip", Maybe(_TIP), "Its upending.", LATER),
    ("yaw", Maybe(_TURN), "Its turn, if it is stored turned.", LATER),
    ("with_jib", Maybe(_WITH_JIB), "When it turns with the jib.", LATER, None),
    ("guide", Maybe(_GUIDE), "How people guide it.", LATER, None),
    ("second", Maybe(_SECOND), "The second crane that carries it.", LATER, None),
    ("phases", tuple[tuple[str, float], ...], "Name and start of each phase.", LATER),
    ("lifted_s", float, "When it leaves its place.", lambda track: _seconds(track.lifted_ns - track.start_ns)),
    ("arrived_s", float, "When it is at its place.", lambda track: _seconds(track.arrived_ns - track.start_ns)),
    ("assembled_s", float, "When it is fixed.", lambda track: _seconds(track.assembled_ns - track.start_ns)),
    ("length_s", float, "When the hook is free.", lambda track: _seconds(track.end_ns - track.start_ns)),
)  # fmt: skip


def crane_motion(site: Site, motion: LiftMotion, track: LoadTrack, blob: Blob) -> dict[str, Any]:
    """Return one lift of the crane: keyframes of slew, radius and height, and the load's pose below the hook.

    Times count from the lift's start. While a part stored lying is tipped up, the height and rotation of its frame have
    separate keyframes; after that its pose below the hook is constant.
    """
    crane = site.cranes[motion.crane]
    hung = int(np.searchsorted(track.time_ns, motion.start_ns + int(motion.loaded.time_ns[0])))
    below_m = track.corner_m[hung] - hook_of(
        crane, motion.loaded.slew_rad[0], motion.loaded.radius_m[0], motion.loaded.height_m[0]
    )
    return {
        "kind": "crane",
        **({"crane": motion.crane} if site.names_cranes else {}),
        "keys": _keys(crane, motion, track, blob),
        "below_m": rounded(below_m),
        "tip": _tip(site, track, motion, blob),
        "yaw": _yaw(track, motion),
        **({"with_jib": _with_jib(motion)} if track.lift.ever_with_jib else {}),
        **({} if track.lift.guide is None else {"guide": _guide(track.lift.guide, crane, motion)}),
        **({} if motion.second is None else {"second": _second(site, motion, motion.second, track, blob)}),
        "phases": [[phase.name.value, _seconds(phase.start_ns - motion.start_ns)] for phase in motion.phases],
        **MOTION.of(track),
    }


def _keys(crane: TowerCrane, motion: LiftMotion, track: LoadTrack, blob: Blob) -> Any:
    """Return the keyframes of a crane's axes in a lift."""
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
    return blob.put_steps(_rows(time_ns[chosen] - motion.start_ns, axes[chosen] * scale))


def _second(site: Site, motion: LiftMotion, second: LiftMotion, track: LoadTrack, blob: Blob) -> dict[str, Any]:
    """Return the motion of the second crane that carries a part."""
    keys = _keys(site.cranes[second.crane], second, track, blob)
    return _SECOND.made(second.crane, _seconds(second.start_ns - motion.start_ns), keys)


def carried_motion(track: LoadTrack, blob: Blob) -> dict[str, Any]:
    """Return one lift without a crane: keyframes of the load's frame."""
    chosen = keyframes(track.time_ns, track.corner_m, [track.arrived_ns], lambda values: values)
    rows = _rows(track.time_ns[chosen] - track.start_ns, track.corner_m[chosen] * LENGTH_STEPS_PER_M)
    return {"kind": "carried", "keys": blob.put_steps(rows), "tip": None, "yaw": None, "phases": [], **MOTION.of(track)}


def _guide(guide: Guide, crane: TowerCrane, motion: LiftMotion) -> dict[str, Any]:
    """Return the poses of a guided load by the height of its hook above ``hook_m``, ascending."""
    last = motion.loaded
    height_m, aside_m, tilt_rad = np.array(guide.poses)[::-1].T
    return _GUIDE.made(
        rounded(hook_of(crane, last.slew_rad[-1], last.radius_m[-1], last.height_m[-1])),
        rounded(height_m),
        rounded(aside_m),
        [round(float(angle), 6) for angle in tilt_rad],
        [round(float(n), 9) for n in guide.ahead[:2]],
        rounded(np.array(guide.centre_m)),
    )


def _yaw(track: LoadTrack, motion: LiftMotion) -> dict[str, Any] | None:
    """Return by how much and when a part stored turned is turned back; None if it was not."""
    left_ns = motion.start_ns + int(motion.loaded.time_ns[0])
    turns = (phase for phase in motion.phases if phase.name is PhaseName.TURN and phase.end_ns <= left_ns)
    phase = next(turns, None)
    if phase is None or not len(track.tilt):
        return None
    _, _, z, w = track.tilt[0]
    angle_rad = round(2.0 * float(np.arctan2(z, w)), 6)
    return _TURN.made(angle_rad, *(_seconds(at_ns - motion.start_ns) for at_ns in (phase.start_ns, phase.end_ns)))


def _with_jib(motion: LiftMotion) -> dict[str, Any]:
    """Return from when and which slewing angle on a load turns with the jib, and its turn to the final heading."""
    turn = None
    if motion.turned_ns is not None:
        ends_ns = np.array(motion.turned_ns)
        slew_rad = np.interp(ends_ns - motion.start_ns, motion.loaded.time_ns, motion.loaded.slew_rad)
        begins_rad, ends_rad = headings_off_rad(motion, ends_ns, slew_rad)
        start_s, end_s = (_seconds(int(at - motion.start_ns)) for at in ends_ns)
        turn = _TURN.made(round(float(begins_rad - ends_rad), 6), start_s, end_s)
    return _WITH_JIB.made(_seconds(int(motion.loaded.time_ns[0])), round(float(motion.loaded.slew_rad[0]), 6), turn)


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
    scale = [LENGTH_STEPS_PER_M, ANGLE_STEPS_PER_RAD]
    if over := is_flipped(component, place.pose):
        axis = 0 if place.pose is StoredPose.LYING_X else 1
        values = np.column_stack([values, box_m[:, axis] - box_m[:1, axis]])
        scale.append(LENGTH_STEPS_PER_M)
    arm_m = max(place.shape.size_vox) * site.frame.voxel_size_m

    def far_end_m(at: NDArray[np.float64]) -> NDArray[np.float64]:
        turned = arm_m * np.stack([np.cos(at[..., 1]), np.sin(at[..., 1])], axis=-1)
        return np.concatenate([at[..., :1], turned, at[..., 2:]], axis=-1)

    chosen = keyframes(time_ns, values, [], far_end_m)
    tip = _TIP.made(
        blob.put_steps(_rows(time_ns[chosen] - motion.start_ns, values[chosen] * np.array(scale))),
        rounded(box_m[0] if len(box_m) else track.corner_m[0]),
        rounded(from_box_to_origin_m(site, component, place, np.zeros(1))[0]),
        _seconds(end_ns - motion.start_ns),
        True,
    )
    if not over:
        del tip["two_hooks"]
    return tip


def _rows(time_ns: NDArray[np.int64], values: NDArray[np.float64]) -> NDArray[np.int64]:
    ticks = (time_ns + _NS_PER_TICK // 2) // _NS_PER_TICK
    return np.concatenate([ticks[:, None], np.rint(values).astype(np.int64)], axis=1)


def _seconds(ns: int) -> float:
    return int(ns) / 1e9


# A motion as a few keyframes; page and animation interpolate linearly between them.

TOLERANCE_M = 0.01
"""Maximum deviation of the page from the log's samples."""

_Floats = NDArray[np.float64]


def keyframes(
    times: NDArray[np.integer] | _Floats,
    values: _Floats,
    always: Iterable[int],
    to_points: Callable[[_Floats], _Floats],
    tolerance: float = TOLERANCE_M,
    longest: float = np.inf,
) -> NDArray[np.int64]:
    """Return samples such that linear interpolation between them stays within a tolerance of all samples.

    Ramer-Douglas-Peucker over time.

    Args:
        times: (N,) ascending times.
        values: (N, C) what is interpolated.
        always: Times whose samples are always chosen.
        to_points: Maps (..., C) values to (..., D) points, where the tolerance applies.
        tolerance: In the unit of the points.
        longest: Maximum change of a value between two chosen samples. A rotation by more than half a circle would be
            interpolated the other way round.

    Returns:
        (K,) int64 ascending indices, including the first and the last sample.
    """
    points = to_points(values)
    fixed = np.searchsorted(times, [t for t in always if times[0] <= t <= times[-1]])
    chosen = np.unique(np.r_[0, fixed, len(times) - 1].astype(np.int64))
    found, low, high = [chosen], chosen[:-1], chosen[1:]
    while len(low):  # all spans of equal depth at once
        is_wide = high - low > 1
        low, high = low[is_wide], high[is_wide]
        counts = high - low - 1
        first = np.cumsum(counts) - counts
        span = np.repeat(np.arange(len(low)), counts)
        inside = np.arange(len(span)) - first[span] + low[span] + 1
        share = (times[inside] - times[low[span]]) / (times[high[span]] - times[low[span]])
        straight = values[low[span]] + share[:, None] * (values[high[span]] - values[low[span]])
        off = np.linalg.norm(to_points(straight) - points[inside], axis=1)
        most = np.maximum.reduceat(off, first) if len(first) else off
        worst = np.flatnonzero(off == most[span])
        worst = inside[worst[np.searchsorted(worst, first)]]
        is_off = most > tolerance
        parted = is_off | (np.abs(values[high] - values[low]).max(axis=1, initial=0.0) > longest)
        middle = np.where(is_off, worst, (low + high) // 2)[parted]
        found.append(middle)
        low, high = np.concatenate([low[parted], middle]), np.concatenate([middle, high[parted]])
    return np.unique(np.concatenate(found))
