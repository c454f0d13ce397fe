"""The schedule of several cranes: when each lift starts so that the sequence is kept and the cranes stay apart.

The erection sequence is that of one crane: lift after lift. With several cranes lifts overlap in time, under rules that
keep the assumptions of each lift true at every moment:

* R1: a part is hooked on after all earlier parts of the sequence have left the yard;
* R2: a part is set after all earlier parts of the sequence are set and their slings are off;
* R3: a part of a later delivery is hooked on after all parts of earlier deliveries are set and their slings are off;
* R4: the cranes keep their separation at every moment, also if they brake from there (``bimvox.crane.conflict``);
* R5: a part that rests on work that the crane does not do is hooked on after all earlier parts of the sequence are set
  and their slings are off: until that work carries, the cranes may pause then.

Lifts are scheduled one by one in sequence. Each gets the first time (in steps of some seconds) at which it obeys the
rules against everything scheduled for the other cranes, and against their positions afterwards. A crane that has
finished a lift moves to its next part at once and waits there. If it would obstruct earlier lifts there, it stays where
it is or slews to a parking place. A load never waits in the air.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import product

from bimvox.crane.conflict import Conflict, CraneTrack, first_conflict
from bimvox.crane.outline import outline_of
from bimvox.cranes.clock import Begun, CraneClock, PlacedLeg, ResumedLoad, motions_of, standing_at
from bimvox.cranes.lift import REST_NS, CraneLift, Leg, NoFreeTimeError
from bimvox.cranes.lifts import crane_lifts
from bimvox.cranes.track import approach_track
from bimvox.motion.shift import held_longer
from bimvox.motion.steps import may_pause
from bimvox.motion.time_plan import KnownMotions, time_plan
from bimvox.planning.assembly import Preparation
from bimvox.records.lift import Lift, LiftPlan
from bimvox.records.motion import LiftMotion
from bimvox.units import NS_PER_S
from bimvox.workers import ALONE, Workers

_STEP_NS = 5 * NS_PER_S


def time_lifts(
    plan: LiftPlan, preparation: Preparation, known: KnownMotions | None = None, workers: Workers = ALONE
) -> tuple[LiftMotion, ...]:
    """Return the motion of every planned lift, in order, of a site with one crane or several; as ``time_plan``.

    Raises:
        InputError: If the site has no crane.
        MotionError: If a path is not free or cannot be driven, or a crane always obstructs a lift; names the lift.
    """
    if not plan.site.has_several_cranes:
        return time_plan(plan, preparation, known, workers)
    return _Schedule(plan, crane_lifts(plan, preparation, known, workers=workers)).run()


def time_rest(
    plan: LiftPlan,
    lifts: Sequence[CraneLift],
    begun: Mapping[int, Begun],
    resumed: Sequence[ResumedLoad],
    ready_ns: int,
) -> tuple[LiftMotion, ...]:
    """Return the motion of every planned lift of a plan that is being carried out, in order.

    What has begun continues unchanged, and nothing new starts before ``ready_ns``.

    Args:
        plan: The plan, of a site with several cranes.
        lifts: The cranes' lifts, for every planned lift (``crane_lifts``).
        begun: The work that every crane has begun, by its number.
        resumed: Loads that were stopped under way and have a path to continue on, in order.
        ready_ns: The first moment at which something new may start.

    Raises:
        NoFreeTimeError: If a crane always obstructs a lift; names the lift.
    """
    return _Schedule(plan, lifts, begun, resumed, ready_ns).run()


class _Schedule:
    def __init__(
        self,
        plan: LiftPlan,
        lifts: Sequence[CraneLift],
        begun: Mapping[int, Begun] | None = None,
        resumed: Sequence[ResumedLoad] = (),
        ready_ns: int = 0,
    ) -> None:
        self.plan, self.site, self.lifts = plan, plan.site, lifts
        self.resumed, self.ready_ns = resumed, ready_ns
        self.may_pause = may_pause(plan)
        self.released_ns: dict[int, int] = {}
        self.raised_ns: dict[int, int] = {}
        self.set_ns: dict[int, int] = {}
        self.not_set_before_ns: dict[int, int] = {}
        self.choice = 0
        self.conflict: tuple[int, int, Conflict] | None = None
        self.cranes: list[CraneClock] = []
        for number, crane in enumerate(self.site.cranes):
            own = [one for one in lifts if one.crane == number]
            before = None if begun is None else begun.get(number)
            if own or before is not None:
                start = standing_at(own[0].track.first, 0) if before is None else before.start
                self.cranes.append(CraneClock(number, outline_of(crane), own, start))
                if before is not None:
                    self.cranes[-1].begin(before)
        for one in self.cranes:
            if one.starts and not one.lifts[0].starts_there:
                self._start_parked(one)
        for load in resumed:
            self._of(load.crane).at = "loaded"
        on_the_hook = {load.lift.order for load in resumed}
        for motion in (motion for one in self.cranes for motion in one.motions.values()):
            self.raised_ns[motion.order] = motion.raised_ns
            if motion.order not in on_the_hook:
                self.set_ns[motion.order], self.released_ns[motion.order] = motion.set_ns, motion.released_ns
        self.begun = {order for one in self.cranes for order in one.motions}
        # Later parts are set only after the hooks under way have passed.
        passed_ns = max([leg.end_ns for one in self.cranes for leg in one.legs.get(one.begun, ())], default=0)
        self.not_set_before_ns |= {one.lift.order: passed_ns for one in lifts if passed_ns}

    def run(self) -> tuple[LiftMotion, ...]:
        """Return the motions of all lifts, scheduled."""
        for crane in reversed(self.cranes):
            if crane.starts and self._conflict(crane, crane.start, 0) is not None:
                self._start_parked(crane)
        for crane in self.cranes:
            self.conflict = self._conflict(crane, crane.start, 0) if crane.starts else None
            if self.conflict is not None:
                raise self._never(crane, crane.lifts[0].lift)
        for load in self.resumed:
            crane = self._of(load.crane)
            if not self._tried(crane, partial(self._resume, crane, load)):
                raise self._never(crane, load.lift)
        for one in self.lifts:
            if one.lift.order not in self.begun:
                crane = self._of(one.crane)
                if not self._tried(crane, partial(self._lift, crane, one)):
                    raise self._never(crane, one.lift)
        motions = [motion for crane in self.cranes for motion in motions_of(crane)]
        return tuple(sorted(motions, key=lambda motion: motion.order))

    def _of(self, number: int) -> CraneClock:
        return next(crane for crane in self.cranes if crane.number == number)

    def _lift(self, crane: CraneClock, one: CraneLift) -> bool:
        """Schedule the hook's leg to the part if it is not there, and the carry; return whether it is possible."""
        return self._to_part(crane, one) and self._carry(crane, one)

    def _tried(self, crane: CraneClock, go: Callable[[], bool]) -> bool:
        """Return whether a crane can continue; if so, it also moves to its next part.

        If another crane is in the way, that crane moves back or aside. If this crane's hook, already over the part,
        prevents that, this crane moves back or aside itself and comes later.
        """
        kept = self._kept()
        others = [other for other in self.cranes if other is not crane]
        tries = product(range(3), range(3), range(1 + 2 * len(others)))
        for choice, own, steps in ((choice, own, steps) for choice, own, steps in tries if own or steps or not choice):
            self.choice = choice
            self._restore(kept)
            if sum(self._give_way(crane) for _ in range(own)) == own:
                moved = [other for n, other in enumerate(others * 2) if n < steps and self._give_way(other)]
                if (not steps or moved) and go():
                    following = crane.next
                    if following is not None and following.early is not None:
                        self._go(crane, following.early, "pick")
                    return True
        return False

    def _kept(self) -> list[tuple[CraneClock, CraneClock]]:
        return [(one, one.copy()) for one in self.cranes]

    def _restore(self, kept: list[tuple[CraneClock, CraneClock]]) -> None:
        for one, was in kept:
            copy = was.copy()
            one.tracks, one.ends_ns, one.legs = copy.tracks, copy.ends_ns, copy.legs
            one.start, one.at, one.parking = was.start, was.at, was.parking

    def _to_part(self, crane: CraneClock, one: CraneLift) -> bool:
        if crane.at == "pick":
            return True
        if crane.at == "parked":
            return crane.parking is not None and self._go(crane, crane.parking.back, "pick")
        return any(leg is not None and self._go(crane, leg, "pick") for leg in (one.early, one.late))

    def _set_after_ns(self, order: int) -> int:
        """Return the time before which the part of a lift must not be set."""
        earlier = (released_ns for n, released_ns in self.released_ns.items() if n < order)
        return max([*earlier, self.not_set_before_ns.get(order, 0)])

    def _resume(self, crane: CraneClock, load: ResumedLoad) -> bool:
        """Schedule the rest of the motion of a stopped load; return whether it is possible."""
        order, motion, resumes_ns = load.lift.order, load.motion, load.resumes_ns
        set_after_ns = self._set_after_ns(order)
        first_ns = max(crane.free_ns, self.ready_ns, resumes_ns, set_after_ns - motion.set_ns + resumes_ns)
        start_ns = self._first_free(crane, load.track.later(-resumes_ns), first_ns)
        if start_ns is None:
            return False
        late_ns = start_ns - resumes_ns
        crane.motions[order] = held_longer(motion, resumes_ns, late_ns)
        crane.tracks.append(load.track.later(late_ns))
        crane.ends_ns.append(motion.end_ns + late_ns)
        crane.at = "set"
        self.set_ns[order], self.released_ns[order] = motion.set_ns + late_ns, motion.released_ns + late_ns
        return True

    def _carry(self, crane: CraneClock, one: CraneLift) -> bool:
        """Schedule a lift from hook-on to slings off; return whether it is possible."""
        order, carry = one.lift.order, one.carry
        earlier = [n for n in self.released_ns if n < order]
        assert one.lift.place is not None
        delivery = one.lift.place.delivery
        first_ns = max(
            [crane.free_ns, self.ready_ns, self._set_after_ns(order) - carry.set_ns]
            + [self.raised_ns[n] for n in earlier]
            + [self.released_ns[n] for n in earlier if order in self.may_pause or self._delivery(n) < delivery]
        )
        start_ns = self._first_free(crane, one.track, first_ns)
        if start_ns is None:
            return False
        crane.tracks.append(one.track.later(start_ns))
        crane.ends_ns.append(start_ns + carry.end_ns)
        crane.starts_ns.append(start_ns)
        crane.done += 1
        crane.at = "set"
        self.raised_ns[order], self.set_ns[order] = start_ns + carry.raised_ns, start_ns + carry.set_ns
        self.released_ns[order] = start_ns + carry.end_ns
        return True

    def _go(self, crane: CraneClock, leg: Leg, to: str, *, at_once: bool = False) -> bool:
        """Schedule a leg of the empty hook as early as possible, or at once; return whether it is possible."""
        order = crane.next.lift.order if crane.next is not None else len(self.plan.lifts)
        first_ns = max(crane.free_ns, self.ready_ns)
        if crane.legs.get(crane.done):
            first_ns += REST_NS
        if leg.last:
            first_ns = max([first_ns, *(ns for n, ns in self.released_ns.items() if n < order)])
        passed_ns = min([self.set_ns[n] for n in leg.before if n in self.set_ns], default=None)
        track = approach_track(self.site, self.site.cranes[crane.number], leg.trajectory, 0)
        latest_ns = None if passed_ns is None else passed_ns - int(leg.trajectory.time_ns[-1])
        if at_once:
            latest_ns = first_ns if latest_ns is None else min(first_ns, latest_ns)
        start_ns = self._first_free(crane, track, first_ns, latest_ns)
        if start_ns is None:
            return False
        placed = PlacedLeg(start_ns, leg.trajectory, track.later(start_ns))
        crane.add_leg(placed)
        for n in leg.before:
            self.not_set_before_ns[n] = max(self.not_set_before_ns.get(n, 0), placed.end_ns)
        crane.at = to
        return True

    def _give_way(self, crane: CraneClock) -> bool:
        """Move a crane back from its next part, or to a parking place; return whether it is possible."""
        following = crane.next
        if crane.at == "pick" and following is not None:
            legs = crane.legs.get(crane.done, [])
            if len(legs) <= crane.kept:
                return self._start_parked(crane) if crane.starts else self._turn_aside(crane, following)
            return self._undo(crane, legs)
        if crane.at == "set":
            if following is None:
                leaves = crane.lifts[-1].leaves
                return any(self._go(crane, leg, "parked") for leg in (*leaves[self.choice :], *leaves[: self.choice]))
            return self._turn_aside(crane, following)
        return False

    def _turn_aside(self, crane: CraneClock, following: CraneLift, *, at_once: bool = False) -> bool:
        for parking in (*following.parkings[self.choice :], *following.parkings[: self.choice]):
            if parking.aside is not None and self._go(crane, parking.aside, "parked", at_once=at_once):
                crane.parking = parking
                return True
        return False

    def _undo(self, crane: CraneClock, legs: list[PlacedLeg]) -> bool:
        """Undo the leg to the next part; return whether it is possible.

        If there is a conflict at the place that the crane came from, it moves aside from there at once.
        """
        leg = legs.pop()
        crane.tracks.pop()
        end_ns = crane.ends_ns.pop()
        waiting = crane.known(leg.start_ns)
        crane.at = "parked" if len(legs) > crane.kept or crane.starts else "set"
        if self._conflict(crane, waiting, leg.start_ns) is None:
            return True
        following = crane.next
        if crane.at == "set" and following is not None and self._turn_aside(crane, following, at_once=True):
            return True
        legs.append(leg)
        crane.tracks.append(leg.track)
        crane.ends_ns.append(end_ns)
        crane.at = "pick"
        return False

    def _start_parked(self, crane: CraneClock) -> bool:
        """Start at a parking place instead of over the first part; return whether it is possible."""
        if crane.at != "pick" or crane.tracks or not crane.starts:
            return False
        for parking in crane.lifts[0].parkings:
            machine = self.site.cranes[crane.number]
            parked = standing_at(approach_track(self.site, machine, parking.back.trajectory, 0).first, 0)
            if self._conflict(crane, parked, 0) is None:
                crane.start, crane.at, crane.parking = parked, "parked", parking
                return True
        return False

    def _first_free(
        self, crane: CraneClock, track: CraneTrack, first_ns: int, latest_ns: int | None = None
    ) -> int | None:
        """Return the first start at which a track, and the position at its end, have no conflict; None if none has."""
        others_end_ns = max((other.free_ns for other in self.cranes if other is not crane), default=0)
        start_ns = first_ns
        while latest_ns is None or start_ns <= latest_ns:
            found = self._conflict(crane, track.later(start_ns), start_ns)
            if found is None:
                return start_ns
            self.conflict = found
            if start_ns > others_end_ns:
                return None
            start_ns += _STEP_NS
        return None

    def _conflict(self, crane: CraneClock, track: CraneTrack, from_ns: int) -> tuple[int, int, Conflict] | None:
        for other in self.cranes:
            if other is crane:
                continue
            found = first_conflict(
                (crane.outline, other.outline),
                track,
                other.known(from_ns),
                self.site.rules.crane_separation_m,
                from_ns=from_ns,
            )
            if found is not None:
                return crane.number, other.number, found
        return None

    def _delivery(self, order: int) -> int:
        place = next(one.lift.place for one in self.lifts if one.lift.order == order)
        assert place is not None
        return place.delivery

    def _never(self, crane: CraneClock, lift: Lift) -> NoFreeTimeError:
        component = self.site.components[lift.component]
        reason, cranes = "", self.site.cranes
        if self.conflict is not None:
            own, other, found = self.conflict
            reason = (
                f": the {found.parts[0]} of {cranes[own].name} would come within {found.distance_m:.1f} m of the "
                f"{found.parts[1]} of {cranes[other].name}, {found.needed_m:g} m are needed"
            )
        return NoFreeTimeError(
            component.id,
            f"{cranes[crane.number].name} has no free time slot for it alongside the other cranes{reason}",
            hint="put the cranes further apart or at other heights, or give it to another one ([[component]] crane)",
        )
