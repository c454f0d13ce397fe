"""A revision with several cranes, before and while their plan is carried out.

The start of a lift depends on what the other cranes do, so one new path may shift all later lifts of every crane. Lifts
before the first change keep their times if nothing later affects them.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Set
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bimvox.cranes.clock import Begun, PlacedLeg, ResumedLoad
from bimvox.cranes.lift import HookError, approach_track, carrying_track, standing_track
from bimvox.cranes.lifts import crane_lifts
from bimvox.cranes.schedule import time_lifts, time_rest
from bimvox.errors import MotionError
from bimvox.planning.rounds import Refused
from bimvox.proof.footprint import CellMask, hook_footprint, jib_meets
from bimvox.records.lift import HOOK_MET, NOT_DRIVEN, Lift, LiftPlan, Status
from bimvox.records.motion import LiftMotion
from bimvox.revision.current_plan import CurrentPlan, HeldCranes, ObstructionChange, RevisionRequest
from bimvox.revision.draft import Proof, RevisionDraft
from bimvox.revision.stop_cranes import CraneNow, Loads, WhoStops, all_stopped, cranes_at, is_met
from bimvox.site.site import Site
from bimvox.stop.redirect import Held, Redirected, is_set
from bimvox.stop.resume import cut_short
from bimvox.units import NS_PER_S

if TYPE_CHECKING:
    from bimvox.revision.keep_or_replan import Replanning


_LOST = 1e-9
"""Radians and metres."""


class SeveralCranes:
    """The ``CraneWork`` of a site with several cranes whose plan is not being carried out.

    Args:
        current: The current plan.
        request: What to revise it for.
        change: What changed.
    """

    def __init__(self, current: CurrentPlan, request: RevisionRequest, change: ObstructionChange) -> None:
        self._was, self._request, self._change = current, request, change

    def begun(self, replanning: Replanning, was: Lift) -> Lift | None:
        """Return None: no lift has begun."""

    def choose_motion(self, replanning: Replanning, lift: Lift, was: Lift) -> None:
        """Do nothing: all motions are made together."""

    def timed(self, draft: RevisionDraft) -> RevisionDraft | Refused:
        """Return the draft with all motions on the clock; or which lift cannot be driven, and why."""
        plan = draft.plan(self._was, self._request, self._change)
        try:
            motions = time_lifts(plan, self._request.preparation, workers=self._request.workers)
        except MotionError as error:
            return {part: f"{NOT_DRIVEN}{why}" for part, why in error.reasons.items()}
        return _with_motions(self._was, draft, motions)

    def refused(self, proof: Proof) -> Refused:
        """Return the lifts that failed."""
        return proof.refused


def _with_motions(was: CurrentPlan, draft: RevisionDraft, motions: Iterable[LiftMotion]) -> RevisionDraft:
    """Return a draft with the motions of several cranes, all of them to be proven; equal ones are kept."""
    kept = {new.order: new for new in motions}
    kept |= {order: was.motions[order] for order, new in kept.items() if _same(was.motions.get(order), new)}
    new_motions = {order for order, motion in kept.items() if was.motions.get(order) is not motion}
    return replace(draft, motions=kept, new_motions=new_motions, unproven_motions=set(kept))


def _same(one: LiftMotion | None, other: LiftMotion) -> bool:
    """Return whether two motions are equal up to the rounding of a log."""
    if one is None or (one.component, one.start_ns, one.phases) != (other.component, other.start_ns, other.phases):
        return False
    (time_ns, axes), (other_ns, other_axes) = one.samples(), other.samples()
    return np.array_equal(time_ns, other_ns) and np.allclose(axes, other_axes, rtol=0.0, atol=_LOST)


# A revision with several cranes while their plan is carried out.
#
# What was done stays as driven. If the change meets nothing that the cranes are doing, loads on hooks and hooks under
# way continue unchanged, and all later lifts are scheduled around them. If it meets something, that crane stops, and
# those that cannot go on without it (``who_stops``): the separation is planned and proven for a stop at any moment.
# After the hold, each load continues along a new path as soon as the other cranes leave room. If one load has no free
# path, all that are stopped are held until the next change.


class CranesUnderWay:
    """The ``CraneWork`` of a site with several cranes whose plan is being carried out.

    Args:
        current: The current plan.
        request: What to revise it for; it has the time.
        change: What changed about the obstructions.
        refused: Components whose lifts failed their proof, and why.
    """

    def __init__(
        self, current: CurrentPlan, request: RevisionRequest, change: ObstructionChange, refused: Refused
    ) -> None:
        assert request.now_ns is not None
        self.current, self.request, self.change, self.refusals = current, request, change, refused
        self.site, self.now_ns = request.site, request.now_ns
        self.ready_ns = request.now_ns + round(request.hold_s * NS_PER_S)
        self.cranes = {crane.number: crane for crane in cranes_at(self.site, current, self.now_ns)}
        self.held = {one.lift.order: one for one in current.held_loads}
        done = {order: motion for crane in self.cranes.values() for order, motion in crane.motions.items()}
        self.under_way = {order: motion for order, motion in done.items() if not is_set(motion, self.now_ns)}
        self.done = done.keys() - self.under_way.keys()
        self.last = max([*done, *self.held], default=-1)
        self.stops: tuple[Redirected | Held, ...] = ()
        # As they were when hooked on: the plan calls a held lift infeasible.
        self.lifts = [self.held[lift.order].lift if lift.order in self.held else lift for lift in current.plan.lifts]
        self._planned: list[Lift] = []
        self.waits_for = self._stop_if_met()
        self.begun_lifts = self._begun_lifts()

    def begun(self, replanning: Replanning, was: Lift) -> Lift | None:
        """Return a lift that is done, skipped, or on a hook; every lift while the cranes are held."""
        if was.order in self.begun_lifts and any(one.lift.order == was.order for one in self.stops):
            replanning.draft.new_paths.add(was.order)
        return self.begun_lifts.get(was.order)

    def choose_motion(self, replanning: Replanning, lift: Lift, was: Lift) -> None:
        """Do nothing: all motions are made together."""

    def timed(self, draft: RevisionDraft) -> RevisionDraft | Refused:
        """Return the draft, with all later lifts scheduled around what the cranes are doing."""
        if self.waits_for is not None:
            return self._all_held(draft)
        plan = draft.plan(self.current, self.request, self.change)
        self._planned = [lift for lift in plan.lifts if lift.status is Status.PLANNED]
        everything = frozenset(lift.order for lift in plan.lifts)
        if self._is_as_it_was(plan):
            moved = {order: versions[0] for order, versions in self.current.versions.items()}
            return replace(draft, motions=dict(self.current.motions), moved=moved, written=everything)
        if not self.stops and self.current.held is None:
            self._look_ahead(plan)
        try:
            motions = self._timed(plan)
        except MotionError as error:
            return self._undriven(error)
        return replace(_with_motions(self.current, draft, motions), written=everything, stops=self.stops)

    def refused(self, proof: Proof) -> Refused:
        """Return the lifts that failed; if a hook under way meets something, all remaining lifts of its crane."""
        refused, names = dict(proof.refused), self.site.components
        for number, crane in self.cranes.items():
            mine = [names[lift.component].id for lift in self._to_come if names[lift.component].crane == number]
            if crane.ways and mine and mine[0] in proof.stuck:
                refused |= dict.fromkeys(mine, refused[mine[0]])
        return refused

    def _stop_if_met(self) -> str | None:
        """Stop cranes if the change meets what they are doing; return why they are held, None if they are not."""
        at_fault = self._reasons(self.done)
        loads = self.under_way.keys() | self.held.keys()
        met = self._met()
        if not at_fault and self.current.held is None and not self._reasons(loads) and not met:
            return None
        # If the proof refused something, or nothing is met but what is held, nobody goes on.
        self._stop(met if met and not self.refusals else self.cranes.keys())
        names = self.site.components
        without = [names[one.lift.component].id for one in self.stops if isinstance(one, Held)]
        if at_fault:
            return at_fault[0]  # something is where a hook has just set its part
        if self._unsafe:
            return HOOK_MET
        return f"it waits for {', '.join(without)}" if without else None

    @property
    def _to_come(self) -> list[Lift]:
        """The planned lifts that are still to be put on the clock."""
        return [lift for lift in self._planned if lift.order > self.last]

    @property
    def _unsafe(self) -> list[CraneNow]:
        """The cranes whose empty hook met something when it stopped: such a move cannot be proven."""
        return [crane for crane in self.cranes.values() if not crane.is_safe]

    def _is_of(self, lift: Lift, crane: CraneNow) -> bool:
        """Return whether a lift belongs to a crane, and is planned or held because the crane's hook met something."""
        mine = self.site.components[lift.component].crane == crane.number
        return mine and (lift.status is Status.PLANNED or lift.reason == HOOK_MET)

    def _reasons(self, orders: Set[int]) -> list[str]:
        """Return the reasons why any of these lifts are refused."""
        names = self.site.components
        reasons = (self.refusals.get(names[lift.component].id) for lift in self.lifts if lift.order in orders)
        return [reason for reason in reasons if reason is not None]

    def _met(self) -> set[int]:
        """Return the cranes that the change meets, and those whose loads are held."""
        holding = {self.site.components[one.lift.component].crane for one in self.held.values()}
        met = {
            number
            for number, crane in self.cranes.items()
            if not crane.is_safe or is_met(self.site, self.current, crane, self.change.added, self.now_ns)
        }
        return met | holding

    def _stop(self, numbers: Collection[int]) -> None:
        """Stop cranes, and those that must stop with them, and search a path for each load to continue on."""
        begun = [lift for lift in self.lifts if lift.order <= self.last]
        following = next((lift for lift in self.lifts if lift.order > self.last and lift.place is not None), None)
        loads = Loads(self.under_way, self.held, self.change.added, self.refusals)
        who = WhoStops(self.site, self.cranes, {lift.order: lift for lift in begun}, loads, self.now_ns)
        stopped = who.with_those(
            numbers, lambda cranes, own: all_stopped(self.request, begun, following, tuple(cranes), own)
        )
        self.cranes = self.cranes | {crane.number: crane for crane in stopped.cranes}
        self.stops = stopped.loads

    def _begun_lifts(self) -> dict[int, Lift]:
        """Return the lifts that are not replanned, by order: those begun; all while the cranes are held."""
        on = {one.lift.order: one.lift for one in self.stops}
        if self.waits_for is None:
            return {lift.order: on.get(lift.order, lift) for lift in self.lifts if lift.order <= self.last}
        loads = {one.lift.order: one for one in self._held_loads(self.waits_for)}
        now = {lift.order: loads[lift.order].infeasible if lift.order in loads else lift for lift in self.lifts}
        for crane in self._unsafe:
            first = next((lift for lift in now.values() if lift.order > self.last and self._is_of(lift, crane)), None)
            if first is not None:
                now[first.order] = Lift(first.component, first.order, first.place, Status.INFEASIBLE, reason=HOOK_MET)
        return now

    def _held_loads(self, waits_for: str) -> tuple[Held, ...]:
        """Return the loads on the hooks, all held: a load that has a path waits for those without one."""
        loads, lifts = [], {lift.order: lift for lift in self.lifts}
        for one in self.stops:
            if isinstance(one, Held):
                loads.append(one)
                continue
            order = one.lift.order
            motion = self.held[order].motion if order in self.held else self.under_way[order]
            loads.append(Held(lifts[order], motion, one.stop, one.how, True, waits_for))
        return tuple(loads)

    def _all_held(self, draft: RevisionDraft) -> RevisionDraft:
        """Return the draft with the stopped cranes held; all later lifts are pending."""
        assert self.waits_for is not None
        hooks = tuple(crane.hook for crane in self.cranes.values())
        held = HeldCranes(self._held_loads(self.waits_for), hooks)
        done = [m for crane in self.cranes.values() for m in crane.motions.values() if m.order not in held.orders]
        draft = _with_motions(self.current, draft, sorted(done, key=lambda motion: motion.order))
        planned = {lift.order for lift in draft.lifts if lift.status is Status.PLANNED}
        pending = planned - draft.motions.keys()
        return replace(
            draft,
            unproven_motions=set(),
            # They are examined at the next change, not now.
            new_paths=pending,
            pending=pending,
            written=frozenset(lift.order for lift in draft.lifts) - pending,
            held=held,
            stops=held.loads,
        )

    def _is_as_it_was(self, plan: LiftPlan) -> bool:
        """Return whether the change meets nothing, so that all motions are kept."""
        current, added = self.current, self.change.added
        if self.stops or self.refusals or current.pending or current.held is not None:
            return False
        if any(
            now is not was and _is_planned(now, was) for now, was in zip(plan.lifts, current.plan.lifts, strict=True)
        ):
            return False
        to_come = [motion for order, motion in current.motions.items() if order > self.last]
        return not any(_motion_is_met(self.site, current, motion, added) for motion in to_come)

    def _look_ahead(self, plan: LiftPlan) -> None:
        """Keep what starts before the hold ends, up to the first lift that the change affects."""
        current, added, until_ns = self.current, self.change.added, self.ready_ns
        for lift, was in zip(plan.lifts, current.plan.lifts, strict=True):
            motion = current.motions.get(lift.order)
            met = motion is not None and _motion_is_met(self.site, current, motion, added)
            if lift.order <= self.last or not (met or (lift is not was and _is_planned(lift, was))):
                continue
            if motion is not None:
                until_ns = min(until_ns, motion.start_ns)
            later = (one.hooked_ns for order, one in current.motions.items() if order > lift.order)
            until_ns = min([until_ns, *later])
            break
        if until_ns > self.now_ns:
            self.cranes = {crane.number: crane for crane in cranes_at(self.site, current, until_ns)}
            self.last = max([self.last, *(order for crane in self.cranes.values() for order in crane.motions)])

    def _timed(self, plan: LiftPlan) -> tuple[LiftMotion, ...]:
        """Return all motions, with those that have not begun scheduled."""
        resumed = []
        for one in self.stops:
            assert isinstance(one, Redirected)
            order, motion = one.lift.order, one.motion
            number, whole = motion.crane, self.held[order].motion if order in self.held else self.under_way[order]
            crane = self.cranes[number]
            driven = {**crane.motions, order: cut_short(whole, one.stop)}
            self.cranes[number] = replace(crane, motions=driven)
            resumes_ns = motion.start_ns + int(motion.loaded.time_ns[0]) if one.stop is None else motion.stops_ns[-1][1]
            track = carrying_track(self.site, self.site.cranes[number], one.lift, motion, resumes_ns)
            resumed.append(ResumedLoad(one.lift, number, motion, resumes_ns, track))
        starts = {number: crane.resumes_from for number, crane in self.cranes.items()}
        made = crane_lifts(plan, self.request.preparation, starts=starts, workers=self.request.workers)
        tracks = {one.lift.order: one.track for one in made}
        begun = {
            number: Begun(
                crane.motions,
                tuple(tracks[order] for order in sorted(crane.motions)),
                self._placed(crane),
                standing_track(self.site, self.site.cranes[number], np.array(crane.stands)),
            )
            for number, crane in self.cranes.items()
        }
        return time_rest(plan, made, begun, resumed, self.ready_ns)

    def _placed(self, crane: CraneNow) -> tuple[PlacedLeg, ...]:
        site, machine = self.site, self.site.cranes[crane.number]
        return tuple(
            PlacedLeg(one.start_ns, one.way, approach_track(site, machine, one.way, one.start_ns), one.stopped_ns)
            for one in crane.ways
        )

    def _undriven(self, error: MotionError) -> Refused:
        """Return what to refuse if a lift cannot be driven: if its hook is stuck, all remaining lifts of its crane."""
        names = self.site.components
        reasons = {part: f"{NOT_DRIVEN}{why}" for part, why in error.reasons.items()}
        left = self._to_come
        own = next((lift for lift in left if names[lift.component].id == error.component), None)
        if own is not None and isinstance(error, HookError):
            crane = names[own.component].crane
            mine = [lift for lift in left if names[lift.component].crane == crane]
            if mine[0] is own:
                return {names[lift.component].id: reasons[error.component] for lift in mine}
        return reasons


def _is_planned(now: Lift, was: Lift) -> bool:
    """Return whether a lift is or was planned."""
    return Status.PLANNED in (now.status, was.status)


def _motion_is_met(site: Site, current: CurrentPlan, motion: LiftMotion, added: NDArray[np.int32]) -> bool:
    """Return whether new obstructed cells meet a motion that has not begun.

    ``added``: (N, 3) the cells.
    """
    if not len(added):
        return False
    mask = CellMask(site.shape)
    mask.add(added)
    if mask.meets(current.swept_by(motion.order)) or jib_meets(site, motion, added):
        return True
    leaves = motion.departure
    return leaves is not None and mask.meets(hook_footprint(site, motion, leaves, motion.start_ns))
