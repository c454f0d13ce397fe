"""The proof that a plan was carried out among people and vehicles as it says, without anybody under a load.

The crane: the samples are half a second apart, and each has the crane where the proven plan has it at some time. This
time never runs back, and never faster than the clock, so no axis is faster than planned, and the crane is on proven
ways. No axis speeds up or brakes harder than it can.

The others: nobody is faster than assumed, everybody is seen near where they were half a second ago, and a suspended
load, within its swing, is never over the disc around anybody. The swing follows from the samples (``pendulum``); tag
lines bring a load that stands for 20 s to rest. Between two samples, everything moves straight.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.kinematics import hook_of, joint_limits, joint_names, joints_of
from bimvox.crane.tower_crane import TowerCrane
from bimvox.proof.crane.pendulum import hung_on, swung_on
from bimvox.records.lift import Lift, LiftPlan
from bimvox.records.motion import CarriedOut, LiftMotion, OtherKind, PhaseName, Tally
from bimvox.records.proof import Check
from bimvox.site.component import StoredPose
from bimvox.site.lifting import crane_for
from bimvox.site.site import Site

SAMPLE_NS = 500_000_000
FASTEST_M_S = 1.5
"""Highest speed of people and of vehicles."""
RADIUS_M = {OtherKind.PERSON: 0.6, OtherKind.VEHICLE: 4.2}
"""Discs that contain a crew of two, and a lorry."""
SEEN_M = 0.3
"""Largest error with which the place of half a second ago is seen."""
_AT_REST_NS = 20_000_000_000
_FINE_NS = 100_000_000
_STILL = 1e-9
_OVER_LIMIT = 1e-3
_SAME = 1e-6
_STEP_S = SAMPLE_NS / 1e9


def check_carried_out(plan: LiftPlan, motions: Sequence[LiftMotion], found: CarriedOut) -> tuple[Check, ...]:
    """Return the checks of an execution: of the crane, of the others, and of what is said about it.

    Args:
        plan: The plan in the order in which it was carried out; assumed to be proven.
        motions: Its motions; assumed to be proven.
        found: The execution.
    """
    crane, others, tally = Check("carried_out", unit="share of limit"), Check("others", unit="m"), Check("tally")
    if _is_sound(crane, plan, motions, found):
        _check_crane(crane, plan.site.cranes[0], motions, found)
        _check_others(others, found)
        again, under = _again(plan, motions, found)
        if again.least_m is not None:
            others.measure(max(0.0, -again.least_m))
        for text in under:
            others.look(False, text)
        others.look(True, "", samples=len(found.time_ns))
        for name in ("delivered", "lost_s", "stops", "waits", "least_m", "violations"):
            said, is_so = getattr(found.tally, name), getattr(again, name)
            same = said == is_so or (None not in (said, is_so) and abs(said - is_so) <= _SAME)
            tally.look(same, f"{name} is said to be {said}; the samples give {is_so}")
        count, done = len(motions), again.delivered
        crane.look(done == count, f"lifts are left: {done} of {count} were carried out before the samples end")
    return crane, others, tally


def tally_of(plan: LiftPlan, motions: Sequence[LiftMotion], found: CarriedOut) -> Tally:
    """Return what happened in an execution, from its samples; what it says itself does not count."""
    return _again(plan, motions, found)[0]


def _is_sound(check: Check, plan: LiftPlan, motions: Sequence[LiftMotion], found: CarriedOut) -> bool:
    """Check that the samples have the right number and finite values, and that there is a plan of one crane."""
    count, others = len(found.time_ns), len(found.others)
    arrays = (found.place_m, found.seen_m, found.axes, found.plan_ns, found.pace)
    shapes = tuple(one.shape for one in arrays)
    good = shapes == ((count, others, 2), (count, others, 2), (count, 3), (count,), (count,)) and count >= 2
    good = good and all(bool(np.isfinite(one).all()) for one in arrays)
    check.look(good, "the samples of the crane and of the others are not equally many, or not numbers")
    names = {other.id for other in found.others}
    check.look(len(names) == others, "two of the others have one name")
    single = len(plan.site.cranes) == 1 and bool(motions) and not plan.history
    check.look(single, "only a plan of one crane, without changes, can be carried out among others")
    if good and not np.array_equal(found.time_ns, np.arange(count) * SAMPLE_NS):
        check.look(False, f"the samples are not {_STEP_S:g} s apart from 0 s on: one is missing or has another time")
        good = False
    return good and single


def _check_crane(check: Check, crane: TowerCrane, motions: Sequence[LiftMotion], found: CarriedOut) -> None:
    """Check that the crane is on proven ways, never ahead of the clock, and within its accelerations."""
    gone_ns, time_s = np.diff(found.plan_ns), found.time_ns / 1e9
    first_ns, last_ns = motions[0].start_ns, motions[-1].end_ns
    check.look(
        bool(found.plan_ns[0] == first_ns and found.plan_ns[-1] <= last_ns),
        "it does not begin where the plan begins, or goes on after its end",
    )
    back, fast = np.flatnonzero(gone_ns < 0), np.flatnonzero(gone_ns > SAMPLE_NS)
    check.look(not len(back), f"at {time_s[back[0]] if len(back) else 0.0:.1f} s the crane goes back on its way")
    check.look(not len(fast), f"at {time_s[fast[0]] if len(fast) else 0.0:.1f} s the crane is faster than planned")
    paces = np.concatenate([found.pace, *_paces(found)])
    good = bool((paces >= -_SAME).all() and (paces <= 1.0 + _SAME).all())
    check.look(good, "its pace does not fit where it is on the plan's clock")
    off = np.abs(found.axes - planned_axes(motions, found.plan_ns))
    worst = int(np.argmax(off.max(axis=1)))
    check.look(
        bool(off.max() <= _SAME),
        f"at {time_s[worst]:.1f} s an axis is {off.max():.4g} (rad or m) off the proven way",
        samples=len(off),
    )
    bends = _bends(crane, motions, found)
    for name, limits, bend in zip(joint_names(crane), joint_limits(crane), bends.T, strict=True):
        worst, share = int(np.argmax(bend)), float(bend.max()) / limits.acceleration
        check.measure(share)
        check.look(
            share <= 1.0 + _OVER_LIMIT,
            f"at {time_s[worst]:.1f} s the {name} speeds up or brakes at {bend[worst]:.4g}, "
            f"{limits.acceleration:.4g} is possible",
            samples=len(bend),
        )


def _bends(crane: TowerCrane, motions: Sequence[LiftMotion], found: CarriedOut) -> NDArray[np.float64]:
    """Return (N - 1, 3) the largest acceleration of the joints between two samples.

    An axis with the planned rate r and acceleration a has, at the pace f, the acceleration ``a f^2 + r f'``. A sudden
    change of the pace counts as one over the time to the next sample. The planned values are divided differences.
    """
    times, axes = zip(*(motion.samples() for motion in motions), strict=True)
    time_ns, first = np.unique(np.concatenate(times), return_index=True)
    time_s, joints = time_ns / 1e9, joints_of(crane, np.concatenate(axes)[first])
    rates = np.diff(joints, axis=0) / np.diff(time_s)[:, None]
    middle_s = 0.5 * (time_s[1:] + time_s[:-1])
    planned = np.diff(rates, axis=0) / np.diff(middle_s)[:, None]
    begins, ends = _paces(found)
    gain = (ends - begins) / _STEP_S
    jump = np.abs(begins - found.pace[:-1]) / _STEP_S
    most = np.zeros((len(begins), 3))
    for share in (0.0, 0.5, 1.0):
        at_s = _plan_s(found, begins, ends, share)
        pace = begins + share * (ends - begins)
        for axis in range(3):
            rate = np.interp(at_s, middle_s, rates[:, axis])
            bend = np.interp(at_s, time_s[1:-1], planned[:, axis])
            most[:, axis] = np.maximum(most[:, axis], np.abs(bend * pace**2 + rate * gain) + np.abs(rate) * jump)
    return most


def _paces(found: CarriedOut) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return (N - 1,) the pace after each sample and before the next one: between them it changes evenly."""
    ends = found.pace[1:]
    return 2.0 * np.diff(found.plan_ns) / SAMPLE_NS - ends, ends


def _plan_s(
    found: CarriedOut, begins: NDArray[np.float64], ends: NDArray[np.float64], share: float
) -> NDArray[np.float64]:
    """Return (N - 1,) where the crane is on the plan's clock at a share of the time between two samples."""
    since_s = share * _STEP_S
    return np.asarray(found.plan_ns[:-1] / 1e9 + begins * since_s + 0.5 * (ends - begins) * share * since_s, np.float64)


def _check_others(check: Check, found: CarriedOut) -> None:
    """Check that nobody is faster than assumed, and that everybody is seen near where they were."""
    for n, other in enumerate(found.others):
        step_m = np.linalg.norm(np.diff(found.place_m[:, n], axis=0), axis=1)
        worst = int(np.argmax(step_m))
        check.look(
            bool(step_m[worst] <= FASTEST_M_S * _STEP_S + _SAME),
            f"{other.id} moves at {step_m[worst] / _STEP_S:.2f} m/s at {found.time_ns[worst] / 1e9:.1f} s; "
            f"{FASTEST_M_S:g} m/s at most are assumed",
            samples=len(step_m),
        )
        was_m = np.concatenate([found.place_m[:1, n], found.place_m[:-1, n]])
        error_m = np.linalg.norm(found.seen_m[:, n] - was_m, axis=1)
        worst = int(np.argmax(error_m))
        check.look(
            bool(error_m[worst] <= SEEN_M + _SAME),
            f"{other.id} is seen {error_m[worst]:.2f} m from where it was at {found.time_ns[worst] / 1e9:.1f} s; "
            f"{SEEN_M:g} m at most are assumed",
            samples=len(error_m),
        )


def _again(plan: LiftPlan, motions: Sequence[LiftMotion], found: CarriedOut) -> tuple[Tally, list[str]]:
    """Return what happened, and who was under which load."""
    ends_ns = np.array([motion.end_ns for motion in motions])
    stands = np.diff(found.plan_ns) == 0
    is_suspended = np.zeros(len(found.plan_ns), np.bool_)
    under = np.zeros(len(found.plan_ns), np.bool_)
    least_m, texts = np.inf, []
    by_order = {lift.order: lift for lift in plan.lifts}
    for motion in motions:
        span = _suspended(motion, found.plan_ns)
        is_suspended[span] = True
        for other, gap_m, time_ns in _gaps(plan.site, by_order[motion.order], motion, found, span):
            least_m = min(least_m, float(gap_m.min()))
            bad = gap_m < 0.0
            if bad.any():
                under[time_ns[bad] // SAMPLE_NS] = True
                part = plan.site.components[motion.component]
                texts.append(
                    f"lift {motion.number} ({part.label}): at {time_ns[int(np.argmin(gap_m))] / 1e9:.1f} s {other} is "
                    f"{-float(gap_m.min()):.2f} m within its suspended load"
                )
    begins = stands & ~np.concatenate([[False], stands[:-1]])
    stops = int((begins & is_suspended[:-1]).sum())
    lost_s = (int(found.time_ns[-1]) - int(found.plan_ns[-1]) + motions[0].start_ns) / 1e9
    delivered = int((ends_ns <= found.plan_ns[-1]).sum())
    least = None if np.isinf(least_m) else round(least_m, 6)
    tally = Tally(delivered, lost_s, stops, int(begins.sum()) - stops, least, int(under.sum()))
    return tally, texts


def _suspended(motion: LiftMotion, plan_ns: NDArray[np.int64]) -> slice:
    """Return the samples at which the load of a lift is suspended: raised, and not fixed yet."""
    raises_ns = next(phase.start_ns for phase in motion.phases if phase.name is PhaseName.RAISE)
    fixed_ns = max([motion.set_ns, *(phase.end_ns for phase in motion.phases if phase.name is PhaseName.SET)])
    low, high = np.searchsorted(plan_ns, [raises_ns, fixed_ns], side="right")
    return slice(int(low), int(high))


def _gaps(
    site: Site, lift: Lift, motion: LiftMotion, found: CarriedOut, span: slice
) -> Iterator[tuple[str, NDArray[np.float64], NDArray[np.int64]]]:
    """Yield everybody's distance on plan from the suspended load of a lift: the name, (M,) metres and (M,) times."""
    if span.stop <= span.start or not found.others:
        return
    # From the sample before, at which the load was on the ground.
    first = max(0, span.start - 1)
    time_ns = np.arange(found.time_ns[first], found.time_ns[span.stop - 1] + 1, _FINE_NS)
    plan_ns = _plan_ns(found, first, time_ns)
    axes = planned_axes([motion], plan_ns)
    load = _Load.of(site, lift, motion)
    hook_m, sway_m = _hook_and_sway_m(site, motion, time_ns, axes)
    is_turned = plan_ns < motion.start_ns + motion.loaded.time_ns[0] if load.lies else np.zeros(len(plan_ns), np.bool_)
    at_any_heading = load.at_any_heading | is_turned
    for n, other in enumerate(found.others):
        place_m = np.stack([np.interp(time_ns, found.time_ns, found.place_m[:, n, k]) for k in range(2)], axis=1)
        away_m = place_m - hook_m
        beyond = np.maximum(np.maximum(load.low_m - away_m, away_m - load.high_m), 0.0)
        around_m = np.hypot(*away_m.T) - load.reach_m
        gap_m = np.where(at_any_heading, np.maximum(around_m, 0.0), np.hypot(*beyond.T))
        yield other.id, gap_m - sway_m - RADIUS_M[other.kind], time_ns


def _plan_ns(found: CarriedOut, first: int, time_ns: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return (M,) where the crane is on the plan's clock at times from a sample on."""
    begins, ends = _paces(found)
    row = np.minimum(time_ns // SAMPLE_NS, len(begins) - 1)
    share = (time_ns - found.time_ns[row]) / SAMPLE_NS
    gone = begins[row] * share + 0.5 * (ends[row] - begins[row]) * share**2
    return np.asarray(found.plan_ns[row] + gone * SAMPLE_NS, np.float64)


class _Load(NamedTuple):
    """A load on plan, relative to the line of its hook."""

    low_m: NDArray[np.float64]
    high_m: NDArray[np.float64]
    reach_m: float
    lies: bool
    at_any_heading: bool

    @classmethod
    def of(cls, site: Site, lift: Lift, motion: LiftMotion) -> _Load:
        part, size_m = site.components[motion.component], site.frame.voxel_size_m
        cells = part.shape.cells[:, :2]
        line = np.array(part.hook_line_vox[:2]) + 0.5
        low_m, high_m = size_m * (cells.min(axis=0) - line), size_m * (cells.max(axis=0) + 1 - line)
        reach_m = float(np.hypot(*np.maximum(-low_m, high_m)))
        assert lift.place is not None
        lies = bool(lift.place.turn) or lift.place.pose is not StoredPose.AS_BUILT
        if lies:
            reach_m = max(reach_m, size_m * float(np.hypot(*lift.place.shape.size_vox[:2])))
        return cls(low_m, high_m, reach_m, lies, lift.ever_with_jib)


def _hook_and_sway_m(
    site: Site, motion: LiftMotion, time_ns: NDArray[np.int64], axes: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the hook on plan (N, 2), and how far the load swings out of its vertical (N,)."""
    part = site.components[motion.component]
    crane = crane_for(site, site.cranes[0], part)
    hung = hung_on(site, site.cranes[0], part)
    sway_m = np.zeros(len(time_ns))
    if hung is not None:
        for low, high in pairwise([0, *(after for _, after in _at_rest(axes)), len(time_ns) - 1]):
            swung = swung_on(crane, time_ns[low : high + 1], axes[low : high + 1], hung)
            own_m = np.interp(time_ns[low : high + 1] / 1e9, swung.time_s, swung.amplitude_m)
            sway_m[low : high + 1] = np.maximum(sway_m[low : high + 1], own_m)
        for rests, after in _at_rest(axes):
            sway_m[rests:after] = 0.0
    hook_m = hook_of(crane, *axes.T)[:, :2]
    return hook_m, sway_m


def _at_rest(axes: NDArray[np.float64]) -> list[tuple[int, int]]:
    """Return the rows from which on a load that stands has come to rest, and those at which it moves on."""
    stands = np.abs(np.diff(axes, axis=0)).max(axis=1) <= _STILL
    edges = np.flatnonzero(np.diff(np.concatenate([[False], stands, [False]]).astype(np.int8)))
    settles = _AT_REST_NS // _FINE_NS
    return [(low + settles, high) for low, high in edges.reshape(-1, 2).tolist() if settles < high - low < len(stands)]


def planned_axes(
    motions: Sequence[LiftMotion], plan_ns: NDArray[np.float64] | NDArray[np.int64]
) -> NDArray[np.float64]:
    """Return (N, 3) where the plan has the crane at times on its clock."""
    times, axes = zip(*(motion.samples() for motion in motions), strict=True)
    time_ns, every = np.concatenate(times), np.concatenate(axes)
    return np.stack([np.interp(plan_ns, time_ns, axis) for axis in every.T], axis=1)
