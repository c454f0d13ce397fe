"""The lifts of several cranes before they are scheduled, made by several processes.

The carry of each lift is made by itself, from slewing angle 0. Then the legs of the empty hooks are made, which depend
on the carries of other cranes, but not on other legs. At the end whole turns are added, so that each lift begins where
its crane's lift before ends.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from bimvox.crane.conflict import COLUMNS, SLEW_HIGH, SLEW_LOW, CraneTrack, first_conflict
from bimvox.crane.outline import outline_of
from bimvox.cranes.clock import insist_on_room
from bimvox.cranes.legs import CraneStart, LastLift, LegMaker, legs_from_there
from bimvox.cranes.lift import (
    Carried,
    CraneLift,
    Leg,
    Legs,
    NoFreeTimeError,
    Parking,
    bare_track,
    carrying_track,
)
from bimvox.errors import MotionError
from bimvox.motion.time_plan import each_by_itself
from bimvox.motion.trajectories import turned
from bimvox.planning.assembly import Assembly
from bimvox.planning.preparation import Preparation
from bimvox.records.lift import Lift, LiftPlan, Status
from bimvox.records.motion import LiftMotion, by_each_crane
from bimvox.site.collision import CollisionSpace
from bimvox.site.site import Site
from bimvox.site.tandem import cranes_of, has_tandems, part_on, seen_by
from bimvox.walk import Shared, Store, Walk
from bimvox.workers import ALONE, Workers

NOWHERE: Mapping[int, CraneStart] = {}
"""Where cranes continue from in a plan that is not being carried out."""


def crane_lifts(
    plan: LiftPlan,
    preparation: Preparation,
    store: Store | None = None,
    starts: Mapping[int, CraneStart] = NOWHERE,
    workers: Workers = ALONE,
) -> tuple[CraneLift, ...]:
    """Return the lifts of several cranes, for every planned lift, in order.

    Args:
        plan: The plan, of a site with several cranes.
        preparation: What was prepared for the site.
        store: What is known from earlier plans of the same site, which may differ in who lifts a part, is not made
            again.
        starts: Where every crane continues from, by its number, if the plan is being carried out. Of lifts that have
            begun, only the tracks are made.
        workers: Share the work.

    Raises:
        HookError: If a hook has no free path from where it is to its next part.
        MotionError: If a path is not free or cannot be driven, or the empty hook has no free path to a part.
        NoFreeTimeError: If a crane obstructs lifts of another one wherever it waits; names all of them.
    """
    store = Store() if store is None else store
    begun = {order: motion for start in starts.values() for order, motion in start.motions.items()}
    made = {motion.order: motion for motion in each_by_itself(plan, preparation, store, workers, begun)} | begun
    planned = [lift for lift in plan.lifts if lift.status is Status.PLANNED]
    pairs = [(lift, carry) for lift in planned for carry in by_each_crane([made[lift.order]])]
    carries = [carry for _, carry in pairs]
    carried = [
        store.once(store.key("carried", lift, carry), partial(_carried, plan.site, lift, carry))
        for lift, carry in pairs
    ]
    _insist_that_two_fit(plan.site, pairs)
    insist_on_room(plan.site, [one for one in carried if one.lift.order not in begun])
    making = _LegMaking(plan, preparation, starts)
    legs = making.all(carried, store, workers)
    return tuple(_one_after_another(plan.site, carries, carried, legs, begun, partial(making.every_parking, carried)))


def _carried(site: Site, lift: Lift, carry: LiftMotion) -> Carried:
    number, cranes = carry.crane, cranes_of(site.components[lift.component])
    track = carrying_track(seen_by(site, number), site.cranes[number], lift, carry)
    ends_rad = float(carry.raising.slew_rad[0]), float(carry.loaded.slew_rad[-1])
    return Carried(lift, number, track, *ends_rad, next((one for one in cranes if one != number), None))


def _insist_that_two_fit(site: Site, pairs: Sequence[tuple[Lift, LiftMotion]]) -> None:
    """Raise an error if the jibs, ropes or hooks of two cranes that carry a part together come too near to each other.

    Raises NoFreeTimeError: names the part.
    """
    for (lift, one), (other_lift, other) in pairwise(pairs):
        if lift is not other_lift:
            continue
        names = [site.cranes[half.crane].name for half in (one, other)]
        tracks = [
            bare_track(site, site.cranes[half.crane], part_on(site, lift.component, half.crane), half)
            for half in (one, other)
        ]
        outlines = (outline_of(site.cranes[one.crane]), outline_of(site.cranes[other.crane]))
        met = first_conflict(outlines, tracks[0], tracks[1], site.rules.crane_separation_m)
        if met is not None:
            raise NoFreeTimeError(
                site.components[lift.component].id,
                f"{names[0]} and {names[1]} cannot carry it together: the {met.parts[0]} of {names[0]} would come "
                f"within {met.distance_m:.1f} m of the {met.parts[1]} of {names[1]}, {met.needed_m:g} m are needed",
                hint="put the cranes further apart or at other heights, or store it elsewhere ([[component]] start)",
            )


class _Stand:
    """The site before a lift, and the collision rules of the last lifts of all cranes."""

    def __init__(self, assembly: Assembly) -> None:
        self.assembly = assembly
        self.spaces: dict[int, CollisionSpace] = {}
        self.since: tuple[Lift, CollisionSpace] | None = None
        self.here: CollisionSpace | None = None


class _Sought(NamedTuple):
    """A lift whose legs are sought.

    Attributes:
        order: Its order.
        crane: Number of the crane whose legs they are.
        seen: This lift, and the others that its legs depend on, in order.
        every_place: Whether all parking places are wanted.
    """

    order: int
    crane: int
    seen: tuple[Carried, ...]
    every_place: bool = False


@dataclass(frozen=True, eq=False)
class _LegMaking(Walk[_Stand, _Sought, "Legs | MotionError"]):
    """Makes the legs to lifts of a plan; an error for those that the hook cannot get to.

    Attributes:
        plan: The plan.
        preparation: What was prepared for its site.
        starts: As for ``crane_lifts``.
    """

    plan: LiftPlan
    preparation: Preparation
    starts: Mapping[int, CraneStart]

    @property
    def roots(self) -> tuple[object, ...]:
        """The site and what was prepared for it."""
        return self.plan.site, self.preparation

    @property
    def grounds(self) -> tuple[object, ...]:
        """All but the cranes of other parts, which may change."""
        return *self.plan.site.all_but_parts, self.preparation.contacts, self.preparation.places

    @cached_property
    def passed(self) -> Sequence[tuple[int, bool]]:
        """By order, the component, and whether it is set."""
        return [(lift.component, lift.is_set) for lift in self.plan.lifts]

    @cached_property
    def begun(self) -> frozenset[int]:
        """Orders of the lifts that have begun."""
        return frozenset(order for start in self.starts.values() for order in start.motions)

    @cached_property
    def _last(self) -> Mapping[int, int]:
        """By crane, the order of its last lift."""
        planned = [lift for lift in self.plan.lifts if lift.status is Status.PLANNED]
        return {crane: lift.order for lift in planned for crane in self._cranes(lift)}

    @cached_property
    def _lying(self) -> Shared:
        """How all parts lie or are set."""
        return Shared(tuple((one.component, one.status, one.by_other_means, one.place) for one in self.plan.lifts))

    def _cranes(self, lift: Lift) -> tuple[int, ...]:
        return cranes_of(self.plan.site.components[lift.component])

    def all(self, carried: Sequence[Carried], store: Store, workers: Workers) -> dict[tuple[int, int], Legs]:
        """Return the legs by order of their lifts, and crane.

        Raises MotionError: if the hook cannot get to a part; names the first such lift.
        """
        sought = [
            _Sought(one.lift.order, one.crane, tuple(carried[m] for m in seen))
            for one, seen in zip(carried, self._seen(carried), strict=True)
            if one.lift.order not in self.begun or self._leaves(one)
        ]
        by_order = dict[tuple[int, int], Legs]()
        for one, legs in zip(sought, self.results(sought, store, workers), strict=True):
            if isinstance(legs, MotionError):
                raise legs
            by_order[one.order, one.crane] = legs
        return by_order

    def every_parking(self, carried: Sequence[Carried], order: int, crane: int) -> tuple[Parking, ...]:
        """Return all parking places of a crane on the way to a lift, with legs between them."""
        every = zip(carried, self._seen(carried), strict=True)
        seen = next(seen for one, seen in every if (one.lift.order, one.crane) == (order, crane))
        (legs,) = self.steps([_Sought(order, crane, tuple(carried[n] for n in seen), every_place=True)])
        assert isinstance(legs, Legs)
        return legs.parkings

    def begin(self) -> _Stand:
        """Return the site before the first lift."""
        return _Stand(Assembly(self.plan.site, self.preparation))

    def go_past(self, state: _Stand, turn: int, until: int) -> None:
        """Set the part of a lift, or leave it in the yard; its rule is kept if its crane goes on from there."""
        lift = self.plan.lifts[turn]
        state.assembly.skip(lift.component)
        between = [one for one in self.plan.lifts[turn + 1 : until] if one.status is Status.PLANNED]
        busy = {crane for one in between for crane in self._cranes(one)}
        is_last = not busy.issuperset(self._cranes(lift))
        if turn == max(self.begun, default=-1) or (lift.status is Status.PLANNED and is_last):
            space = self._space_of(state.assembly, lift) if state.here is None else state.here
            for crane in self._cranes(lift):
                state.spaces[crane] = space
            if turn in self.begun:
                state.since = lift, space
        state.here = None
        state.assembly.finish(lift.component, placed=lift.is_set)

    def turn_of(self, task: _Sought) -> int:
        """Return the order of the lift."""
        return task.order

    def read(self, task: _Sought) -> tuple[object, ...]:
        """Return the lifts that its legs depend on, how all parts lie, and from where cranes continue."""
        starts = tuple(start for _, start in sorted(self.starts.items()))
        leaves = [self._leaves(one) for one in task.seen if (one.lift.order, one.crane) == (task.order, task.crane)]
        return task, self._lying, starts, leaves

    def step(self, state: _Stand, task: _Sought) -> Legs | MotionError:
        """Return the legs to a lift."""
        order, crane, seen, every_place = task
        own = next(one for one in seen if (one.lift.order, one.crane) == (order, crane))
        earlier = [one for one in seen if one.lift.order < order]
        last = {one.crane: one for one in earlier}
        state.assembly.skip(own.lift.component)
        state.here = space = self._space_of(state.assembly, own.lift)
        was = last.pop(own.crane, None)
        between = [one for one in earlier if was is None or one.lift.order > was.lift.order]
        near = [last[number] for number in sorted(last)]
        maker = self._maker(own, between, near, every_place=every_place)
        try:
            legs = self._legs(state, own, was, maker)
        except MotionError as error:
            return error
        if self._leaves(own):
            after = [one for one in seen if one.lift.order > order]
            leaving = self._maker(own, after, []).left(LastLift(own.lift, space, own.left_rad))
            return replace(legs, leaves=leaving)
        return legs

    def _seen(self, carried: Sequence[Carried]) -> Iterator[list[int]]:
        """Yield the numbers of the lifts that the legs to each lift depend on, its own included."""
        last: dict[int, int] = {}
        for n, one in enumerate(carried):
            until = len(carried) if self._leaves(one) else n + 1
            yield sorted({*last.values(), *range(last.get(one.crane, 0), until)})
            last[one.crane] = n

    def _leaves(self, one: Carried) -> bool:
        """Return whether a lift is its crane's last one, and its hook is where it leaves its part."""
        start = self.starts.get(one.crane)
        is_there = one.lift.order not in self.begun or start is None or start.axes is None
        return is_there and self._last[one.crane] == one.lift.order

    def _legs(self, state: _Stand, own: Carried, was: Carried | None, maker: LegMaker) -> Legs:
        assert state.here is not None
        if own.lift.order in self.begun:
            return Legs(None, None, (), own.hooked_rad)
        start = self.starts.get(own.crane)
        is_first = was is None or was.lift.order in self.begun
        if start is not None and start.axes is not None and is_first:
            return legs_from_there(maker, state.here, start.axes, state.since)
        before = None if was is None else LastLift(was.lift, state.spaces[own.crane], was.left_rad)
        return maker.made(state.here, before)

    def _maker(
        self, own: Carried, between: Sequence[Carried], near: Sequence[Carried], *, every_place: bool = False
    ) -> LegMaker:
        assert own.lift.place is not None
        plan = (
            self.plan
            if not has_tandems(self.plan.site)
            else replace(self.plan, site=seen_by(self.plan.site, own.crane))
        )
        return LegMaker(plan, own.crane, own.lift, own.lift.place, between, near, every_place=every_place)

    def _space_of(self, assembly: Assembly, lift: Lift) -> CollisionSpace:
        if lift.order in self.begun:  # its last moves are not cleared: it has left them, or it is on them
            return assembly.space(lift.component, lift.kept)
        return assembly.space_of(lift)


def _one_after_another(
    site: Site,
    carries: Sequence[LiftMotion],
    carried: Sequence[Carried],
    found: Mapping[tuple[int, int], Legs],
    begun: Collection[int],
    every_parking: Callable[[int, int], tuple[Parking, ...]],
) -> Iterator[CraneLift]:
    """Yield the lifts, with whole turns added so that each begins where its crane's lift before ends."""
    turns: dict[int, int] = {}
    for carry, one in zip(carries, carried, strict=True):
        order, before = one.lift.order, turns.get(one.crane, 0)
        legs = found.get((order, one.crane), Legs(None, None, (), one.hooked_rad))
        now = 0 if order in begun else before + round((legs.hooked_rad - one.hooked_rad) / (2.0 * np.pi))
        turns[one.crane] = now
        yield CraneLift(
            one.lift,
            one.crane,
            replace(carry, raising=turned(carry.raising, now), loaded=turned(carry.loaded, now)) if now else carry,
            _turned_leg(legs.early, before),
            _turned_leg(legs.late, before),
            _turned_parkings(legs.parkings, before),
            _turned_track(one.track, now),
            tuple(_turned(leg, now) for leg in legs.leaves),
            legs.starts_there,
            partial(_every_parking, every_parking, order, one.crane, before),
            one.other,
            one.other is not None and one.crane != site.components[one.lift.component].crane,
        )


def _every_parking(
    make: Callable[[int, int], tuple[Parking, ...]], order: int, crane: int, turns: int
) -> tuple[Parking, ...]:
    return _turned_parkings(make(order, crane), turns)


def _turned_leg(leg: Leg | None, turns: int) -> Leg | None:
    return None if leg is None else _turned(leg, turns)


def _turned_parkings(parkings: Sequence[Parking], turns: int) -> tuple[Parking, ...]:
    return tuple(
        Parking(
            _turned_leg(way.aside, turns),
            _turned(way.back, turns),
            tuple(tuple(_turned(leg, turns) for leg in legs) for legs in way.across),
        )
        for way in parkings
    )


def _turned(leg: Leg, turns: int) -> Leg:
    return replace(leg, trajectory=turned(leg.trajectory, turns)) if turns else leg


def _turned_track(track: CraneTrack, turns: int) -> CraneTrack:
    if not turns:
        return track
    more = np.zeros(COLUMNS)
    more[[SLEW_LOW, SLEW_HIGH]] = 2.0 * np.pi * turns
    return replace(track, spans=track.spans + more, first=track.first + more, last=track.last + more)
