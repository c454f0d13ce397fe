"""The schedule of several cranes: when each lift starts so that the sequence is kept and the cranes stay apart.

The erection sequence is that of one crane: lift after lift. With several cranes lifts overlap in time, under rules that
keep the assumptions of each lift true at every moment:

* R1: a part is hooked on after all earlier parts of the sequence have left the yard;
* R2: a part is set after all earlier parts of the sequence are set, and after the slings of those next to it are off
  (``bimvox.site.site``);
* R3: a part of a later delivery is hooked on after all parts of earlier deliveries are set and their slings are off;
* R4: the cranes keep their separation at every moment, also if they brake from there (``bimvox.crane.conflict``);
* R5: a part that rests on work that the crane does not do is hooked on after all earlier parts of the sequence are set
  and their slings are off: until that work carries, the cranes may pause then;
* R6: while two cranes carry a part together, no other part is lifted.

Lifts are scheduled one by one in sequence. Each gets the first time (in steps of some seconds) at which it obeys the
rules against everything scheduled for the other cranes, and against their positions afterwards. A crane that has
finished a lift moves to its next part at once and waits there. If it would obstruct earlier lifts there, it stays where
it is or slews to a parking place, in the way with which the next lifts end first. Only if there is no such way, all
parking places are found, and a parked crane moves on from one to another. A load never waits in the air.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import product

from bimvox.cranes.clock import Begun, CraneClock, PlacedLeg, ResumedLoad
from bimvox.cranes.clocks import Clocks, Turn, Way
from bimvox.cranes.lift import KEPT_PARKINGS, CraneLift, NoFreeTimeError
from bimvox.cranes.lifts import crane_lifts
from bimvox.motion.time_plan import time_plan
from bimvox.motion.trajectories import delayed, delayed_phases, one_after_another, turned_to
from bimvox.planning.preparation import Preparation
from bimvox.records.lift import Lift, LiftPlan
from bimvox.records.motion import LiftMotion, Phase, PhaseName, Trajectory
from bimvox.site.site import Site
from bimvox.walk import Store
from bimvox.workers import ALONE, Workers

_NEVER_NS = 2**62
_AHEAD = 3
"""How many more lifts are looked at if a crane can give way to another one in several ways."""


def time_lifts(
    plan: LiftPlan, preparation: Preparation, store: Store | None = None, workers: Workers = ALONE
) -> tuple[LiftMotion, ...]:
    """Return the motion of every planned lift, in order, of a site with one crane or several; as ``time_plan``.

    Raises InputError: if the site has no crane. Raises MotionError: if a path is not free or cannot be driven, or a
    crane always obstructs a lift; names the lift.
    """
    if not plan.site.has_several_cranes:
        return time_plan(plan, preparation, store, workers)
    return _Schedule(plan, crane_lifts(plan, preparation, store, workers=workers)).run()


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
        self.site, self.clocks = plan.site, Clocks(plan, lifts, begun, resumed, ready_ns)
        begun_orders = {order for one in self.clocks.cranes for order in one.motions}
        self.turns: list[Turn] = [
            *resumed,
            *(one for one in lifts if one.lift.order not in begun_orders and not one.is_second),
        ]

    def run(self) -> tuple[LiftMotion, ...]:
        """Return the motions of all lifts, scheduled."""
        clocks = self.clocks
        for crane in reversed(clocks.cranes):
            if crane.starts and clocks.conflict_of(crane, crane.start, 0) is not None:
                clocks.start_parked(crane)
        for crane in clocks.cranes:
            clocks.conflict = clocks.conflict_of(crane, crane.start, 0) if crane.starts else None
            if clocks.conflict is not None:
                raise self._never(crane, crane.lifts[0].lift)
        for n, turn in enumerate(self.turns):
            if not (self._best_way(n) or self._with_every_place(n)):
                raise self._never(clocks.of(turn.crane), turn.lift)
        motions = [motion for crane in clocks.cranes for motion in _motions_of(crane)]
        return together(self.site, motions)

    def _best_way(self, number: int) -> bool:
        """Continue with a lift in the way with which the next ones end first; return whether there is a way."""
        best: tuple[int, Way] | None = None
        for way, is_free in self._different_ways(number):
            ends_ns = 0 if is_free else self._ends_ns(number)
            if best is None or ends_ns < best[0]:
                best = ends_ns, way
            if is_free:
                break
        if best is not None:
            self.clocks.take(best[1])
        return best is not None

    def _with_every_place(self, number: int) -> bool:
        """Continue with a lift that had no way: parked cranes may move on; return whether it has one then."""
        self.clocks.look_for_more()
        return self._best_way(number)

    def _different_ways(self, number: int) -> Iterator[tuple[Way, bool]]:
        """Yield the ways to continue with a lift that end differently, and whether nothing is in the way; take each."""
        clocks, seen = self.clocks, set()
        for way in self._ways(self.turns[number]):
            is_free = not clocks.in_the_way
            self._take(self.turns[number], way)
            key = tuple((one.at, one.free_ns) for one in clocks.cranes)
            if key not in seen:
                seen.add(key)
                yield way._replace(cranes=clocks.cranes), is_free

    def _ends_ns(self, number: int) -> int:
        """Return when a lift and some more have ended if those take the first way; ``_NEVER_NS`` if one has none."""
        clocks, known = self.clocks, self.clocks.known
        ends_ns = known.released_ns[self.turns[number].lift.order]
        for later in self.turns[number + 1 : number + 1 + _AHEAD]:
            way = next(self._ways(later), None)
            if way is None:
                ends_ns = _NEVER_NS
                break
            self._take(later, way)
            ends_ns = way.released_ns
        clocks.back_to(known)
        return ends_ns

    def _ways(self, turn: Turn) -> Iterator[Way]:
        """Yield the ways in which a crane can continue with a lift; the first one as if nothing were in the way.

        If another crane is in the way, that crane moves back or aside. If this crane's hook, already over the part,
        prevents that, this crane moves back or aside itself and comes later.
        """
        clocks = self.clocks
        kept, count = clocks.cranes, len(clocks.cranes) - 1
        places = max(len(one.next.parkings) if one.next is not None else 0 for one in kept)
        tries = product(range(max(KEPT_PARKINGS, places)), range(3), range(1 + 2 * count))
        for choice, own, steps in ((choice, own, steps) for choice, own, steps in tries if own or steps or not choice):
            clocks.choice, clocks.in_the_way = choice, bool(own or steps)
            clocks.cranes = [one.copy() for one in kept]
            crane, others = clocks.of(turn.crane), [one for one in clocks.cranes if one.number != turn.crane]
            if sum(clocks.give_way(crane) for _ in range(own)) == own:
                moved = [other for n, other in enumerate(others * 2) if n < steps and clocks.give_way(other)]
                if not steps or moved:
                    way = clocks.resume(crane, turn) if isinstance(turn, ResumedLoad) else clocks.lift(crane, turn)
                    if way is not None:
                        yield way
        clocks.cranes = kept

    def _take(self, turn: Turn, way: Way) -> None:
        """Continue in a way; the crane moves to its next part at once, if it can."""
        self.clocks.take(way)
        second = turn.other if isinstance(turn, CraneLift) else None
        for crane in [self.clocks.of(number) for number in (turn.crane, second) if number is not None]:
            if crane.next is not None and crane.next.early is not None:
                self.clocks.go(crane, crane.next.early, "pick")

    def _never(self, crane: CraneClock, lift: Lift) -> NoFreeTimeError:
        component = self.site.components[lift.component]
        reason, cranes = "", self.site.cranes
        if self.clocks.conflict is not None:
            own, other, found = self.clocks.conflict
            reason = (
                f": the {found.parts[0]} of {cranes[own].name} would come within {found.distance_m:.1f} m of the "
                f"{found.parts[1]} of {cranes[other].name}, {found.needed_m:g} m are needed"
            )
        return NoFreeTimeError(
            component.id,
            f"{cranes[crane.number].name} has no free time slot for it alongside the other cranes{reason}",
            hint="put the cranes further apart or at other heights, or give it to another one ([[component]] crane)",
        )


def together(site: Site, motions: Sequence[LiftMotion]) -> tuple[LiftMotion, ...]:
    """Return the motions of all cranes by lift, in order; of two that carry a part, the first holds the second."""
    seconds = {one.order: one for one in motions if one.crane != site.components[one.component].crane}
    firsts = (one for one in motions if one.crane == site.components[one.component].crane)
    return tuple(
        replace(one, second=seconds[one.order]) if one.order in seconds else one
        for one in sorted(firsts, key=lambda motion: motion.order)
    )


def _motions_of(crane: CraneClock) -> list[LiftMotion]:
    """Return the motions of the crane's lifts with their waits; each starts where the one before ends."""
    motions: list[LiftMotion] = []
    clock_ns, slew_rad = 0, None
    for n, (one, hooked_ns) in enumerate(zip(crane.lifts, crane.starts_ns, strict=True)):
        legs = crane.legs.get(n, [])
        leaves = crane.legs.get(n + 1, []) if n + 1 == len(crane.lifts) else []
        if n < crane.begun:
            motion = _leaving(crane.motions[one.lift.order], leaves)
        else:
            motion = _motion(one, clock_ns, legs, hooked_ns, leaves, slew_rad)
        motions.append(motion)
        clock_ns, slew_rad = motion.end_ns, float(motion.trajectories[-1].slew_rad[-1])
    return motions


class _Phases:
    """Phases that follow each other from a time on."""

    def __init__(self, at_ns: int) -> None:
        self.phases: list[Phase] = []
        self.at_ns = at_ns

    def add(self, name: PhaseName, until_ns: int) -> None:
        if until_ns > self.at_ns:
            self.phases.append(Phase(name, self.at_ns, until_ns))
            self.at_ns = until_ns

    def add_legs(
        self, name: PhaseName, legs: list[PlacedLeg], clock_ns: int, slew_rad: float | None, until_ns: int | None
    ) -> Trajectory | None:
        """Append legs of the empty hook, with waits in between; return them joined. A stop lasts until the next leg."""
        parts: list[Trajectory] = []
        stopped = False
        for leg in legs:
            self.add(PhaseName.STOP if stopped else PhaseName.WAIT, leg.start_ns)
            parts.append(turned_to(delayed(leg.trajectory, leg.start_ns - clock_ns), slew_rad))
            slew_rad = float(parts[-1].slew_rad[-1])
            stopped = leg.stopped_ns is not None
            self.add(name, leg.end_ns if leg.stopped_ns is None else leg.stopped_ns)
        if until_ns is not None:
            self.add(PhaseName.STOP if stopped else PhaseName.WAIT, until_ns)
        elif stopped:
            self.add(PhaseName.STOP, legs[-1].end_ns)
        return one_after_another(parts) if parts else None


def _leaving(motion: LiftMotion, leaves: list[PlacedLeg]) -> LiftMotion:
    """Return the motion with a departure: legs of the empty hook that make room for other cranes."""
    if not leaves:
        return motion
    phases = _Phases(motion.end_ns)
    departure = phases.add_legs(PhaseName.LEAVE, leaves, motion.start_ns, float(motion.loaded.slew_rad[-1]), None)
    return replace(motion, phases=(*motion.phases, *phases.phases), end_ns=phases.at_ns, departure=departure)


def _motion(
    one: CraneLift,
    clock_ns: int,
    legs: list[PlacedLeg],
    hooked_ns: int,
    leaves: list[PlacedLeg],
    slew_rad: float | None,
) -> LiftMotion:
    phases = _Phases(clock_ns)
    approach = phases.add_legs(PhaseName.APPROACH, legs, clock_ns, slew_rad, hooked_ns)
    if approach is not None:
        slew_rad = float(approach.slew_rad[-1])
    late_ns = hooked_ns - clock_ns
    raising = turned_to(delayed(one.carry.raising, late_ns), slew_rad)
    loaded = turned_to(delayed(one.carry.loaded, late_ns), float(raising.slew_rad[-1]))
    motion = replace(
        one.carry,
        approach=approach,
        raising=raising,
        loaded=loaded,
        phases=(*phases.phases, *delayed_phases(one.carry.phases, hooked_ns)),
        start_ns=clock_ns,
        end_ns=hooked_ns + one.carry.end_ns,
        crane=one.crane,
        departure=None,
    )
    return _leaving(motion, leaves)
