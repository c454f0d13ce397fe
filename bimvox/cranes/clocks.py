"""The clocks of all cranes of a site: what is on them, and when more is free of the other cranes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from bimvox.crane.conflict import Conflict, CraneTrack, first_conflict, first_start
from bimvox.crane.outline import outline_of
from bimvox.cranes.clock import Begun, CraneClock, PlacedLeg, ResumedLoad, standing_at
from bimvox.cranes.lift import REST_NS, CraneLift, Leg, approach_track
from bimvox.motion.steps import may_pause
from bimvox.motion.trajectories import held_longer
from bimvox.records.lift import LiftPlan
from bimvox.site.site import parts_beside
from bimvox.units import NS_PER_S

_STEP_NS = 5 * NS_PER_S
_NEVER_NS = 2**62
_KEPT = 20_000
"""So many searches for a free start are kept, those of about the last 100 lifts."""

Turn = CraneLift | ResumedLoad


class Way(NamedTuple):
    """A way to continue with a lift: its order, the clocks of all cranes, and the times of the lift."""

    order: int
    cranes: list[CraneClock]
    raised_ns: int
    set_ns: int
    released_ns: int


class _Known(NamedTuple):
    """What is on the clocks at one moment of scheduling."""

    cranes: list[CraneClock]
    raised_ns: dict[int, int]
    set_ns: dict[int, int]
    released_ns: dict[int, int]


class _Free(NamedTuple):
    """What was found when the first free start of a track was looked for.

    Attributes:
        start_ns: The start; None if there is none.
        in_the_way: Whether another crane was in the way.
        conflict: The conflict for which there was none.
        tracks: The tracks that it depends on; while they are kept, no other ones have their numbers.
    """

    start_ns: int | None
    in_the_way: bool
    conflict: tuple[int, int, Conflict] | None
    tracks: tuple[object, ...]


class Clocks:
    """The clocks of all cranes, and the times of the lifts that are on them.

    Args:
        plan: The plan.
        lifts: The cranes' lifts, in order.
        begun: The work that every crane has begun, by its number; None if the plan is not being carried out.
        resumed: Loads that were stopped under way and have a path to continue on.
        ready_ns: The first moment at which something new may start.

    Attributes:
        cranes: The clocks.
        choice: Which of the parking places is tried first.
        in_the_way: Whether anything since it was cleared had to wait for another crane.
        conflict: The last conflict for which there was no free time: two cranes, and how they meet.
    """

    def __init__(
        self,
        plan: LiftPlan,
        lifts: Sequence[CraneLift],
        begun: Mapping[int, Begun] | None,
        resumed: Sequence[ResumedLoad],
        ready_ns: int,
    ) -> None:
        self.choice, self.in_the_way = 0, False
        self.conflict: tuple[int, int, Conflict] | None = None
        self.cranes: list[CraneClock] = []
        self._plan, self._site, self._ready_ns, self._may_pause = plan, plan.site, ready_ns, may_pause(plan)
        self._deliveries = {one.lift.order: one.lift.place.delivery for one in lifts if one.lift.place is not None}
        self._component, self._beside = {lift.order: lift.component for lift in plan.lifts}, parts_beside(plan.site)
        self._raised_ns: dict[int, int] = {}
        self._set_ns: dict[int, int] = {}
        self._released_ns: dict[int, int] = {}
        self._tracks: dict[int, CraneTrack] = {}
        self._of_two = frozenset(one.lift.order for one in lifts if one.other is not None)
        self._free: dict[tuple[Any, ...], _Free] = {}
        for number, crane in enumerate(plan.site.cranes):
            own = [one for one in lifts if one.crane == number]
            before = None if begun is None else begun.get(number)
            if own or before is not None:
                start = standing_at(own[0].track.first, 0) if before is None else before.start
                self.cranes.append(CraneClock(number, outline_of(crane), own, start))
                if before is not None:
                    self.cranes[-1].begin(before)
        for one in self.cranes:
            if one.starts and not one.lifts[0].starts_there:
                self.start_parked(one)
        for load in resumed:
            self.of(load.crane).at = "loaded"
        on_the_hook = {load.lift.order for load in resumed}
        for motion in (motion for one in self.cranes for motion in one.motions.values()):
            self._raised_ns[motion.order] = motion.raised_ns
            if motion.order not in on_the_hook:
                self._set_ns[motion.order], self._released_ns[motion.order] = motion.set_ns, motion.released_ns
        # Later parts are set only after the hooks under way have passed.
        self._passed_ns = max([leg.end_ns for one in self.cranes for leg in one.legs.get(one.begun, ())], default=0)

    @property
    def known(self) -> _Known:
        """What is on the clocks now."""
        return _Known(self.cranes, dict(self._raised_ns), dict(self._set_ns), dict(self._released_ns))

    def back_to(self, known: _Known) -> None:
        """Forget what was put on the clocks since then."""
        self.cranes = known.cranes
        self._raised_ns, self._set_ns, self._released_ns = (dict(times) for times in known[1:])

    def of(self, number: int) -> CraneClock:
        """Return the clock of a crane."""
        return next(crane for crane in self.cranes if crane.number == number)

    def take(self, way: Way) -> None:
        """Continue in a way."""
        self.cranes, order = way.cranes, way.order
        self._raised_ns[order], self._set_ns[order] = way.raised_ns, way.set_ns
        self._released_ns[order] = way.released_ns

    def _to_part(self, crane: CraneClock) -> bool:
        one = crane.next
        assert one is not None
        if crane.at == "pick":
            return True
        if crane.at == "parked":
            return self.go(crane, one.parkings[crane.parking].back, "pick")
        return any(leg is not None and self.go(crane, leg, "pick") for leg in (one.early, one.late))

    def go(self, crane: CraneClock, leg: Leg, to: str, *, at_once: bool = False) -> bool:
        """Schedule a leg of the empty hook as early as possible, or at once; return whether it is possible."""
        first_ns = max(crane.free_ns, self._ready_ns)
        if crane.legs.get(crane.done):
            first_ns += REST_NS
        if leg.last:
            until = crane.next.lift.order if crane.next is not None else len(self._plan.lifts)
            first_ns = max([first_ns, *(ns for n, ns in self._released_ns.items() if n < until)])
        passed_ns = min([self._set_ns[n] for n in leg.before if n in self._set_ns], default=None)
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
        track = self._tracks.get(id(leg))
        if track is None:
            track = self._tracks[id(leg)] = approach_track(
                self._site, self._site.cranes[crane.number], leg.trajectory, 0
            )
        return track

    def give_way(self, crane: CraneClock) -> bool:
        """Move a crane back from its next part, or to a parking place; return whether it is possible."""
        following = crane.next
        if crane.at == "pick" and following is not None:
            legs = crane.legs.get(crane.done, [])
            if len(legs) <= crane.kept:
                return self.start_parked(crane) if crane.starts else self._turn_aside(crane, following)
            return self._undo(crane, legs)
        if crane.at == "set":
            if following is None:
                leaves = crane.lifts[-1].leaves
                return any(self.go(crane, leg, "parked") for leg in (*leaves[self.choice :], *leaves[: self.choice]))
            return self._turn_aside(crane, following)
        return crane.at == "parked" and following is not None and self._turn_across(crane, following)

    def look_for_more(self) -> None:
        """Find all parking places of the cranes on the way to their next lifts, and the legs between them."""
        for crane in self.cranes:
            one = crane.next
            if one is not None and one.every_parking is not None:
                crane.lifts[crane.done] = replace(one, parkings=one.every_parking(), every_parking=None)

    def _turn_across(self, crane: CraneClock, following: CraneLift) -> bool:
        """Move a parked crane to another parking place."""
        legs = following.parkings[crane.parking].across
        for number in self._in_turn(legs):
            if any(self.go(crane, leg, "parked") for leg in legs[number]):
                crane.parking = number
                return True
        return False

    def _turn_aside(self, crane: CraneClock, following: CraneLift, *, at_once: bool = False) -> bool:
        for number in self._in_turn(following.parkings):
            aside = following.parkings[number].aside
            if aside is not None and self.go(crane, aside, "parked", at_once=at_once):
                crane.parking = number
                return True
        return False

    def _in_turn(self, places: Sequence[object]) -> list[int]:
        """Return the indices of parking places in the order in which they are tried."""
        numbers = list(range(len(places)))
        return [*numbers[self.choice :], *numbers[: self.choice]]

    def _undo(self, crane: CraneClock, legs: list[PlacedLeg]) -> bool:
        """Undo the leg to the next part; return whether it is possible.

        If there is a conflict at the place that the crane came from, it moves aside from there at once.
        """
        leg = legs.pop()
        crane.tracks.pop()
        end_ns = crane.ends_ns.pop()
        waiting = crane.known(leg.start_ns)
        crane.at = "parked" if len(legs) > crane.kept or crane.starts else "set"
        if self.conflict_of(crane, waiting, leg.start_ns) is None:
            return True
        following = crane.next
        if crane.at == "set" and following is not None and self._turn_aside(crane, following, at_once=True):
            return True
        legs.append(leg)
        crane.tracks.append(leg.track)
        crane.ends_ns.append(end_ns)
        crane.at = "pick"
        return False

    def start_parked(self, crane: CraneClock) -> bool:
        """Start at a parking place instead of over the first part; return whether it is possible."""
        if crane.at != "pick" or crane.tracks or not crane.starts:
            return False
        for number, parking in enumerate(crane.lifts[0].parkings):
            parked = standing_at(self._track(crane, parking.back).first, 0)
            if self.conflict_of(crane, parked, 0) is None:
                crane.start, crane.at, crane.parking = parked, "parked", number
                return True
        return False

    def _set_after_ns(self, order: int) -> int:
        """Return the time before which the part of a lift must not be set (R2)."""
        next_to = self._beside[self._component[order]]
        earlier = [
            released_ns if next_to[self._component[n]] else self._set_ns[n]
            for n, released_ns in self._released_ns.items()
            if n < order
        ]
        legs = [leg.end_ns for one in self.cranes for leg in one.legs.get(one.done, ()) if order in leg.before]
        return max([*earlier, *legs, self._passed_ns])

    def resume(self, crane: CraneClock, load: ResumedLoad) -> Way | None:
        """Schedule the rest of the motion of a stopped load; return None if it is not possible."""
        order, motion, resumes_ns = load.lift.order, load.motion, load.resumes_ns
        set_after_ns = self._set_after_ns(order)
        first_ns = max(crane.free_ns, self._ready_ns, resumes_ns, set_after_ns - motion.set_ns + resumes_ns)
        start_ns = self._first_free(crane, load.track.later(-resumes_ns), first_ns)
        if start_ns is None:
            return None
        late_ns = start_ns - resumes_ns
        crane.motions[order] = held_longer(motion, resumes_ns, late_ns)
        crane.tracks.append(load.track.later(late_ns))
        crane.ends_ns.append(motion.end_ns + late_ns)
        crane.at = "set"
        return Way(order, self.cranes, self._raised_ns[order], motion.set_ns + late_ns, motion.released_ns + late_ns)

    def lift(self, crane: CraneClock, one: CraneLift) -> Way | None:
        """Schedule the hook's leg to the part if it is not there, and the lift; return None if it is not possible.

        If two cranes carry the part, both of them go there, and both carry it at the same time.
        """
        halves = [(crane, one)]
        if one.other is not None:
            second = self.of(one.other)
            if second.next is None or second.next.lift is not one.lift:
                return None
            halves.append((second, second.next))
        if not self._all_to_part([own for own, _ in halves]):
            return None
        order, carry = one.lift.order, one.carry
        earlier = [n for n in self._released_ns if n < order]
        assert one.lift.place is not None
        delivery = one.lift.place.delivery
        first_ns = max(
            [own.free_ns for own, _ in halves]
            + [self._ready_ns, self._set_after_ns(order) - carry.set_ns]
            + [self._raised_ns[n] for n in earlier]
            + [self._released_ns[n] for n in earlier if order in self._may_pause or self._deliveries[n] < delivery]
            + [self._released_ns[n] for n in earlier if one.other is not None or n in self._of_two]
        )
        start_ns = self._first_free_of(halves, first_ns)
        if start_ns is None:
            return None
        for own, half in halves:
            own.tracks.append(half.track.later(start_ns))
            own.ends_ns.append(start_ns + carry.end_ns)
            own.starts_ns.append(start_ns)
            own.done += 1
            own.at = "set"
        return Way(order, self.cranes, start_ns + carry.raised_ns, start_ns + carry.set_ns, start_ns + carry.end_ns)

    def _all_to_part(self, cranes: Sequence[CraneClock]) -> bool:
        """Move cranes to the part that they lift next, in the order in which it is possible; return whether it is."""
        waiting = list(cranes)
        while waiting:
            there = next((own for own in waiting if self._to_part(own)), None)
            if there is None:
                return False
            waiting.remove(there)
        return True

    def _first_free_of(self, halves: Sequence[tuple[CraneClock, CraneLift]], first_ns: int) -> int | None:
        """Return the first start at which a lift has no conflict with cranes that do not carry its part."""
        together = [own for own, _ in halves]
        start_ns: int | None = first_ns
        tried_ns = None
        while start_ns is not None and start_ns != tried_ns:  # free with one crane, the other one may meet something
            tried_ns = start_ns
            for own, half in halves:
                if start_ns is not None:
                    start_ns = self._first_free(own, half.track, start_ns, None, together)
        return start_ns

    def _first_free(
        self,
        crane: CraneClock,
        track: CraneTrack,
        first_ns: int,
        latest_ns: int | None = None,
        besides: Sequence[CraneClock] = (),
    ) -> int | None:
        """Return the first start at which a track, and the position at its end, have no conflict; None if none has.

        What is found is kept: the ways around each other have many such searches in common. Cranes that carry the same
        part (``besides``) are not looked at: they keep apart whenever they start.
        """
        others = [other for other in self.cranes if other is not crane and other not in besides]
        until_ns = max((other.free_ns for other in others), default=0)
        tracks = (track, *(one for other in others for one in other.known_by(first_ns)))
        which = ((id(one.spans), one.start_ns) for one in tracks)
        key = (crane.number, first_ns, latest_ns, until_ns, len(others), *which)
        found = self._free.get(key)
        if found is None:
            if len(self._free) >= _KEPT:
                self._free.clear()
            before, self.in_the_way, self.conflict = (self.in_the_way, self.conflict), False, None
            start_ns = self._searched(crane, track, (first_ns, latest_ns, until_ns), others)
            found = self._free[key] = _Free(start_ns, self.in_the_way, self.conflict, tracks)
            self.in_the_way, self.conflict = before
        self.in_the_way |= found.in_the_way
        self.conflict = found.conflict or self.conflict
        return found.start_ns

    def _searched(
        self,
        crane: CraneClock,
        track: CraneTrack,
        times_ns: tuple[int, int | None, int],
        others: Sequence[CraneClock],
    ) -> int | None:
        first_ns, latest_ns, until_ns = times_ns
        start_ns, tried_ns = first_ns, -1
        while start_ns != tried_ns:  # free of one crane, it may meet another
            tried_ns = start_ns
            for other in others:
                found_ns = first_start(
                    (crane.outline, other.outline),
                    track,
                    other.known(start_ns),
                    self._site.rules.crane_separation_m,
                    (start_ns, _STEP_NS, _NEVER_NS if latest_ns is None else latest_ns),
                    until_ns,
                )
                self.in_the_way |= found_ns != start_ns
                if found_ns is None:
                    start_ns = max(start_ns, until_ns)
                    self.conflict = self.conflict_of(crane, track.later(start_ns), start_ns) or self.conflict
                    return None
                start_ns = found_ns
        return start_ns

    def conflict_of(self, crane: CraneClock, track: CraneTrack, from_ns: int) -> tuple[int, int, Conflict] | None:
        """Return the first conflict of a crane on a track with another crane from a time on; None if there is none."""
        for other in self.cranes:
            if other is crane:
                continue
            found = first_conflict(
                (crane.outline, other.outline),
                track,
                other.known(from_ns),
                self._site.rules.crane_separation_m,
                from_ns=from_ns,
            )
            if found is not None:
                return crane.number, other.number, found
        return None
