"""The proof of times: lifts follow each other, the crew gets its time, a stop has a cause, other work is done."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.kinds.kind import Kind
from bimvox.proof.bodies.triangles import TriangleCheck
from bimvox.proof.plan import triangles_of
from bimvox.records.lift import Lift, LiftPlan, Status
from bimvox.records.motion import LiftMotion, Phase, PhaseName, by_each_crane
from bimvox.records.proof import Check
from bimvox.records.steps import Pause, Step, Steps
from bimvox.site.casting import BuildingTimes, Casting
from bimvox.site.component import Component
from bimvox.site.default_rules import MOST_WORK_S
from bimvox.site.means import Means
from bimvox.site.site import HeadingRule, Rules
from bimvox.site.work import Work, kind_of, work_of
from bimvox.walk import Store

_TRIAL_LIFT_S = 10.0


def _least_ns(rules: Rules, component: Component) -> int:
    """Return the least time of a lift: that of the crew, without any motion of the crane."""
    tag_lines = rules.heading is HeadingRule.KEPT
    return round((_TRIAL_LIFT_S + sum(_asked_s(rules, component, tag_lines=tag_lines))) * 1e9)


def check_durations(
    check: Check,
    name: str,
    rules: Rules,
    component: Component,
    motion: LiftMotion,
    *,
    tag_lines: bool = True,
    lies: bool = False,
) -> None:
    """Check that the crew has the time of the rules to hook on, check the raised part, set it and release it.

    The rules give these times by the part's class of work, or one value for all classes. A load without tag lines turns
    with the jib. A part that lies in the yard (``lies``) is upended before it is carried.
    """
    hook_on_s, brace_s, hook_off_s = _asked_s(rules, component, tag_lines=tag_lines)
    raised_s = _TRIAL_LIFT_S + rules.upend_s * lies
    given_ns = {
        phase: sum(p.end_ns - p.start_ns for p in motion.phases if p.name is phase)
        for phase in (PhaseName.HOOK_ON, PhaseName.RAISE, PhaseName.SET, PhaseName.RELEASE)
    }
    given_ns[PhaseName.RAISE] -= int(motion.raising.time_ns[-1] - motion.raising.time_ns[0])
    for phase, act, wanted_s in (
        (PhaseName.HOOK_ON, "hooking on", hook_on_s),
        (PhaseName.RAISE, "the trial lift, and upending if it lies," if lies else "the trial lift", raised_s),
        (PhaseName.SET, "setting", brace_s),
        (PhaseName.RELEASE, "releasing", hook_off_s),
    ):
        check.look(
            given_ns[phase] >= round(wanted_s * 1e9),
            f"{name}: {act} takes {given_ns[phase] / 1e9:.6g} s; the rules ask for {wanted_s:g} s "
            f"({work_of(component)})",
        )


def check_turned_over(check: Check, name: str, rules: Rules, motion: LiftMotion, rise_m: float | None) -> None:
    """Check that a part is turned over between two hooks as slowly as the rules ask, and the second hook taken off.

    ``rise_m``: how far it is lifted level before; None: it is not turned over so.
    """
    if rise_m is None or rules.two_hooks is None:
        return
    time_ns, height_m = motion.raising.time_ns, motion.raising.height_m
    level = np.flatnonzero(height_m <= height_m[0] + rise_m + _STILL)
    upright = int(np.argmax(height_m >= height_m.max() - _STILL))
    turns_s = float(time_ns[upright] - time_ns[level[-1]]) / 1e9
    check.look(
        turns_s >= rules.two_hooks.turn_s - _LATE_S,
        f"{name}: is turned over between two hooks in {turns_s:.1f} s; the rules ask for {rules.two_hooks.turn_s:g} s",
    )
    stands_ns = sum(p.end_ns - p.start_ns for p in motion.phases if p.name is PhaseName.RAISE)
    stands_s = (stands_ns - int(time_ns[-1] - time_ns[0])) / 1e9
    asked_s = _TRIAL_LIFT_S + rules.two_hooks.unhook_s
    check.look(
        stands_s >= asked_s - 1e-6,
        f"{name}: the trial lift, and taking the auxiliary hook off, take {stands_s:.6g} s; the rules ask for "
        f"{asked_s:g} s",
    )


def _asked_s(rules: Rules, component: Component, *, tag_lines: bool) -> tuple[float, float, float]:
    """Return what the rules ask for hooking on, setting and releasing a part, seconds.

    Tag lines are fixed while the part is hooked on, and taken off with the slings.
    """
    own = getattr(rules.times, work_of(component))
    brace_s = own.brace_s if rules.bracing_s is None else rules.bracing_s
    release_s = own.release_s if rules.release_s is None else rules.release_s
    tag_line_s = own.tag_line_s if tag_lines else 0.0
    return own.sling_s + tag_line_s, brace_s, release_s + tag_line_s


_HOLD_S = 10.0
"""Tag lines bring a load to rest in this time; nominal."""
_PAUSE_S = 1.0
"""An empty hook is at rest for this long before it moves again."""
_STILL = 1e-6
"""An axis that moves by less, rad or m, is at rest."""


def check_stops(check: Check, plan: LiftPlan, motions: Sequence[LiftMotion]) -> None:
    """Check every phase called stop: the obstructions changed before it, and at its end the crane has held still.

    After it, the proof of the swing takes the load to hang at rest. What is stopped for good may still swing.

    Args:
        check: Receives the result.
        plan: The plan, with its past obstructions.
        motions: Its motions.
    """
    changes_ns = [epoch.until_ns for epoch in plan.history]
    for motion in motions:
        part = plan.site.components[motion.component]
        check.about, name = part.id, f"lift {motion.number} ({part.label})"
        for begins_ns, ends_ns in motion.stops_ns:
            caused = any(change_ns <= begins_ns for change_ns in changes_ns)
            at = f"at {begins_ns / 1e9:.3f} s"
            check.look(caused, f"{name}: it is stopped {at}, but the obstructions do not change before that")
            still_s = _still_s(motion, begins_ns, ends_ns)
            is_empty = ends_ns <= motion.hooked_ns or begins_ns >= motion.released_ns
            least_s = _PAUSE_S if is_empty else _HOLD_S
            check.look(
                still_s >= least_s - 1e-6 or ends_ns == motion.end_ns,
                f"{name}: it is stopped {at}, and held still for {still_s:.3g} s; {least_s:g} s bring it to rest",
            )
    check.about = None


def _still_s(motion: LiftMotion, begins_ns: int, ends_ns: int) -> float:
    """Return for how long no axis has moved at the end of a stop."""
    times_ns, axes = motion.samples()
    rest = np.array([np.interp(ends_ns, times_ns, axis) for axis in axes.T])
    inside = (times_ns >= begins_ns) & (times_ns <= ends_ns)
    moves = inside & (np.abs(axes - rest).max(axis=1) > _STILL)
    if not moves.any():
        return (ends_ns - begins_ns) / 1e9
    after = times_ns[int(np.flatnonzero(moves)[-1]) + 1 :]
    return (ends_ns - int(after[0])) / 1e9 if len(after) and after[0] <= ends_ns else 0.0


# The proof that the phases of a carried load say what the crane does in them.
#
# Hoist lasts until slewing or trolleying begins, and traverse begins then. Lower begins with the final lowering, and
# goes down until the load is at its place. Where a stop interrupts them, the same holds for what follows it.

_LATE_S = 2.0
"""A move that accelerates from rest, or comes to rest, stays within ``_STILL`` for less than this."""
_CARRYING = (PhaseName.HOIST, PhaseName.TRAVERSE, PhaseName.LOWER)


def check_phase_names(check: Check, name: str, motion: LiftMotion) -> None:
    """Check hoist, traverse and lower of a lift by the samples of its loaded motion."""
    last: Phase | None = None
    for phase, time_s, axes in _sampled_phases(motion):
        last = phase
        at_s = phase.start_ns / 1e9
        if phase.name is PhaseName.HOIST:
            good = _still_until(axes[:, :2]) == len(axes)
            check.look(good, f"{name}: it slews or trolleys in its phase hoist, which begins at {at_s:.3f} s")
        elif phase.name is PhaseName.TRAVERSE:
            late_s = float(time_s[_still_until(axes[:, :2]) - 1] - time_s[0])
            check.look(
                late_s <= _LATE_S,
                f"{name}: in its phase traverse, which begins at {at_s:.3f} s, it slews or trolleys "
                f"only after {late_s:.1f} s",
            )
        else:
            height_m = np.minimum.accumulate(axes[:, 2])
            rises = float((axes[:, 2] - height_m).max())
            check.look(rises <= _STILL, f"{name}: it is hoisted in its phase lower, which begins at {at_s:.3f} s")
            waits_s = _longest_level_s(time_s, height_m) if rises <= _STILL else 0.0
            check.look(
                waits_s <= _LATE_S,
                f"{name}: in its phase lower, which begins at {at_s:.3f} s, it is not lowered for {waits_s:.1f} s",
            )
    if last is not None and last.name is not PhaseName.LOWER and _is_followed_by_set(motion, last):
        down_s = _lowered_last_s(motion)
        check.look(
            down_s <= _LATE_S, f"{name}: it is lowered for {down_s:.1f} s before it is set, in its phase {last.name}"
        )


def _sampled_phases(motion: LiftMotion) -> Iterator[tuple[Phase, NDArray[np.float64], NDArray[np.float64]]]:
    """Yield the carrying phases with the times and axes of the samples in them; those without samples are left out."""
    time_ns = motion.loaded.time_ns + motion.start_ns
    for phase in motion.phases:
        inside = (time_ns >= phase.start_ns) & (time_ns <= phase.end_ns)
        if phase.name in _CARRYING and inside.any():
            yield phase, time_ns[inside] / 1e9, motion.loaded.axes[inside]


def _still_until(axes: NDArray[np.float64]) -> int:
    """Return how many samples from the first one are where it is."""
    moved = (np.abs(axes - axes[0]) > _STILL).any(axis=1)
    return int(np.argmax(moved)) if moved.any() else len(axes)


def _longest_level_s(time_s: NDArray[np.float64], height_m: NDArray[np.float64]) -> float:
    """Return the longest time between samples that do not descend; the heights never rise."""
    after = np.searchsorted(-height_m, _STILL - height_m, side="right")
    return float((time_s[after - 1] - time_s).max())


def _is_followed_by_set(motion: LiftMotion, last: Phase) -> bool:
    return any(phase.name is PhaseName.SET and phase.start_ns == last.end_ns for phase in motion.phases)


def _lowered_last_s(motion: LiftMotion) -> float:
    """Return for how long the load is only lowered at the end of its way; 0 if it is also hoisted there."""
    time_s, axes = motion.loaded.time_ns / 1e9, motion.loaded.axes[::-1]
    straight = _still_until(axes[:, :2])
    upward_m = np.diff(axes[:straight, 2], prepend=axes[0, 2])
    if (upward_m < -_STILL).any() or upward_m.sum() <= _STILL:
        return 0.0
    level = _still_until(axes[:straight, 2:][::-1])
    return float(time_s[-1] - time_s[len(time_s) - straight + level - 1])


_MOST_NS = 86_400_000_000_000
"""A lift that a log does not carry takes at most this long, in addition to the crew's time and waiting."""


def check_clock(check: Check, plan: LiftPlan, motions: Sequence[LiftMotion], context: Collection[Lift]) -> None:
    """Check that each lift of a crane starts when the one before it ends.

    Of lifts that the log does not carry, only bounds are known: each takes at least the crew's time and at most a day
    more, and waits at most for other cranes and until obstructions change.

    Args:
        check: Receives the result.
        plan: The plan.
        motions: Its motions, one per planned lift.
        context: Lifts of the same plan that it does not contain.
    """
    site, by_order = plan.site, {motion.order: motion for motion in motions}
    of_crane = {(motion.order, motion.crane): motion for motion in by_each_crane(motions)}
    planned = [lift for lift in (*plan.lifts, *context) if lift.status is Status.PLANNED]
    planned.sort(key=lambda lift: lift.order)
    crew_ns = {
        lift.order: _least_ns(site.rules, site.components[lift.component])
        for lift in planned
        if lift.order not in by_order
    }
    changed_ns = plan.history[-1].until_ns if plan.history else 0
    others_ns = max((motion.end_ns for motion in motions), default=0) if site.has_several_cranes else 0
    moves = site.moving is not None  # then all lifts follow each other on one clock
    for crane in range(1 if moves else max(1, len(site.cranes))):
        before_ns, skipped = 0, list[int]()
        for lift in planned:
            part = site.components[lift.component]
            is_second = part.tandem is not None and part.tandem.second == crane
            if part.crane != crane and not moves and not is_second:
                continue
            motion = of_crane.get((lift.order, crane)) if part.tandem is not None else by_order.get(lift.order)
            if motion is None:
                skipped.append(lift.order)
                continue
            check.about, name = part.id, f"lift {lift.number} ({part.label})"
            least = before_ns + sum(crew_ns[order] for order in skipped)
            waits_ns = sum(crew_ns[order] + _MOST_NS for order in (crew_ns if site.has_several_cranes else skipped))
            most = max(before_ns, changed_ns, others_ns) + waits_ns if skipped else before_ns
            after = (
                f" the {len(skipped)} lifts before it that are not in this log" if skipped else " the lift before it"
            )
            check.look(
                least <= motion.start_ns <= most,
                f"{name}: starts at {motion.start_ns / 1e9:.3f} s; after{after}, it can start "
                + (f"from {least / 1e9:.3f} s to {most / 1e9:.3f} s" if skipped else f"at {least / 1e9:.3f} s"),
            )
            before_ns, skipped = motion.end_ns, []
    check.about = None


_ROUNDING_NS = 1
_UPRIGHT = frozenset((Work.COLUMN, Work.WALL))
_SPANNING = frozenset((Work.BEAM, Work.SLAB, Work.STAIR))
"""What spans; on the ground it is cast as a footing."""
_ON_GROUND_M = 0.3
_AT_FEET_M = 3.0
_LEVEL_M = 0.5


def verify_steps(plan: LiftPlan, motions: Sequence[LiftMotion], steps: Steps, store: Store | None = None) -> Check:
    """Check every step of work that the crane does not do, and every pause of the crane.

    Each step has the time that the rules give it, begins after all earlier lifts and after what it rests on carries,
    and each crew works at one part. No part reaches its place before what it rests on carries.

    Args:
        plan: The whole plan.
        motions: All its motions.
        steps: The steps and pauses to prove.
        store: What carries a part is not measured again if it was for the same site.
    """
    check = Check("steps")
    if not motions:
        check.look(not steps.steps and not steps.pauses, "steps without motions")
        return check
    triangles = triangles_of(plan, Store() if store is None else store)
    _Proof(check, plan, motions, steps, triangles).run()
    check.about = None
    return check


def elapsed_ns(pauses: Iterable[Pause], at_ns: int) -> int:
    """Return elapsed time at a moment on the site's clock at which no pause is, or before the pause then."""
    return at_ns + sum(pause.length_ns for pause in pauses if pause.at_ns < at_ns)


def curing_ns(rules: Rules, part: Component) -> int:
    """Return how long the joints of a lifted part cure after its release; 0 if they carry at once."""
    hours = 0.0 if rules.curing is None else getattr(rules.curing, f"{work_of(part).value}_h")
    return round(hours * 3600e9)


class _Proof:
    def __init__(
        self,
        check: Check,
        plan: LiftPlan,
        motions: Sequence[LiftMotion],
        steps: Steps,
        triangles: TriangleCheck,
    ) -> None:
        self.check, self.plan, self.casting = check, plan, plan.site.rules.casting
        self.site, self.pauses, self.moves = plan.site, steps.pauses, steps.moves
        self.lifts = sorted(plan.lifts, key=lambda lift: lift.order)
        self.motions = {motion.order: motion for motion in motions}
        self.cured_ns = {motion.component: self._cured_ns(motion) for motion in motions}
        self.steps = {step.component: step for step in steps.steps}
        self.given = [step.component for step in steps.steps]
        self.triangles = triangles

    def run(self) -> None:
        """Look at everything."""
        wanted = [lift.component for lift in self.lifts if lift.is_set and lift.status is not Status.PLANNED]
        self.check.look(
            self.given == wanted, f"there are {len(self.given)} steps; {len(wanted)} parts are not set by the crane"
        )
        self._check_pauses()
        last: dict[Means, Step] = {}
        for lift in self.lifts:
            part = self.site.components[lift.component]
            self.check.about = part.id
            step, motion = self.steps.get(part.index), self.motions.get(lift.order)
            if step is not None:
                self._check_step(part, step, last.get(part.means))
                last[part.means] = step
            elif motion is not None:
                self._check_set(f"lift {lift.number} ({part.label})", part, self._elapsed_ns(motion.set_ns))

    def _elapsed_ns(self, at_ns: int) -> int:
        return elapsed_ns(self.pauses, at_ns)

    def _cured_ns(self, motion: LiftMotion) -> int | None:
        """Return the elapsed time from which the joints of a lifted part carry what rests on it; None: at once."""
        cures_ns = curing_ns(self.site.rules, self.site.components[motion.component])
        return self._elapsed_ns(motion.released_ns) + cures_ns if cures_ns else None

    def _check_step(self, part: Component, step: Step, before: Step | None) -> None:
        name, look = f"lift {step.order + 1} ({part.label})", self.check.look
        work_s, wait_s = _asked_for_s(self.casting, self.site.rules.building, part)
        spent_s, waited_s = (step.ends_ns - step.begins_ns) / 1e9, (step.carries_ns - step.ends_ns) / 1e9
        look(spent_s >= work_s - 1e-6, f"{name}: the work takes {spent_s:g} s; the rules ask for {work_s:g} s")
        good = waited_s >= wait_s - 1e-6
        look(good, f"{name}: it carries {waited_s:g} s after the work; the rules ask for {wait_s:g} s")
        if before is not None and part.means is not Means.CRANE:
            good = step.begins_ns >= before.ends_ns
            look(good, f"{name}: it begins while the same people are at work for lift {before.order + 1}")
        for motion in self.motions.values():
            if motion.order < step.order:
                released_ns = self._elapsed_ns(motion.released_ns)
                look(
                    step.begins_ns >= released_ns - _ROUNDING_NS,
                    f"{name}: it begins at {step.begins_ns / 1e9:.3f} s, before lift {motion.number} is set, at "
                    f"{released_ns / 1e9:.3f} s",
                )
        first = min(self.motions.values(), key=lambda motion: motion.order)
        if step.order < first.order:
            look(step.carries_ns <= 0, f"{name}: it comes before the first lift, but carries after the clock starts")
        else:
            look(step.begins_ns >= 0, f"{name}: it begins before the clock starts")
        self._check_set(name, part, step.begins_ns)

    def _check_set(self, name: str, part: Component, at_ns: int) -> None:
        """Check that what a part rests on, or must come after, carries at a time."""
        own, curing = self._order(part), self.site.rules.curing
        waits = curing is not None and (curing.floors_wait or kind_of(part) in _UPRIGHT)
        under = set(self.triangles.carried_by(part))
        under |= {other.index for other in self.site.components if other.id in part.after or part.id in other.before}
        for other in sorted(under):
            step = self.steps.get(other)
            if step is not None and step.order < own:
                self.check.look(
                    at_ns >= step.carries_ns - _ROUNDING_NS,
                    f"{name}: it is there at {at_ns / 1e9:.3f} s of elapsed time; {self.site.components[other].label} "
                    f"under it carries from {step.carries_ns / 1e9:.3f} s",
                )
            cured_ns = self.cured_ns.get(other) if waits else None
            if cured_ns is not None and self._order(self.site.components[other]) < own:
                self.check.look(
                    at_ns >= cured_ns - _ROUNDING_NS,
                    f"{name}: it is there at {at_ns / 1e9:.3f} s of elapsed time; the joints of "
                    f"{self.site.components[other].label} under it have cured at {cured_ns / 1e9:.3f} s",
                )

        for other in self._floors_at_feet(part) if curing is not None and kind_of(part) in _UPRIGHT else ():
            self.check.look(
                at_ns >= (ends_ns := self.cured_ns[other] or 0) - _ROUNDING_NS,
                f"{name}: it is there at {at_ns / 1e9:.3f} s of elapsed time; the joints of "
                f"{self.site.components[other].label} at its feet have cured at {ends_ns / 1e9:.3f} s",
            )

    def _floors_at_feet(self, part: Component) -> Iterator[int]:
        """Yield the floors that were lifted earlier and that the crew stands on which sets an upright part."""
        low_m, high_m = part.mesh.vertices_m.min(axis=0), part.mesh.vertices_m.max(axis=0)
        for motion in self.motions.values():
            floor = self.site.components[motion.component]
            if motion.order >= self._order(part) or kind_of(floor) is not Work.SLAB:
                continue
            points_m = floor.mesh.vertices_m
            apart_m = np.maximum(points_m.min(axis=0) - high_m, low_m - points_m.max(axis=0))[:2].max()
            if apart_m <= _AT_FEET_M and abs(low_m[2] - points_m[:, 2].max()) <= _LEVEL_M:
                yield floor.index

    def _order(self, part: Component) -> int:
        return next(lift.order for lift in self.lifts if lift.component == part.index)

    def _check_pauses(self) -> None:
        """Check that a pause is before a lift, with no load on any hook, and ends when some work carries."""
        carries_ns = {step.carries_ns for step in self.steps.values()} | set(self.cured_ns.values())
        carries_ns |= {move.ends_ns for move in self.moves}
        for pause in self.pauses:
            motion = self.motions.get(pause.order)
            self.check.about = None if motion is None else self.site.components[motion.component].id
            name = f"the pause before lift {pause.order + 1}"
            self.check.look(pause.length_ns > 0, f"{name} has no length")
            there = motion is not None and motion.start_ns <= pause.at_ns <= motion.hooked_ns
            self.check.look(there, f"{name} is at {pause.at_ns / 1e9:.3f} s, where that lift does not begin")
            hung = [one.number for one in self.motions.values() if one.hooked_ns < pause.at_ns < one.released_ns]
            self.check.look(not hung, f"{name}: lifts {hung} hang on their hooks meanwhile")
            ends_ns = self._elapsed_ns(pause.at_ns) + self._at(pause)
            self.check.look(ends_ns in carries_ns, f"{name} ends when nothing begins to carry, and no move ends")
        orders = [pause.order for pause in self.pauses]
        self.check.look(orders == sorted(set(orders)), "a lift has two pauses, or they are not in the order of lifts")

    def _at(self, pause: Pause) -> int:
        """Return the length of all pauses at the moment of one, up to it."""
        return sum(one.length_ns for one in self.pauses if one.at_ns == pause.at_ns and one.order <= pause.order)


def _asked_for_s(casting: Casting, building: BuildingTimes, part: Component) -> tuple[float, float]:
    """Return the time of work and of waiting that the rules ask for, seconds."""
    if part.means is Means.BY_HAND:
        return casting.hand_s, 0.0
    if part.means is Means.BUILT:
        return _built_s(building, part)
    if part.means is Means.IN_SITU:
        work = work_of(part)
        foot_m = part.mesh.vertices_m[part.mesh.faces.ravel(), 2].min()
        if work in _SPANNING and not part.spans and foot_m <= _ON_GROUND_M:
            work = Work.FOOTING
        own = getattr(casting, work.value)
        work_s = part.mass_kg / 2400.0 * own.hours_m3 / casting.people * 3600.0
        return min(work_s, MOST_WORK_S), own.wait_h * 3600.0
    return 0.0, 0.0


def _built_s(building: BuildingTimes, part: Component) -> tuple[float, float]:
    """Return the time in which a trade builds a part, and of waiting; by triangles, not by the planner's function."""
    a_m, b_m, c_m = (part.mesh.vertices_m[part.mesh.faces[:, corner]] - part.mesh.vertices_m[0] for corner in range(3))
    normals_m2 = np.cross(b_m - a_m, c_m - a_m) / 2.0
    side_m2 = float(np.sqrt((normals_m2**2).sum(axis=1)).sum()) / 2.0
    volume_m3 = abs(float((a_m * normals_m2).sum())) / 3.0
    person_s = 3600.0 * {
        Kind.MASONRY: building.masonry_h_m3 * volume_m3,
        Kind.EARTH: building.earth_h_m3 * volume_m3,
        Kind.LIGHT: building.light_h_m2 * side_m2,
        Kind.GLAZING: building.glazing_h_m2 * side_m2,
    }.get(part.judgement.kind, building.other_h_m3 * volume_m3)
    return min(person_s / building.people, MOST_WORK_S), building.wait_h * 3600.0
