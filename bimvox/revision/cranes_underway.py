"""A plan of several cranes revised while it is carried out.

What was done stays as it was driven. Where the change meets nothing of what the cranes are doing, lifts that are hooked
on and hooks that are on their way go on as they are, and all that is to come is put on the clock anew around them.
Where it meets something, all cranes stop, as anti-collision systems do (that they may, at any moment, is what their
distance is planned and proven for), and wait; then every load goes on along a new way when the others leave it room.
Where one finds no way on, all of them are held, and all that is left waits for the next change.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from bimvox.cranes.clock import Begun, GoingOn, Placed
from bimvox.cranes.lift import HookError
from bimvox.cranes.lifts import standing_track
from bimvox.cranes.lifts_from import crane_lifts_from
from bimvox.cranes.schedule import time_rest
from bimvox.cranes.track import approach_track, carrying_track
from bimvox.errors import MotionError
from bimvox.motion.timing import NS_PER_S
from bimvox.planning.assembly import Assembly, Stage
from bimvox.planning.planner import plan_lifts
from bimvox.planning.rounds import Refused, proven_in_rounds, refusals
from bimvox.proof.over_time import verify_motions_over_time, verify_plan_over_time
from bimvox.records.lift import Lift, LiftPlan, Status
from bimvox.records.motion import LiftMotion
from bimvox.records.proof import Verification
from bimvox.revision.cranes import part_of
from bimvox.revision.cranes_now import CraneNow, cranes_at, is_met, motion_is_met
from bimvox.revision.held_cranes import HeldCranes
from bimvox.revision.made import Wanted, history_after
from bimvox.revision.obstruction_change import ObstructionChange
from bimvox.revision.standing import RevisedPart, Standing
from bimvox.revision.stop_cranes import Loads, all_stopped
from bimvox.site.collision import CollisionSpace
from bimvox.stop.interrupt import cut_short
from bimvox.stop.underway import Held, Redirected, is_set

_MET = "the empty hook met something while it was stopped, or as far out as it swings: look at it before it is moved"


def revised_now(
    standing: Standing,
    wanted: Wanted,
    change: ObstructionChange,
    known_shapes: set[int],
    on_verdict: Callable[[], None] | None,
) -> RevisedPart:
    """Return a plan revised while it is carried out, proven.

    Args:
        standing: The plan that stands.
        wanted: The site as it is now, and what the revision is made with; it says when.
        change: What changed.
        known_shapes: See ``verify_plan``; added to.
        on_verdict: Called when it is known which lifts can be planned.

    Raises:
        VerificationError: If a proof fails of which no lift is at fault.
    """
    return proven_in_rounds(
        lambda refused: _Revision(standing, wanted, change, refused, known_shapes, on_verdict).run(), "changed"
    )


class _Revision:
    def __init__(
        self,
        standing: Standing,
        wanted: Wanted,
        change: ObstructionChange,
        refused: Refused,
        known_shapes: set[int],
        on_verdict: Callable[[], None] | None,
    ) -> None:
        assert wanted.now_ns is not None
        self.standing, self.wanted, self.change, self.refused = standing, wanted, change, refused
        self.known_shapes, self.on_verdict = known_shapes, on_verdict
        self.site, self.now_ns = wanted.site, wanted.now_ns
        self.ready_ns = wanted.now_ns + round(wanted.hold_s * NS_PER_S)
        self.cranes = {crane.number: crane for crane in cranes_at(self.site, standing, self.now_ns)}
        held = () if standing.held_cranes is None else standing.held_cranes.loads
        self.held = {one.lift.order: one for one in held}
        done = {order: motion for crane in self.cranes.values() for order, motion in crane.motions.items()}
        self.under_way = {order: motion for order, motion in done.items() if not is_set(motion, self.now_ns)}
        self.done = done.keys() - self.under_way.keys()
        self.last = max([*done, *self.held], default=-1)
        self.stops: tuple[Redirected | Held, ...] = ()
        # As they were when they were hooked on: what is held is called infeasible meanwhile.
        self.lifts = [self.held[lift.order].lift if lift.order in self.held else lift for lift in standing.plan.lifts]

    def run(self) -> RevisedPart | Refused:
        at_fault = self._refused(self.done)
        if at_fault:
            return self._of_what_is_left(at_fault[0])
        loads = self.under_way.keys() | self.held.keys()
        if self.standing.held_cranes is not None or self._refused(loads) or self._is_met():
            self._stop()
            if self._unsafe or any(isinstance(one, Held) for one in self.stops):
                return self._all_held(_MET if self._unsafe else None)
        plan = self._plan()
        if self.on_verdict is not None:
            self.on_verdict()
        motions = self._as_they_were(plan)
        if motions is None:
            if not self.stops and self.standing.held_cranes is None:
                self._look_ahead(plan)
            try:
                motions = self._timed(plan)
            except MotionError as error:
                return self._undriven(plan, error)
        for proof in (
            verify_plan_over_time(plan, motions, known_shapes=self.known_shapes),
            verify_motions_over_time(plan, motions),
        ):
            if not proof.verified:
                return self._unproven(plan, proof)
        self.known_shapes.update(lift.component for lift in plan.lifts if lift.path_vox is not None)
        part = part_of(self.standing, plan, motions, self.change)
        return replace(part, made=tuple(lift.order for lift in plan.lifts), stops=self.stops)

    @property
    def _unsafe(self) -> list[CraneNow]:
        """The cranes whose empty hook met something where it was stopped: such a way cannot be proven any more."""
        return [crane for crane in self.cranes.values() if not crane.is_safe]

    def _is_of(self, lift: Lift, crane: CraneNow) -> bool:
        """Whether a planned lift, or one that was held for this, is a crane's."""
        mine = self.site.components[lift.component].crane == crane.number
        return mine and (lift.status is Status.PLANNED or lift.reason == _MET)

    def _refused(self, orders: set[int]) -> list[str]:
        """Why lifts are refused."""
        names = self.site.components
        reasons = (self.refused.get(names[lift.component].id) for lift in self.lifts if lift.order in orders)
        return [reason for reason in reasons if reason is not None]

    def _of_what_is_left(self, reason: str) -> RevisedPart | Refused:
        """Something came to where a hook is that was done with its part: what is left waits, or cannot be planned."""
        left = [self.site.components[lift.component].id for lift in self.lifts if lift.order > self.last]
        if self.under_way or self.held or not set(left) - self.refused.keys():
            self._stop()
            return self._all_held(reason)
        return dict.fromkeys(left, f"a hook cannot leave where its last part was set: {reason}")

    def _is_met(self) -> bool:
        cranes = self.cranes.values()
        return any(is_met(self.site, self.standing, crane, self.change.added, self.now_ns) for crane in cranes)

    def _stop(self) -> None:
        """Stop all cranes, and look for ways on for their loads."""
        stopped = all_stopped(
            self.wanted,
            [lift for lift in self.lifts if lift.order <= self.last],
            next((lift for lift in self.lifts if lift.order > self.last and lift.place is not None), None),
            tuple(self.cranes.values()),
            Loads(self.under_way, self.held, self.change.added, self.refused),
        )
        self.cranes = {crane.number: crane for crane in stopped.cranes}
        self.stops = stopped.loads

    def _plan(self) -> LiftPlan:
        """All lifts: what is hooked on, done or passed over as it is, the others for the site as it is now."""
        wanted, better, previous = self.wanted, self.wanted.better, self.standing.plan
        on = {one.lift.order: one.lift for one in self.stops}
        kept = {lift.component: on.get(lift.order, lift) for lift in self.lifts if lift.order <= self.last}
        if better is not None:
            others = tuple(lift for lift in previous.lifts if lift.component not in better.components)
            previous = replace(previous, lifts=others)
        plan = plan_lifts(
            self.site,
            wanted.preparation,
            propose=wanted.propose,
            retrained=None if better is None else better.propose,
            previous=previous,
            refused=self.refused,
            kept=kept,
        )
        return replace(plan, history=history_after(self.standing, wanted, self.change))

    def _as_they_were(self, plan: LiftPlan) -> tuple[LiftMotion, ...] | None:
        """The motions that stand, where the change meets nothing; None where it does."""
        standing, added = self.standing, self.change.added
        if self.stops or self.refused or standing.pending or standing.held_cranes is not None:
            return None
        if any(
            now is not was and _is_planned(now, was) for now, was in zip(plan.lifts, standing.plan.lifts, strict=True)
        ):
            return None
        to_come = [motion for order, motion in standing.motions.items() if order > self.last]
        if any(motion_is_met(self.site, standing, motion, added) for motion in to_come):
            return None
        return standing.chain

    def _look_ahead(self, plan: LiftPlan) -> None:
        """Keep what begins before anything new may, too, up to the first lift that the change touches."""
        standing, added, until_ns = self.standing, self.change.added, self.ready_ns
        for lift, was in zip(plan.lifts, standing.plan.lifts, strict=True):
            motion = standing.motions.get(lift.order)
            met = motion is not None and motion_is_met(self.site, standing, motion, added)
            if lift.order <= self.last or not (met or (lift is not was and _is_planned(lift, was))):
                continue
            if motion is not None:
                until_ns = min(until_ns, motion.start_ns)
            later = (one.hooked_ns for order, one in standing.motions.items() if order > lift.order)
            until_ns = min([until_ns, *later])
            break
        if until_ns > self.now_ns:
            self.cranes = {crane.number: crane for crane in cranes_at(self.site, standing, until_ns)}
            self.last = max([self.last, *(order for crane in self.cranes.values() for order in crane.motions)])

    def _timed(self, plan: LiftPlan) -> tuple[LiftMotion, ...]:
        """Put what is to come on the clock."""
        going_on = []
        for one in self.stops:
            assert isinstance(one, Redirected)
            order, motion = one.lift.order, one.motion
            number, whole = motion.crane, self.held[order].motion if order in self.held else self.under_way[order]
            crane = self.cranes[number]
            driven = {**crane.motions, order: cut_short(whole, one.stop)}
            self.cranes[number] = replace(crane, motions=driven)
            resumes_ns = motion.start_ns + int(motion.loaded.time_ns[0]) if one.stop is None else motion.stops_ns[-1][1]
            track = carrying_track(self.site, self.site.cranes[number], one.lift, motion, resumes_ns)
            going_on.append(GoingOn(one.lift, number, motion, resumes_ns, track))
        stands = {number: crane.goes_on_from for number, crane in self.cranes.items()}
        made = crane_lifts_from(plan, self._stages(plan), stands)
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
        return time_rest(plan, made, begun, going_on, self.ready_ns)

    def _placed(self, crane: CraneNow) -> tuple[Placed, ...]:
        site, machine = self.site, self.site.cranes[crane.number]
        return tuple(
            Placed(one.start_ns, one.way, approach_track(site, machine, one.way, one.start_ns), one.stopped_ns)
            for one in crane.ways
        )

    def _stages(self, plan: LiftPlan) -> Iterator[tuple[Lift, CollisionSpace]]:
        """Every planned lift with the rule of its stage; as ``replay``, but for what is hooked on already."""
        assembly = Assembly(self.site, self.wanted.preparation)
        for lift in plan.lifts:
            planned = lift.status is Status.PLANNED
            if lift.order <= self.last:
                assembly.skip(lift.component)
                if planned:
                    yield lift, assembly.space(lift.component)
            else:
                stage = assembly.begin(lift.component)
                if planned:
                    assert isinstance(stage, Stage)
                    yield lift, stage.clearance_with_insertion
            assembly.finish(lift.component, placed=planned)

    def _undriven(self, plan: LiftPlan, error: MotionError) -> Refused:
        """What to refuse where a lift cannot be driven: with its hook stuck, all that its crane has left."""
        names, reason = self.site.components, f"the crane cannot drive its path: {error.message}"
        left = [lift for lift in plan.lifts if lift.order > self.last and lift.status is Status.PLANNED]
        own = next((lift for lift in left if names[lift.component].id == error.component), None)
        if own is not None and isinstance(error, HookError):
            crane = names[own.component].crane
            mine = [lift for lift in left if names[lift.component].crane == crane]
            if mine[0] is own:
                return {names[lift.component].id: reason for lift in mine}
        return {error.component: reason}

    def _unproven(self, plan: LiftPlan, proof: Verification) -> Refused:
        """What to refuse; where a hook met something on a way that it has begun, all that its crane has left."""
        refused, names = refusals(proof), self.site.components
        hooks = next((check.culprits for check in proof.checks if check.name == "empty_hook"), set())
        to_come = [lift for lift in plan.lifts if lift.order > self.last and lift.status is Status.PLANNED]
        for number, crane in self.cranes.items():
            mine = [names[lift.component].id for lift in to_come if names[lift.component].crane == number]
            if crane.ways and mine and mine[0] in hooks:
                refused |= dict.fromkeys(mine, refused[mine[0]])
        return refused

    def _all_held(self, reason: str | None = None) -> RevisedPart:
        """All cranes stand, and all that is left waits."""
        names = self.site.components
        without = [names[one.lift.component].id for one in self.stops if isinstance(one, Held)]
        waits = reason or f"it waits for {', '.join(without)}"
        lifts = {lift.order: lift for lift in self.lifts}
        loads = []
        for one in self.stops:
            if isinstance(one, Held):
                loads.append(one)
                continue
            order = one.lift.order
            before = self.held.get(order)
            motion = self.under_way[order] if before is None else before.motion
            loads.append(Held(lifts[order], motion, one.stop, one.how, True, waits))
        held = {one.lift.order: one for one in loads}
        now = [held[lift.order].infeasible if lift.order in held else lift for lift in self.lifts]
        for crane in self._unsafe:
            first = next((lift for lift in now if lift.order > self.last and self._is_of(lift, crane)), None)
            if first is not None:
                held_for_good = Lift(first.component, first.order, first.place, Status.INFEASIBLE, reason=_MET)
                now[now.index(first)] = held_for_good
        plan = replace(
            self.standing.plan,
            site=self.site,
            lifts=tuple(now),
            history=history_after(self.standing, self.wanted, self.change),
        )
        done = [m for crane in self.cranes.values() for m in crane.motions.values() if m.order not in held]
        if self.on_verdict is not None:
            self.on_verdict()
        part = part_of(self.standing, plan, tuple(sorted(done, key=lambda motion: motion.order)), self.change)
        hooks = tuple(crane.hook for crane in self.cranes.values())
        stands = replace(part.standing, held_cranes=HeldCranes(tuple(loads), hooks))
        made = tuple(lift.order for lift in plan.lifts if lift.order not in stands.pending)
        return replace(part, standing=stands, made=made, stops=tuple(loads))


def _is_planned(now: Lift, was: Lift) -> bool:
    """Whether a lift is, or was, one that is carried out."""
    return Status.PLANNED in (now.status, was.status)
