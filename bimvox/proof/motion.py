"""Proves the crane's motions independently of how they were made.

The planner makes motions from moves that a swept check of the summed-area table found free. This module does not use
moves: it takes the samples (from a log, for instance), follows the chords between them, and looks up raw cells. On the
last moves, where neighbours share cells, a collision library decides by the triangles.

Numeric tolerances: a position at a sample is within a cell when it reaches less than 1e-5 of a cell into the next one,
between samples 0.05 of a cell (``BETWEEN_VOX``); ends and positions agree within 1 mm; rates, accelerations and jerks
may exceed their limit by 0.1 %.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from bimvox.crane.tower_crane import TowerCrane
from bimvox.proof.between import Between, Turn, turn_of
from bimvox.proof.clearance import MOTION_MARGIN, Clearances, TransitProof
from bimvox.proof.crane.axes import (
    check_limits,
    check_phases,
    check_range,
    check_rests,
    check_spacing,
    is_sound,
)
from bimvox.proof.crane.capacity import check_capacity
from bimvox.proof.crane.separation import check_cranes
from bimvox.proof.crane.turns import check_turns
from bimvox.proof.durations import check_durations
from bimvox.proof.ends import check_ends
from bimvox.proof.heading import check_heading
from bimvox.proof.hook import HookProof
from bimvox.proof.load import LoadProof
from bimvox.proof.moment import Moment, moments
from bimvox.proof.phase_names import check_phase_names
from bimvox.proof.proven import ProvenLifts
from bimvox.proof.rigging import rigging_kg
from bimvox.proof.space import ALWAYS_NS, RawCells
from bimvox.proof.swing import SwingProof
from bimvox.records.lift import Lift, LiftPlan, Status
from bimvox.records.motion import LiftMotion
from bimvox.records.proof import Check, Verification, turn_to
from bimvox.site.component import Component
from bimvox.workers import ALONE, Workers, in_chunks

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
    proven: ProvenLifts | None = None,
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
        proven: Motions of one crane that earlier plans of the same site proved; they are not proven again if nothing
            around them changed, and those that pass now are added. Only for a whole plan, over all time.
        workers: Share the work.

    Returns:
        Every check, with what failed and where.
    """
    return _Verifier(plan, motions, context, window_ns, known, proven).run(workers)


def verify_together(plan: LiftPlan, motions: Sequence[LiftMotion], context: Collection[Lift] = ()) -> Verification:
    """Check that several cranes keep apart and take turns, independent of obstructions; no checks for one crane."""
    verifier = _Verifier(plan, motions, context, ALWAYS_NS, None, None)
    verifier.check_cranes()
    return Verification(tuple(check for name, check in verifier.checks.items() if name in CRANES_UNITS))


class _Driven(NamedTuple):
    """A motion, the moment before its lift, and the motion before it if it is compared with one."""

    moment: Moment
    motion: LiftMotion
    before: LiftMotion | None


def _name(moment: Moment, component: Component) -> str:
    return f"lift {moment.lift.number} ({component.label})"


class _Verifier:
    def __init__(
        self,
        plan: LiftPlan,
        motions: Sequence[LiftMotion],
        context: Collection[Lift],
        window_ns: tuple[int, int],
        known: Sequence[LiftMotion] | None,
        proven: ProvenLifts | None,
        turns: Mapping[int, Turn] | None = None,
    ) -> None:
        self.window_ns, self.known, self.clearances = window_ns, known, Clearances(plan.site)
        self.proven = ProvenLifts() if proven is None or plan.site.has_several_cranes else proven
        self.triangles = self.proven.turn_to(plan)
        self.plan, self.site, self.motions, self.context = plan, plan.site, motions, context
        units = UNITS | (CRANES_UNITS if plan.site.has_several_cranes else {})
        if plan.site.rules.transit_clearance_m > 0.0 or plan.site.rules.rope_clearance_m > 0.0:
            units |= {MOTION_MARGIN: ""}
        self.checks = {name: Check(name, unit=unit) for name, unit in units.items()}
        self.cells, self.proofs = RawCells(plan.site.shape), dict[int, _Proofs]()
        self.left, self.next_order = moments(plan, context), 0
        self.turns: Mapping[int, Turn] = {}
        self.between: Between | None = None
        if plan.site.has_several_cranes:
            seen = motions if known is None else known
            sound = self._sound_ones(seen)
            self.turns = {order: turn_of(motion) for order, motion in sound.items()} if turns is None else turns
            self.between = Between(plan, self.turns, context)

    def __reduce__(self) -> tuple[Any, ...]:
        """Return how another process begins it anew, to check some of the motions."""
        return _Verifier, (self.plan, (), tuple(self.context), self.window_ns, None, None, self.turns)

    def run(self, workers: Workers) -> Verification:
        if not self.site.cranes:
            self.checks["timeline"].look(not self.motions, "motions on a site that has no crane")
            return Verification(tuple(self.checks.values()))
        self._check_timeline()
        found = self._shared(workers)
        for driven in self._driven():
            checks = self._proven(driven)
            if checks is None:
                checks = found.get(driven.motion.order) or self._checks_of(driven)
                self.proven.add_motion(driven.moment, driven.motion, driven.before, checks)
            for check in checks.values():
                self.checks[check.name].add(check)
        if self.known is None:
            self.check_cranes(workers)
        return Verification(tuple(self.checks.values()))

    def _shared(self, workers: Workers) -> dict[int, Mapping[str, Check]]:
        """Return the checks of the motions that are not proven yet, by order, if there are processes to share them."""
        if workers.count == 1:
            return {}
        timeline, self.checks["timeline"] = self.checks["timeline"], Check("timeline")  # looked at again later
        pairs = [(one.motion, one.before) for one in self._driven() if self._proven(one) is None]
        self.checks["timeline"] = timeline
        with workers.knowing(self):
            found = workers.run(_Verifier.of_motions, [(self, chunk) for chunk in in_chunks(pairs, workers.count)])
        orders = [motion.order for motion, _ in pairs]
        return dict(zip(orders, (checks for chunk in found for checks in chunk), strict=True))

    def of_motions(self, pairs: Sequence[tuple[LiftMotion, LiftMotion | None]]) -> list[Mapping[str, Check]]:
        """Return the checks of motions, each after another one; it goes through the plan once if asked in order."""
        if pairs and pairs[0][0].order < self.next_order:
            self.left = moments(self.plan, self.context)
        waiting = {motion.order: (motion, before) for motion, before in pairs}
        found = []
        for moment in self.left:
            self.next_order = moment.lift.order + 1
            if moment.lift.order in waiting:
                found.append(self._checks_of(_Driven(self._of_its_crane(moment), *waiting.pop(moment.lift.order))))
            if not waiting:
                break
        return found

    def _proven(self, driven: _Driven) -> Mapping[str, Check] | None:
        return self.proven.checks_of_motion(driven.moment, driven.motion, driven.before)

    def _driven(self) -> Iterator[_Driven]:
        """Yield every motion that is fit to be checked, in order; report the others."""
        by_order = {motion.order: motion for motion in self.motions}
        previous: dict[int, LiftMotion] = {}
        for moment in moments(self.plan, self.context):
            motion = by_order.get(moment.lift.order)
            component = self.site.components[moment.lift.component]
            turn_to(self.checks.values(), component.id)
            name = _name(moment, component)
            before = previous.pop(component.crane, None)
            if motion is None or motion.component != moment.lift.component:
                self.checks["timeline"].look(False, f"{name}: it has no motion")
                continue
            if not is_sound(self.checks["timeline"], name, motion):
                continue
            if motion.crane != component.crane:
                self.checks["timeline"].look(False, f"{name}: it is driven by crane {motion.crane}, not its own")
                continue
            moment = self._of_its_crane(moment)
            if before is not None and (moment.before is None or before.order != moment.before.order):
                before = None
            yield _Driven(moment, motion, before)
            previous[component.crane] = motion

    def _of_its_crane(self, moment: Moment) -> Moment:
        """Return a moment with the lift before of the same crane."""
        return moment if self.between is None else replace(moment, before=self.between.before(moment.lift))

    def _checks_of(self, driven: _Driven) -> Mapping[str, Check]:
        """Return the checks of one motion, each by itself."""
        moment, motion, before = driven
        ways = None if self.between is None else tuple(self.between.ways(moment, motion))
        component, whole = self.site.components[moment.lift.component], dict(self.checks)
        name = _name(moment, component)
        crane, load, hook, swing, transit = self._proofs(component.crane)
        # The proofs share this dictionary, so it is filled with checks of this motion alone for a while.
        self.checks.update({n: Check(n, unit=check.unit, about=component.id) for n, check in whole.items()})
        self._check_axes(name, crane, moment, motion)
        tag_lines, timeline = not moment.lift.ever_with_jib, self.checks["timeline"]
        check_durations(timeline, name, self.site.rules, component, motion, tag_lines=tag_lines)
        check_heading(timeline, name, self.site, crane, moment.lift, component, motion)
        check_phase_names(timeline, name, motion)
        check_ends(self.checks["ends"], name, self.site, crane, moment, motion, before)
        self.cells.move_to(moment.present)
        load.check(name, moment, motion)
        transit.check(name, moment, motion)
        hook.check(name, moment, motion, ways)
        swing.check(name, moment, motion, ways)
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

    def _sound_ones(self, motions: Sequence[LiftMotion]) -> dict[int, LiftMotion]:
        """Return the motions with sound trajectories, by order; the others are reported when they are checked."""
        aside = Check("timeline")
        return {motion.order: motion for motion in motions if is_sound(aside, "", motion)}

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
        for lift in planned:
            by_crane.setdefault(self.site.components[lift.component].crane, []).append(lift)
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
        sound = list(self._sound_ones(self.motions).values())
        check_turns(self.checks["turns"], self.site, self.plan, sound, self.context)
        is_whole = not self.context and self.window_ns == ALWAYS_NS
        check_cranes(self.checks["cranes"], self.site, sound, self.window_ns, is_whole=is_whole, workers=workers)

    def _check_axes(self, name: str, crane: TowerCrane, moment: Moment, motion: LiftMotion) -> None:
        component = self.site.components[moment.lift.component]
        # Its own gear replaces the crane's usual rigging, which the checks below add.
        mass_kg = component.mass_kg + rigging_kg(crane, component) - crane.rigging_mass_kg
        check_limits(self.checks["axis_limits"], name, crane, motion, mass_kg)
        check_range(self.checks["axis_range"], name, crane, motion.samples()[1], self.site.frame)
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
            check_spacing(self.checks["spacing"], name, crane, part, self.site.frame.voxel_size_m)
            hung_kg = masses.get(id(part), mass_kg)
            check_capacity(self.checks["capacity"], name, crane, part, hung_kg, self.site.rules.highest_utilisation)
