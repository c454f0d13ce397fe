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
it is or slews to a parking place, in the way with which the next lifts end first. A load never waits in the air.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from typing import NamedTuple

from bimvox.crane.conflict import Conflict, CraneTrack, first_conflict, first_start
from bimvox.crane.outline import outline_of
from bimvox.cranes.clock import Begun, CraneClock, PlacedLeg, ResumedLoad, motions_of, standing_at
from bimvox.cranes.lift import REST_NS, CraneLift, Leg, NoFreeTimeError
from bimvox.cranes.lifts import crane_lifts
from bimvox.cranes.parking import KEPT_PARKINGS
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
_NEVER_NS = 2**62
_AHEAD = 3
"""How many more lifts are looked at if a crane can give way to another one in several ways."""

_Turn = CraneLift | ResumedLoad


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


class _Way(NamedTuple):
    """A way to continue with a lift: the schedules of all cranes, and the times of the lift."""

    cranes: list[CraneClock]
    raised_ns: int
    set_ns: int
    released_ns: int


class _Schedule:
    def __init__(
        self,
        plan: LiftPlan,
        lifts: Sequence[CraneLift],
        begun: Mapping[int, Begun] | None = None,
        resumed: Sequence[ResumedLoad] = (),
        ready_ns: int = 0,
    ) -> None:
        self.plan, self.site, self.lifts, self.ready_ns = plan, plan.site, lifts, ready_ns
        self.may_pause = may_pause(plan)
        self.released_ns: dict[int, int] = {}
        self.raised_ns: dict[int, int] = {}
        self.set_ns: dict[int, int] = {}
        self.choice, self.in_the_way = 0, False
        self.conflict: tuple[int, int, Conflict] | None = None
        self.tracks: dict[int, CraneTrack] = {}
        self.deliveries = {one.lift.order: one.lift.place.delivery for one in lifts if one.lift.place is not None}
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
        begun_orders = {order for one in self.cranes for order in one.motions}
        self.turns: list[_Turn] = [*resumed, *(one for one in lifts if one.lift.order not in begun_orders)]
        # Later parts are set only after the hooks under way have passed.
        self.passed_ns = max([leg.end_ns for one in self.cranes for leg in one.legs.get(one.begun, ())], default=0)

    def run(self) -> tuple[LiftMotion, ...]:
        """Return the motions of all lifts, scheduled."""
        for crane in reversed(self.cranes):
            if crane.starts and self._conflict(crane, crane.start, 0) is not None:
                self._start_parked(crane)
        for crane in self.cranes:
            self.conflict = self._conflict(crane, crane.start, 0) if crane.starts else None
            if self.conflict is not None:
                raise self._never(crane, crane.lifts[0].lift)
        for n, turn in enumerate(self.turns):
            if not self._best_way(n):
                raise self._never(self._of(turn.crane), turn.lift)
        motions = [motion for crane in self.cranes for motion in motions_of(crane)]
        return tuple(sorted(motions, key=lambda motion: motion.order))

    def _of(self, number: int) -> CraneClock:
        return next(crane for crane in self.cranes if crane.number == number)

    def _best_way(self, number: int) -> bool:
        """Continue with a lift in the way with which the next ones end first; return whether there is a way."""
        turn, best = self.turns[number], None
        seen = set()
        for way in self._ways(turn):
            is_free = not self.in_the_way
            self._take(turn, way)
            key = tuple((one.at, one.free_ns) for one in self.cranes)
            if key in seen:
                continue
            seen.add(key)
            cranes, ends_ns = self.cranes, 0 if is_free else self._ends_ns(number)
            if best is None or ends_ns < best[0]:
                best = ends_ns, way._replace(cranes=cranes)
            if is_free:
                break
        if best is not None:
            self._take(turn, best[1], moves_on=False)
        return best is not None

    def _ends_ns(self, number: int) -> int:
        """Return when a lift and some more have ended if those take the first way; ``_NEVER_NS`` if one has none."""
        known = dict(self.raised_ns), dict(self.set_ns), dict(self.released_ns)
        ends_ns = self.released_ns[self.turns[number].lift.order]
        for turn in self.turns[number + 1 : number + 1 + _AHEAD]:
            way = next(self._ways(turn), None)
            if way is None:
                ends_ns = _NEVER_NS
                break
            self._take(turn, way)
            ends_ns = way.released_ns
        self.raised_ns, self.set_ns, self.released_ns = known
        return ends_ns

    def _ways(self, turn: _Turn) -> Iterator[_Way]:
        """Yield the ways in which a crane can continue with a lift; the first one as if nothing were in the way.

        If another crane is in the way, that crane moves back or aside. If this crane's hook, already over the part,
        prevents that, this crane moves back or aside itself and comes later.
        """
        kept, count = self.cranes, len(self.cranes) - 1
        tries = product(range(KEPT_PARKINGS), range(3), range(1 + 2 * count))
        for choice, own, steps in ((choice, own, steps) for choice, own, steps in tries if own or steps or not choice):
            self.choice, self.in_the_way = choice, bool(own or steps)
            self.cranes = [one.copy() for one in kept]
            crane, others = self._of(turn.crane), [other for other in self.cranes if other.number != turn.crane]
            if sum(self._give_way(crane) for _ in range(own)) == own:
                moved = [other for n, other in enumerate(others * 2) if n < steps and self._give_way(other)]
                if not steps or moved:
                    way = self._resume(crane, turn) if isinstance(turn, ResumedLoad) else self._lift(crane, turn)
                    if way is not None:
                        yield way
        self.cranes = kept

    def _take(self, turn: _Turn, way: _Way, *, moves_on: bool = True) -> None:
        """Continue in a way; the crane moves to its next part at once, if it can."""
        order, self.cranes = turn.lift.order, way.cranes
        self.raised_ns[order], self.set_ns[order], self.released_ns[order] = way.raised_ns, way.set_ns, way.released_ns
        crane = self._of(turn.crane)
        if moves_on and crane.next is not None and crane.next.early is not None:
            self._go(crane, crane.next.early, "pick")

    def _to_part(self, crane: CraneClock, one: CraneLift) -> bool:
        if crane.at == "pick":
            return True
        if crane.at == "parked":
            return crane.parking is not None and self._go(crane, crane.parking.back, "pick")
        return any(leg is not None and self._go(crane, leg, "pick") for leg in (one.early, one.late))

    def _set_after_ns(self, order: int) -> int:
        """Return the time before which the part of a lift must not be set."""
        earlier = [released_ns for n, released_ns in self.released_ns.items() if n < order]
        legs = [leg.end_ns for one in self.cranes for leg in one.legs.get(one.done, ()) if order in leg.before]
        return max([*earlier, *legs, self.passed_ns])

    def _resume(self, crane: CraneClock, load: ResumedLoad) -> _Way | None:
        """Schedule the rest of the motion of a stopped load; return None if it is not possible."""
        order, motion, resumes_ns = load.lift.order, load.motion, load.resumes_ns
        set_after_ns = self._set_after_ns(order)
        first_ns = max(crane.free_ns, self.ready_ns, resumes_ns, set_after_ns - motion.set_ns + resumes_ns)
        start_ns = self._first_free(crane, load.track.later(-resumes_ns), first_ns)
        if start_ns is None:
            return None
        late_ns = start_ns - resumes_ns
        crane.motions[order] = held_longer(motion, resumes_ns, late_ns)
        crane.tracks.append(load.track.later(late_ns))
        crane.ends_ns.append(motion.end_ns + late_ns)
        crane.at = "set"
        return _Way(self.cranes, self.raised_ns[order], motion.set_ns + late_ns, motion.released_ns + late_ns)

    def _lift(self, crane: CraneClock, one: CraneLift) -> _Way | None:
        """Schedule the hook's leg to the part if it is not there, and the lift; return None if it is not possible."""
        if not self._to_part(crane, one):
            return None
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
            return None
        crane.tracks.append(one.track.later(start_ns))
        crane.ends_ns.append(start_ns + carry.end_ns)
        crane.starts_ns.append(start_ns)
        crane.done += 1
        crane.at = "set"
        return _Way(self.cranes, start_ns + carry.raised_ns, start_ns + carry.set_ns, start_ns + carry.end_ns)

    def _go(self, crane: CraneClock, leg: Leg, to: str, *, at_once: bool = False) -> bool:
        """Schedule a leg of the empty hook as early as possible, or at once; return whether it is possible."""
        order = crane.next.lift.order if crane.next is not None else len(self.plan.lifts)
        first_ns = max(crane.free_ns, self.ready_ns)
        if crane.legs.get(crane.done):
            first_ns += REST_NS
        if leg.last:
            first_ns = max([first_ns, *(ns for n, ns in self.released_ns.items() if n < order)])
        passed_ns = min([self.set_ns[n] for n in leg.before if n in self.set_ns], default=None)
        track = self._track(crane, leg)
        latest_ns = None if passed_ns is None else passed_ns - int(leg.trajectory.time_ns[-1])
        if at_once:
            latest_ns = first_ns if latest_ns is None else min(first_ns, latest_ns)
        start_ns = self._first_free(crane, track, first_ns, latest_ns)
        if start_ns is None:
            return False
        crane.add_leg(PlacedLeg(start_ns, leg.trajectory, track.later(start_ns), before=leg.before))
        crane.at = to
        return True

    def _track(self, crane: CraneClock, leg: Leg) -> CraneTrack:
        """Return where a crane may be during a leg that starts at 0."""
        track = self.tracks.get(id(leg))
        if track is None:
            track = self.tracks[id(leg)] = approach_track(self.site, self.site.cranes[crane.number], leg.trajectory, 0)
        return track

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
            parked = standing_at(self._track(crane, parking.back).first, 0)
            if self._conflict(crane, parked, 0) is None:
                crane.start, crane.at, crane.parking = parked, "parked", parking
                return True
        return False

    def _first_free(
        self, crane: CraneClock, track: CraneTrack, first_ns: int, latest_ns: int | None = None
    ) -> int | None:
        """Return the first start at which a track, and the position at its end, have no conflict; None if none has."""
        others = [other for other in self.cranes if other is not crane]
        until_ns = max((other.free_ns for other in others), default=0)
        start_ns, tried_ns = first_ns, -1
        while start_ns != tried_ns:  # free of one crane, it may meet another
            tried_ns = start_ns
            for other in others:
                found_ns = first_start(
                    (crane.outline, other.outline),
                    track,
                    other.known(start_ns),
                    self.site.rules.crane_separation_m,
                    (start_ns, _STEP_NS, _NEVER_NS if latest_ns is None else latest_ns),
                    until_ns,
                )
                self.in_the_way |= found_ns != start_ns
                if found_ns is None:
                    start_ns = max(start_ns, until_ns)
                    self.conflict = self._conflict(crane, track.later(start_ns), start_ns) or self.conflict
                    return None
                start_ns = found_ns
        return start_ns

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
        return self.deliveries[order]

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
