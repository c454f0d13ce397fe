"""Lifts of several cranes on one clock: when each begins, so that the order holds and the cranes stay apart.

The order of a plan is that of one crane: lift after lift. With several cranes lifts overlap in time under rules that
make true, at every moment, what each lift was planned for:

* R1: a part is hooked on when every part before it in the order is out of the yard;
* R2: a part comes to its place when every part before it in the order stands by itself, slings off;
* R3: a part of a later delivery is hooked on when every part of the earlier ones stands by itself;
* R4: at every moment the cranes, braking from there if need be, stay apart (``bimvox.crane.conflict``).

Lifts are put on the clock one by one in the order, each at the first moment (in steps of some seconds) at which the
rules hold against all that the other cranes do already, and against where they stand when they are done with it. A
crane that is done with a lift goes to its next part at once and waits there; where it would be in the way of the lifts
before that one it stays where it is, or turns away to a parking place. A load is never kept waiting in the air.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np

from bimvox.crane.conflict import Conflict, CraneTrack, first_conflict, joined
from bimvox.crane.outline import CraneOutline, outline_of
from bimvox.errors import MotionError
from bimvox.planning.lift import Lift, LiftPlan
from bimvox.site.clearance import Clearance
from bimvox.trajectory.crane_lifts import CraneLift, Leg, Parking, crane_lifts
from bimvox.trajectory.crane_track import approach_track
from bimvox.trajectory.motion import LiftMotion, Phase, PhaseName
from bimvox.trajectory.time_plan import time_plan
from bimvox.trajectory.timing import NS_PER_S
from bimvox.trajectory.trajectory import Trajectory
from bimvox.trajectory.ways import one_after_another, shifted, turned

_STEP_NS = 5 * NS_PER_S
_REST_NS = NS_PER_S
"""Between two ways of an empty hook."""


def time_lifts(plan: LiftPlan, clearances: Iterable[tuple[Lift, Clearance]]) -> tuple[LiftMotion, ...]:
    """Return the motion of every planned lift, in order, of a site with one crane or several; as ``time_plan``.

    Raises:
        InputError: If the site has no crane.
        MotionError: If a path is not free or cannot be driven, or a crane is always in a lift's way; says which lift.
    """
    if not plan.site.other_cranes:
        return time_plan(plan, clearances)
    return _Schedule(plan, crane_lifts(plan, clearances)).run()


@dataclass(slots=True, eq=False)
class _Placed:
    """A way of the empty hook on the clock."""

    start_ns: int
    way: Trajectory
    track: CraneTrack


@dataclass(slots=True, eq=False)
class _Crane:
    """What one crane does, as far as that is known.

    Attributes:
        number: Which it is.
        outline: How much room it takes.
        lifts: Its lifts, in order.
        stands: Where it stands before its first move.
        done: How many of its lifts are on the clock.
        tracks: Everything on the clock, in time.
        ends_ns: When each of it ends; a track may reach a little further.
        legs: Per lift its ways to the part; of the lift after the last one its way to the parking place.
        starts_ns: Per lift on the clock when it is hooked on.
        at: Where its hook is: ``set`` (where its last part was set), ``pick`` (over its next one) or ``parked``.
        parking: Where it is parked.
    """

    number: int
    outline: CraneOutline
    lifts: list[CraneLift]
    stands: CraneTrack
    done: int = 0
    tracks: list[CraneTrack] = field(default_factory=list)
    ends_ns: list[int] = field(default_factory=list)
    legs: dict[int, list[_Placed]] = field(default_factory=dict)
    starts_ns: list[int] = field(default_factory=list)
    at: str = "pick"
    parking: Parking | None = None

    @property
    def free_ns(self) -> int:
        """When it is done with all that is on the clock."""
        return self.ends_ns[-1] if self.tracks else 0

    @property
    def next(self) -> CraneLift | None:
        """Its next lift."""
        return self.lifts[self.done] if self.done < len(self.lifts) else None

    def known(self, from_ns: int) -> CraneTrack:
        """Return its track from a moment on, and where it stands at the end of it."""
        late = [track for track in self.tracks if track.end_ns > from_ns]
        before = self.tracks[: len(self.tracks) - len(late)]
        if not late:
            return _standing(before[-1].last if before else self.stands.first, from_ns)
        return joined(late)


class _Schedule:
    def __init__(self, plan: LiftPlan, lifts: Sequence[CraneLift]) -> None:
        self.plan, self.site, self.lifts = plan, plan.site, lifts
        self.released_ns: dict[int, int] = {}
        self.raised_ns: dict[int, int] = {}
        self.set_ns: dict[int, int] = {}
        self.not_set_before_ns: dict[int, int] = {}
        self.choice = 0
        self.conflict: tuple[int, int, Conflict] | None = None
        self.cranes: list[_Crane] = []
        for number, crane in enumerate(self.site.cranes):
            own = [one for one in lifts if one.crane == number]
            if own:
                first = own[0].track.first
                self.cranes.append(_Crane(number, outline_of(crane), own, _standing(first, 0)))
        for one in self.cranes:
            first_lift = one.lifts[0]
            if not first_lift.starts_there:
                self._start_parked(one)

    def run(self) -> tuple[LiftMotion, ...]:
        """Put every lift on the clock."""
        for crane in reversed(self.cranes):
            if self._conflict(crane, crane.stands, 0) is not None:
                self._start_parked(crane)
        for crane in self.cranes:
            self.conflict = self._conflict(crane, crane.stands, 0)
            if self.conflict is not None:
                raise self._never(crane, crane.lifts[0])
        for one in self.lifts:
            crane = next(crane for crane in self.cranes if crane.number == one.crane)
            self._schedule(crane, one)
        motions = [motion for crane in self.cranes for motion in _motions(crane)]
        return tuple(sorted(motions, key=lambda motion: motion.order))

    def _schedule(self, crane: _Crane, one: CraneLift) -> None:
        """Bring the hook to the part if it is not there, and carry it.

        Where another crane is in the way it goes back, or aside; where this one's hook, over the part already, keeps
        the other from doing so, it goes back or aside itself, and comes later.
        """
        kept = self._kept()
        others = [other for other in self.cranes if other is not crane]
        tries = product(range(3), range(3), range(1 + 2 * len(others)))
        for choice, own, steps in ((choice, own, steps) for choice, own, steps in tries if own or steps or not choice):
            self.choice = choice
            self._restore(kept)
            if sum(self._give_way(crane) for _ in range(own)) == own:
                moved = [other for n, other in enumerate(others * 2) if n < steps and self._give_way(other)]
                if (not steps or moved) and self._to_part(crane, one) and self._carry(crane, one):
                    following = crane.next
                    if following is not None and following.early is not None:
                        self._go(crane, following.early, "pick")
                    return
        raise self._never(crane, one)

    def _kept(self) -> list[tuple[_Crane, _Crane]]:
        return [
            (
                one,
                replace(
                    one,
                    tracks=list(one.tracks),
                    ends_ns=list(one.ends_ns),
                    legs={n: list(legs) for n, legs in one.legs.items()},
                ),
            )
            for one in self.cranes
        ]

    def _restore(self, kept: list[tuple[_Crane, _Crane]]) -> None:
        for one, was in kept:
            one.tracks, one.ends_ns = list(was.tracks), list(was.ends_ns)
            one.stands, one.at, one.parking = was.stands, was.at, was.parking
            one.legs = {n: list(legs) for n, legs in was.legs.items()}

    def _to_part(self, crane: _Crane, one: CraneLift) -> bool:
        if crane.at == "pick":
            return True
        if crane.at == "parked":
            return crane.parking is not None and self._go(crane, crane.parking.back, "pick")
        return any(leg is not None and self._go(crane, leg, "pick") for leg in (one.early, one.late))

    def _carry(self, crane: _Crane, one: CraneLift) -> bool:
        """Put a lift on the clock, from hook on to slings off."""
        order, carry = one.lift.order, one.carry
        earlier = [n for n in self.released_ns if n < order]
        assert one.lift.place is not None
        delivery = one.lift.place.delivery
        set_after_ns = max([self.released_ns[n] for n in earlier] + [self.not_set_before_ns.get(order, 0)], default=0)
        first_ns = max(
            [crane.free_ns, set_after_ns - carry.set_ns]
            + [self.raised_ns[n] for n in earlier]
            + [self.released_ns[n] for n in earlier if self._delivery(n) < delivery]
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

    def _go(self, crane: _Crane, leg: Leg, to: str, *, at_once: bool = False) -> bool:
        """Put a way of the empty hook on the clock, as early as it can be, or at once."""
        order = crane.next.lift.order if crane.next is not None else len(self.plan.lifts)
        first_ns = crane.free_ns
        if crane.legs.get(crane.done):
            first_ns += _REST_NS
        if leg.last:
            first_ns = max([first_ns, *(ns for n, ns in self.released_ns.items() if n < order)])
        passed_ns = min([self.set_ns[n] for n in leg.before if n in self.set_ns], default=None)
        track = approach_track(self.site.for_crane(crane.number), self.site.cranes[crane.number], leg.way, 0)
        latest_ns = None if passed_ns is None else passed_ns - int(leg.way.time_ns[-1])
        if at_once:
            latest_ns = first_ns if latest_ns is None else min(first_ns, latest_ns)
        start_ns = self._first_free(crane, track, first_ns, latest_ns)
        if start_ns is None:
            return False
        placed = _Placed(start_ns, leg.way, track.later(start_ns))
        crane.legs.setdefault(crane.done, []).append(placed)
        crane.tracks.append(placed.track)
        crane.ends_ns.append(start_ns + int(leg.way.time_ns[-1]))
        for n in leg.before:
            ends_ns = start_ns + int(leg.way.time_ns[-1])
            self.not_set_before_ns[n] = max(self.not_set_before_ns.get(n, 0), ends_ns)
        crane.at = to
        return True

    def _give_way(self, crane: _Crane) -> bool:
        """Bring a crane that stands somewhere out of the way: back from its next part, or to its parking place."""
        following = crane.next
        if crane.at == "pick" and following is not None:
            legs = crane.legs.get(crane.done, [])
            if not legs:
                return crane.done == 0 and self._start_parked(crane)
            return self._undo(crane, legs)
        if crane.at == "set":
            if following is None:
                leaves = crane.lifts[-1].leaves
                return any(self._go(crane, leg, "parked") for leg in (*leaves[self.choice :], *leaves[: self.choice]))
            return self._turn_aside(crane, following)
        return False

    def _turn_aside(self, crane: _Crane, following: CraneLift, *, at_once: bool = False) -> bool:
        for parking in (*following.parkings[self.choice :], *following.parkings[: self.choice]):
            if parking.aside is not None and self._go(crane, parking.aside, "parked", at_once=at_once):
                crane.parking = parking
                return True
        return False

    def _undo(self, crane: _Crane, legs: list[_Placed]) -> bool:
        """Take back the way to the next part.

        Where something would meet the crane at the place that it came from, it goes aside from there at once.
        """
        leg = legs.pop()
        crane.tracks.pop()
        end_ns = crane.ends_ns.pop()
        stood = crane.known(leg.start_ns)
        crane.at = "parked" if legs or (crane.done == 0) else "set"
        if self._conflict(crane, stood, leg.start_ns) is None:
            return True
        following = crane.next
        if crane.at == "set" and following is not None and self._turn_aside(crane, following, at_once=True):
            return True
        legs.append(leg)
        crane.tracks.append(leg.track)
        crane.ends_ns.append(end_ns)
        crane.at = "pick"
        return False

    def _start_parked(self, crane: _Crane) -> bool:
        """Begin at the parking place rather than over the first part."""
        if crane.at != "pick" or crane.tracks:
            return False
        for parking in crane.lifts[0].parkings:
            site, machine = self.site.for_crane(crane.number), self.site.cranes[crane.number]
            parked = _standing(approach_track(site, machine, parking.back.way, 0).first, 0)
            if self._conflict(crane, parked, 0) is None:
                crane.stands, crane.at, crane.parking = parked, "parked", parking
                return True
        return False

    def _first_free(self, crane: _Crane, track: CraneTrack, first_ns: int, latest_ns: int | None = None) -> int | None:
        """Return the first start at which a track, and standing where it ends, is clear of all that is known."""
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

    def _conflict(self, crane: _Crane, track: CraneTrack, from_ns: int) -> tuple[int, int, Conflict] | None:
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

    def _never(self, crane: _Crane, one: CraneLift) -> MotionError:
        component = self.site.components[one.lift.component]
        words, cranes = "", self.site.cranes
        if self.conflict is not None:
            own, other, found = self.conflict
            words = (
                f": the {found.parts[0]} of {cranes[own].name} would come within {found.distance_m:.1f} m of the "
                f"{found.parts[1]} of {cranes[other].name}, {found.needed_m:g} m are needed"
            )
        return MotionError(
            component.id,
            f"{cranes[crane.number].name} finds no time for it beside the other cranes{words}",
            hint="put the cranes further apart or at other heights, or give it to another one ([[component]] crane)",
        )


def _standing(row: np.ndarray, from_ns: int) -> CraneTrack:
    return CraneTrack(from_ns, row[None, :], row, row)


def _motions(crane: _Crane) -> list[LiftMotion]:
    """The crane's lifts with their waits, each from where the one before ends."""
    motions: list[LiftMotion] = []
    clock_ns, slew_rad = 0, None
    for n, (one, hooked_ns) in enumerate(zip(crane.lifts, crane.starts_ns, strict=True)):
        legs = crane.legs.get(n, [])
        last = n + 1 == len(crane.lifts)
        motion = _motion(one, clock_ns, legs, hooked_ns, crane.legs.get(n + 1, []) if last else [], slew_rad)
        motions.append(motion)
        clock_ns, slew_rad = motion.end_ns, float(motion.trajectories[-1].slew_rad[-1])
    return motions


def _motion(
    one: CraneLift, clock_ns: int, legs: list[_Placed], hooked_ns: int, leaves: list[_Placed], slew_rad: float | None
) -> LiftMotion:
    phases: list[Phase] = []
    at_ns = clock_ns

    def go_on(name: PhaseName, until_ns: int) -> None:
        nonlocal at_ns
        if until_ns > at_ns:
            phases.append(Phase(name, at_ns, until_ns))
            at_ns = until_ns

    ways = []
    for leg in legs:
        go_on(PhaseName.WAIT, leg.start_ns)
        way = turned(shifted(leg.way, leg.start_ns - clock_ns), slew_rad)
        slew_rad = float(way.slew_rad[-1])
        ways.append(way)
        go_on(PhaseName.APPROACH, leg.start_ns + int(leg.way.time_ns[-1]))
    go_on(PhaseName.WAIT, hooked_ns)
    late_ns = hooked_ns - clock_ns
    raising = turned(shifted(one.carry.raising, late_ns), slew_rad)
    loaded = turned(shifted(one.carry.loaded, late_ns), float(raising.slew_rad[-1]))
    phases += [replace(p, start_ns=p.start_ns + hooked_ns, end_ns=p.end_ns + hooked_ns) for p in one.carry.phases]
    at_ns = hooked_ns + one.carry.end_ns
    departure = None
    for leg in leaves:
        go_on(PhaseName.WAIT, leg.start_ns)
        departure = turned(shifted(leg.way, leg.start_ns - clock_ns), float(loaded.slew_rad[-1]))
        go_on(PhaseName.LEAVE, leg.start_ns + int(leg.way.time_ns[-1]))
    approach = one_after_another(ways) if ways else None
    return replace(
        one.carry,
        approach=approach,
        raising=raising,
        loaded=loaded,
        phases=tuple(phases),
        start_ns=clock_ns,
        end_ns=at_ns,
        crane=one.crane,
        departure=departure,
    )
