"""Proves the crane's motions independently of how they were made.

The planner makes motions from moves that a swept check of the summed-area table found free. This module does not use
moves: it takes the samples (from a log, for instance), follows the chords between them, and looks up raw cells. On the
last moves, where neighbours share cells, a collision library decides by the triangles.

Numeric tolerances: a position at a sample is within a cell when it reaches less than 1e-5 of a cell into the next one,
between samples 0.05 of a cell (``BETWEEN_VOX``); ends and positions agree within 1 mm; rates, accelerations and jerks
may exceed their limit by 0.1 %.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from bimvox.crane.kinematics import hook_of
from bimvox.crane.tower_crane import TowerCrane
from bimvox.proof.clearance import MOTION_MARGIN, Clearances, TransitProof
from bimvox.proof.clock import check_durations, check_phase_names, check_turned_over
from bimvox.proof.crane.axes import (
    check_capacity,
    check_limits,
    check_phases,
    check_range,
    check_rests,
    most_permitted,
    shares_of_capacity,
)
from bimvox.proof.crane.separation import check_cranes, check_turns
from bimvox.proof.ends import check_ends
from bimvox.proof.flip import is_turned_over
from bimvox.proof.guided import check_heading
from bimvox.proof.hook import Between, HookProof, Turn
from bimvox.proof.load import LoadProof
from bimvox.proof.moment import Moment, Standing
from bimvox.proof.plan import LiftProofs, triangles_of
from bimvox.proof.rigging import rigging_kg, second_block_kg
from bimvox.proof.space import ALWAYS_NS, RawCells
from bimvox.proof.swing import SwingProof, check_gust
from bimvox.proof.tandem import TOGETHER, as_crane_sees, check_together, has_tandems
from bimvox.records.lift import Lift, LiftPlan, Status
from bimvox.records.motion import LiftMotion, Trajectory, by_each_crane
from bimvox.records.proof import Check, Verification, turn_to
from bimvox.site.component import Component
from bimvox.walk import Store
from bimvox.workers import ALONE, Workers

UNITS = {
    "timeline": "",
    "axis_limits": "share of limit",
    "axis_range": "",
    "ends": "m",
    "rests": "",
    "spacing": "cells",
    "capacity": "share of capacity",
    "motion_cells": "",
    "motion_triangles": "m",
    "motion_rope": "",
    "empty_hook": "",
    "zones": "",
    "jib": "",
    "swing": "m",
    "gust": "m",
}
"""The checks, and the unit of ``worst``."""

CRANES_UNITS = {"cranes": "share of distance", "turns": ""}
"""Checks only for sites with several cranes."""

_Proofs = tuple[TowerCrane, LoadProof, HookProof, SwingProof, TransitProof]
"""One crane, and the proofs of its motions."""


def verify_motions(
    plan: LiftPlan,
    motions: Sequence[LiftMotion],
    context: Collection[Lift] = (),
    *,
    window_ns: tuple[int, int] = ALWAYS_NS,
    known: Sequence[LiftMotion] | None = None,
    store: Store | None = None,
    workers: Workers = ALONE,
) -> Verification:
    """Check the motions of a plan.

    Args:
        plan: The plan; assumed to be proven by ``verify_plan``.
        motions: One per planned lift, in order; none for a site without a crane.
        context: Lifts of the same plan that it does not contain (it is an extract of a log).
        window_ns: The span of the site's clock in which the site had this state; collisions count only in this span.
        known: For a site with several cranes: the motions of all lifts, including the context. They determine what is
            where. ``verify_together`` then proves the crane distances for the whole time at once.
        store: Motions that were proven before are not proven again if nothing around them changed.
        workers: Share the work.

    Returns:
        Every check, with what failed and where.
    """
    store = Store() if store is None else store
    if has_tandems(plan.site) or any(motion.second is not None for motion in motions):
        return _verified_by_crane(plan, motions, context, window_ns, known, store, workers)
    verifier = _verifier(plan, motions, context, window_ns, known)
    verifier.triangles = triangles_of(plan, store)
    return verifier.run(store, workers)


def _verified_by_crane(
    plan: LiftPlan,
    motions: Sequence[LiftMotion],
    context: Collection[Lift],
    window_ns: tuple[int, int],
    known: Sequence[LiftMotion] | None,
    store: Store,
    workers: Workers,
) -> Verification:
    """Check the motions of each crane as it sees its lifts: a part that two carry hangs on its own hook alone."""
    checks = {TOGETHER: Check(TOGETHER, unit="share of capacity")}
    every, triangles = motions if known is None else known, triangles_of(plan, store)

    def add(found: Iterable[Check]) -> None:
        for check in found:
            checks.setdefault(check.name, Check(check.name, unit=check.unit)).add(check)

    for number in range(len(plan.site.cranes)):
        site = as_crane_sees(plan.site, number)
        own = tuple(lift for lift in plan.lifts if site.components[lift.component].crane == number)
        orders = {lift.order for lift in own}
        driven = [one for one in by_each_crane(motions) if one.crane == number and one.order in orders]
        others = (*(lift for lift in plan.lifts if lift.order not in orders), *context)
        verifier = _verifier(replace(plan, site=site, lifts=own), driven, others, window_ns, every)
        verifier.triangles = triangles
        add(verifier.run(store, workers).checks)
    whole = _verifier(plan, motions, context, window_ns, known)
    if known is None:
        whole.check_cranes(workers)
        add(check for name, check in whole.checks.items() if name in CRANES_UNITS)
    given, planned = [one.order for one in motions], [one.order for one in plan.lifts if one.status is Status.PLANNED]
    strays = [one.number for one in by_each_crane(motions) if not 0 <= one.crane < len(plan.site.cranes)]
    checks["timeline"].look(not strays, f"motions of lifts {strays} are of cranes that the site has not")
    checks["timeline"].look(given == planned, f"the motions are of lifts {given}, planned are {planned}")
    by_order = {lift.order: lift for lift in plan.lifts}
    for motion in _sound_ones(motions).values():
        if (lift := by_order.get(motion.order)) is not None and lift.status is Status.PLANNED:
            rest = [one for one in every if one.order != motion.order]
            check_together(checks[TOGETHER], plan.site, lift, motion, rest)
    checks[TOGETHER].about = None
    return Verification(tuple(checks.values()))


def verify_together(plan: LiftPlan, motions: Sequence[LiftMotion], context: Collection[Lift] = ()) -> Verification:
    """Check that several cranes keep apart and take turns, independent of obstructions; no checks for one crane."""
    verifier = _verifier(plan, motions, context, ALWAYS_NS, None)
    verifier.check_cranes()
    return Verification(tuple(check for name, check in verifier.checks.items() if name in CRANES_UNITS))


def _verifier(
    plan: LiftPlan,
    motions: Sequence[LiftMotion],
    context: Collection[Lift],
    window_ns: tuple[int, int],
    known: Sequence[LiftMotion] | None,
) -> _Verifier:
    turns: Mapping[int, Turn] = {}
    if plan.site.has_several_cranes:
        seen = motions if known is None else known
        turns = {order: _turn_of(motion) for order, motion in _sound_ones(seen).items()}
    verifier = _Verifier(plan, tuple(context), window_ns, turns)
    verifier.motions, verifier.is_whole = tuple(motions), known is None
    return verifier


def _sound_ones(motions: Sequence[LiftMotion]) -> dict[int, LiftMotion]:
    """Return the motions with sound trajectories, by order; the others are reported when they are checked."""
    aside = Check("timeline")
    return {
        motion.order: motion for motion in motions if all(_is_sound(aside, "", one) for one in by_each_crane([motion]))
    }


class _Driven(NamedTuple):
    """A motion, the number of its lift among all lifts, and the motion before it if it is compared with one."""

    number: int
    motion: LiftMotion
    before: LiftMotion | None


@dataclass(eq=False)
class _Verifier(LiftProofs[_Driven]):
    """Checks motions of a plan, each by itself.

    Attributes:
        window_ns: As for ``verify_motions``.
        turns: Of several cranes, when each lift is where; empty for one crane.
    """

    window_ns: tuple[int, int]
    turns: Mapping[int, Turn]

    def __post_init__(self) -> None:
        super().__post_init__()
        self.motions: tuple[LiftMotion, ...] = ()
        self.is_whole = True
        several = self.site.has_several_cranes
        self.clearances, self.cells = Clearances(self.site), RawCells(self.site.shape)
        self.between = Between(self.plan, self.turns, self.context) if several else None
        units = UNITS | (CRANES_UNITS if several else {})
        if self.site.rules.transit_clearance_m > 0.0 or self.site.rules.rope_clearance_m > 0.0:
            units |= {MOTION_MARGIN: ""}
        self.checks = {name: Check(name, unit=unit) for name, unit in units.items()}
        self.proofs = dict[int, _Proofs]()

    def turn_of(self, task: _Driven) -> int:
        """Return the number of the lift."""
        return task.number

    def read(self, task: _Driven) -> tuple[object, ...]:
        """Return the lift and how both motions move, whenever they start: of one crane in a plan over all time."""
        lift = self.lifts[task.number]
        before = next((one for one in reversed(self.lifts[: task.number]) if one.status is Status.PLANNED), None)
        if self.site.moving is not None and before is not None and self._moves_between(before, lift):
            before = None
        return lift, before, self.lying, _course(task.motion), _course(task.before)

    def step(self, state: Standing, task: _Driven) -> Mapping[str, Check]:
        """Return the checks of a motion."""
        moment = state.moment(self.lifts[task.number])
        if self.between is not None:  # the lift before of the same crane
            moment = replace(moment, before=self.between.before(moment.lift))
        return self._checks_of(moment, task.motion, task.before)

    def run(self, store: Store, workers: Workers) -> Verification:
        """Check all motions."""
        if not self.site.cranes:
            self.checks["timeline"].look(not self.motions, "motions on a site that has no crane")
            return Verification(tuple(self.checks.values()))
        self._check_timeline()
        driven = list(self._driven())
        is_stored = self.between is None and self.window_ns == ALWAYS_NS
        for found in self.results(driven, store if is_stored else Store(), workers):
            for check in found.values():
                self.checks[check.name].add(check)
        if self.is_whole:
            self.check_cranes(workers)
        return Verification(tuple(self.checks.values()))

    def _driven(self) -> Iterator[_Driven]:
        """Yield every motion that is fit to be checked, in order; report the others."""
        by_order, own = {motion.order: motion for motion in self.motions}, {id(lift) for lift in self.plan.lifts}
        previous: dict[int, LiftMotion] = {}
        last: Lift | None = None
        for number, lift in enumerate(self.lifts):
            if lift.status is not Status.PLANNED:
                continue
            then, last = last, lift
            if self.site.moving is not None and then is not None and self._moves_between(then, lift):
                then = None
                previous.clear()
            if id(lift) not in own:
                continue
            motion, component = by_order.get(lift.order), self.site.components[lift.component]
            turn_to(self.checks.values(), component.id)
            name, before = _name(lift, component), previous.pop(component.crane, None)
            if motion is None or motion.component != lift.component:
                self.checks["timeline"].look(False, f"{name}: it has no motion")
                continue
            if not _is_sound(self.checks["timeline"], name, motion):
                continue
            if motion.crane != component.crane:
                self.checks["timeline"].look(False, f"{name}: it is driven by crane {motion.crane}, not its own")
                continue
            if self.between is not None:
                then = self.between.before(lift)
            if before is not None and (then is None or before.order != then.order):
                before = None
            yield _Driven(number, motion, before)
            previous[component.crane] = motion

    def _moves_between(self, one: Lift, other: Lift) -> bool:
        cranes = [self.site.components[lift.component].crane for lift in (one, other)]
        return cranes[0] != cranes[1]

    def _checks_of(self, moment: Moment, motion: LiftMotion, before: LiftMotion | None) -> Mapping[str, Check]:
        """Return the checks of one motion, each by itself."""
        ways = None if self.between is None else tuple(self.between.ways(moment, motion))
        component, whole = self.site.components[moment.lift.component], dict(self.checks)
        name = _name(moment.lift, component)
        crane, load, hook, swing, transit = self._proofs(component.crane)
        # The proofs share this dictionary, so it is filled with checks of this motion alone for a while.
        self.checks.update({n: Check(n, unit=check.unit, about=component.id) for n, check in whole.items()})
        self._check_axes(name, crane, moment, motion)
        tag_lines, timeline = not moment.lift.ever_with_jib, self.checks["timeline"]
        place = moment.lift.place
        lies = place is not None and place.is_upended
        rise_m = None
        if place is not None and is_turned_over(component, place):
            rise_m, lies = self.site.frame.voxel_size_m * place.rise_vox, False
        check_durations(timeline, name, self.site.rules, component, motion, tag_lines=tag_lines, lies=lies)
        check_turned_over(timeline, name, self.site.rules, motion, rise_m)
        check_heading(timeline, name, self.site, crane, moment.lift, component, motion)
        check_phase_names(timeline, name, motion)
        check_ends(self.checks["ends"], name, self.site, crane, moment, motion, before)
        self.cells.move_to(moment.present)
        load.check(name, moment, motion)
        transit.check(name, moment, motion)
        hook.check(name, moment, motion, ways)
        swing.check(name, moment, motion, ways)
        check_gust(self.checks["gust"], name, self.site, crane, moment.lift, motion)
        own = dict(self.checks)
        self.checks.update(whole)
        return own

    def _proofs(self, number: int) -> _Proofs:
        if number not in self.proofs:
            crane = self.site.cranes[number]
            shared = (self.site, crane, self.triangles, self.cells, self.checks, self.window_ns)
            transit = TransitProof(*shared)
            transit.clearances = self.clearances
            self.proofs[number] = crane, LoadProof(*shared), HookProof(*shared), SwingProof(*shared), transit
        return self.proofs[number]

    def _check_timeline(self) -> None:
        """Check that there is one motion per planned lift, in order, on one clock without gaps."""
        check = self.checks["timeline"]
        planned = [lift for lift in (*self.plan.lifts, *self.context) if lift.status is Status.PLANNED]
        planned.sort(key=lambda lift: lift.order)
        carried = [lift.order for lift in self.plan.lifts if lift.status is Status.PLANNED]
        given = [motion.order for motion in self.motions]
        check.look(given == sorted(carried), f"the motions are of lifts {given}, planned are {sorted(carried)}")
        clock: dict[int, LiftMotion] = {motion.order: motion for motion in self.motions}
        by_crane: dict[int, list[Lift]] = {}
        for lift in planned:  # those of a crane that moves follow each other on one clock
            crane = 0 if self.site.moving is not None else self.site.components[lift.component].crane
            by_crane.setdefault(crane, []).append(lift)
        for own in by_crane.values():
            self._check_clock(own, clock)
        check.look(given == sorted(given), "the motions do not follow each other in the order of their lifts")

    def _check_clock(self, lifts: Sequence[Lift], clock: Mapping[int, LiftMotion]) -> None:
        """Check that the lifts of one crane follow each other without gaps, from the start of the clock."""
        check = self.checks["timeline"]
        before: LiftMotion | None = None
        starts: list[int] = []
        for n, lift in enumerate(lifts):
            motion = clock.get(lift.order)
            if motion is None:
                before = None
                continue
            starts.append(motion.start_ns)
            if n == 0:
                check.look(
                    motion.start_ns == 0, f"lift {lift.number}: the clock starts at {motion.start_ns} ns, not at 0"
                )
            if before is not None:
                check.look(
                    motion.start_ns == before.end_ns,
                    f"lift {lift.number}: starts at {motion.start_ns / 1e9:.3f} s, "
                    f"the lift before ends at {before.end_ns / 1e9:.3f} s",
                )
            check.look(motion.end_ns > motion.start_ns, f"lift {lift.number}: ends before it starts")
            check_phases(check, f"lift {lift.number}", motion)
            before = motion
        check.look(starts == sorted(starts), "the motions do not follow each other on the clock")

    def check_cranes(self, workers: Workers = ALONE) -> None:
        """Check the turns of several cranes and the distance between them."""
        if not self.site.has_several_cranes:
            return
        sound = list(_sound_ones(self.motions).values())
        check_turns(self.checks["turns"], self.site, self.plan, sound, self.context)
        is_whole = not self.context and self.window_ns == ALWAYS_NS
        sound = [one for one in by_each_crane(sound) if 0 <= one.crane < len(self.site.cranes)]
        check_cranes(self.checks["cranes"], self.site, sound, self.window_ns, is_whole=is_whole, workers=workers)

    def _check_axes(self, name: str, crane: TowerCrane, moment: Moment, motion: LiftMotion) -> None:
        component = self.site.components[moment.lift.component]
        # Its own gear replaces the crane's usual rigging, which the checks below add.
        mass_kg = component.mass_kg + rigging_kg(crane, component) - crane.rigging_mass_kg
        check_limits(self.checks["axis_limits"], name, crane, motion, mass_kg)
        check_range(self.checks["axis_range"], name, crane, motion.samples()[1], self.site.frame)
        ends = ((motion.raising, 0), (motion.loaded, 0), (motion.loaded, -1))
        ends_rad, ends_m = (np.array([getattr(one, key)[n] for one, n in ends]) for key in ("slew_rad", "radius_m"))
        hung = mass_kg + crane.rigging_mass_kg + crane.hook_block_kg + second_block_kg(crane)
        most_used = most_permitted(self.site, shares_of_capacity(crane, ends_rad, ends_m, hung).tolist())
        masses = {id(motion.approach): 0.0, id(motion.departure): 0.0}
        for what, part in (
            ("approach", motion.approach),
            ("raising", motion.raising),
            ("loaded motion", motion.loaded),
            ("departure", motion.departure),
        ):
            if part is None:
                continue
            check_rests(self.checks["rests"], name, crane, part, what)
            _check_spacing(self.checks["spacing"], name, crane, part, self.site.frame.voxel_size_m)
            hung_kg = masses.get(id(part), mass_kg)
            check_capacity(self.checks["capacity"], name, crane, part, hung_kg, most_used)


def _name(lift: Lift, component: Component) -> str:
    return f"lift {lift.number} ({component.label})"


def _course(motion: LiftMotion | None) -> tuple[object, ...] | None:
    """Return a motion without the time at which it starts."""
    if motion is None:
        return None
    phases = tuple((p.name, p.start_ns - motion.start_ns, p.end_ns - motion.start_ns) for p in motion.phases)
    parts = (motion.approach, motion.raising, motion.loaded, motion.departure)
    return motion.order, motion.crane, parts, phases, motion.end_ns - motion.start_ns, motion.wind


def _is_sound(check: Check, name: str, motion: LiftMotion) -> bool:
    """Check that every trajectory has at least two samples, three finite axes of equal length and ascending times."""
    good = True
    for part in motion.trajectories:
        count = len(part.time_ns)
        lengths = {len(part.slew_rad), len(part.radius_m), len(part.height_m)}
        whole = count >= 2 and lengths == {count}
        whole = whole and bool(np.isfinite(part.axes).all())
        whole = whole and bool((np.diff(part.time_ns) > 0).all())
        check.look(whole, f"{name}: a trajectory without times that ascend and finite axes of the same length")
        good = good and whole
    return good


_MOST_SPACING_VOX = 0.5


def _check_spacing(check: Check, name: str, crane: TowerCrane, trajectory: Trajectory, voxel_size_m: float) -> None:
    """Check that the hook moves at most half a cell between two samples."""
    hook_m = hook_of(crane, trajectory.slew_rad, trajectory.radius_m, trajectory.height_m)
    steps = np.linalg.norm(np.diff(hook_m, axis=0), axis=1) / voxel_size_m
    worst = int(np.argmax(steps))
    check.measure(float(steps[worst]))
    check.look(
        bool(steps[worst] <= _MOST_SPACING_VOX + 1e-6),
        f"{name}: {steps[worst]:.3f} cells between samples at {trajectory.time_ns[worst] / 1e9:.2f} s",
        samples=len(steps),
    )


def _turn_of(motion: LiftMotion) -> Turn:
    """Return the times of a motion."""
    return Turn(motion.raised_ns, motion.set_ns, motion.released_ns)
