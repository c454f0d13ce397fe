"""The lifts of several cranes before they are scheduled, made by several processes.

The carry of each lift is made by itself, from slewing angle 0. Then the legs of the empty hooks are made, which depend
on the carries of other cranes, but not on other legs. At the end whole turns are added, so that each lift begins where
its crane's lift before ends.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from bimvox.crane.conflict import COLUMNS, SLEW_HIGH, SLEW_LOW, CraneTrack
from bimvox.cranes.clock import insist_on_room
from bimvox.cranes.known_lifts import KnownLifts
from bimvox.cranes.legs import CraneStart, LastLift, LegMaker, legs_from_there
from bimvox.cranes.lift import Carried, CraneLift, Leg, Legs, Parking
from bimvox.cranes.track import carrying_track
from bimvox.errors import MotionError
from bimvox.motion.time_plan import each_by_itself
from bimvox.motion.trajectories import turned
from bimvox.planning.assembly import Assembly
from bimvox.planning.preparation import Preparation
from bimvox.records.lift import Lift, LiftPlan, Status
from bimvox.records.motion import LiftMotion
from bimvox.site.collision import CollisionSpace
from bimvox.site.site import Site
from bimvox.workers import ALONE, Workers, in_chunks

NOWHERE: Mapping[int, CraneStart] = {}
"""Where cranes continue from in a plan that is not being carried out."""


def crane_lifts(
    plan: LiftPlan,
    preparation: Preparation,
    known: KnownLifts | None = None,
    starts: Mapping[int, CraneStart] = NOWHERE,
    workers: Workers = ALONE,
) -> tuple[CraneLift, ...]:
    """Return the lifts of several cranes, for every planned lift, in order.

    Args:
        plan: The plan, of a site with several cranes.
        preparation: What was prepared for the site.
        known: What is known from earlier plans of the same site, which may differ in who lifts a part; what is made is
            added. None if the plan is being carried out.
        starts: Where every crane continues from, by its number, if the plan is being carried out. Of lifts that have
            begun, only the tracks are made.
        workers: Share the work.

    Raises:
        HookError: If a hook has no free path from where it is to its next part.
        MotionError: If a path is not free or cannot be driven, or the empty hook has no free path to a part.
        NoFreeTimeError: If a crane obstructs lifts of another one wherever it waits; names all of them.
    """
    begun = {order: motion for start in starts.values() for order, motion in start.motions.items()}
    known = KnownLifts() if known is None else known
    made = {motion.order: motion for motion in each_by_itself(plan, preparation, known, workers, begun)} | begun
    planned = [lift for lift in plan.lifts if lift.status is Status.PLANNED]
    carries = [made[lift.order] for lift in planned]
    carried = [
        known.carried(lift, carry, partial(_carried, plan.site, lift, carry))
        for lift, carry in zip(planned, carries, strict=True)
    ]
    insist_on_room(plan.site, [one for one in carried if one.lift.order not in begun])
    making = _LegMaking(plan, preparation, starts)
    legs = making.shared(carried, workers, known)
    return tuple(_one_after_another(carries, carried, legs, begun, partial(making.every_parking, carried)))


def _carried(site: Site, lift: Lift, carry: LiftMotion) -> Carried:
    number = site.components[lift.component].crane
    track = carrying_track(site, site.cranes[number], lift, carry)
    return Carried(lift, number, track, float(carry.raising.slew_rad[0]), float(carry.loaded.slew_rad[-1]))


class _LegMaking:
    """Makes the legs to lifts of a plan; goes through it once if it is asked for lifts in ascending order.

    Args:
        plan: The plan.
        preparation: What was prepared for its site.
        starts: As for ``crane_lifts``.
    """

    def __init__(self, plan: LiftPlan, preparation: Preparation, starts: Mapping[int, CraneStart]) -> None:
        self._plan, self._preparation, self._starts = plan, preparation, starts
        self._begun = frozenset(order for start in starts.values() for order in start.motions)
        planned = [lift for lift in plan.lifts if lift.status is Status.PLANNED]
        self._last = {plan.site.components[lift.component].crane: lift.order for lift in planned}
        self._begin()

    def __reduce__(self) -> tuple[Any, ...]:
        """Return how another process begins it anew."""
        return _LegMaking, (self._plan, self._preparation, self._starts)

    def shared(self, carried: Sequence[Carried], workers: Workers, known: KnownLifts) -> dict[int, Legs]:
        """Return the legs by order of their lifts; those that are not known are made, shared between processes.

        Raises:
            MotionError: If the hook cannot get to a part; names the first such lift.
        """
        orders, seen = [one.lift.order for one in carried], list(self._seen(carried))
        wanted = [n for n, one in enumerate(carried) if orders[n] not in self._begun or self._leaves(one)]
        by_order = {orders[n]: known.legs(orders[n], [carried[m] for m in seen[n]]) for n in wanted}
        missing = [n for n in wanted if by_order[orders[n]] is None]
        tasks = [
            (self, [orders[n] for n in chunk], [carried[m] for m in sorted({m for n in chunk for m in seen[n]})])
            for chunk in in_chunks(missing, workers.count)
        ]
        with workers.knowing(self):
            found = [legs for part in workers.run(_LegMaking.made, tasks) for legs in part]
        for n, legs in zip(missing, found, strict=True):
            if isinstance(legs, MotionError):
                raise legs
            known.add_legs(orders[n], [carried[m] for m in seen[n]], legs)
            by_order[orders[n]] = legs
        return {order: legs for order, legs in by_order.items() if legs is not None}

    def every_parking(self, carried: Sequence[Carried], order: int) -> tuple[Parking, ...]:
        """Return all parking places on the way to a lift, with legs between them."""
        seen = next(seen for one, seen in zip(carried, self._seen(carried), strict=True) if one.lift.order == order)
        legs = self._made(order, [carried[n] for n in seen], every_place=True)
        assert isinstance(legs, Legs)
        return legs.parkings

    def made(self, orders: Sequence[int], seen: Sequence[Carried]) -> list[Legs | MotionError]:
        """Return the legs to lifts, given in ascending order; errors for those that the hook cannot get to.

        Args:
            orders: Orders of the lifts.
            seen: These lifts, and the others that their legs depend on, in order.
        """
        return [self._made(order, seen) for order in orders]

    def _seen(self, carried: Sequence[Carried]) -> Iterator[list[int]]:
        """Yield the numbers of the lifts that the legs to each lift depend on, its own included."""
        last: dict[int, int] = {}
        for n, one in enumerate(carried):
            until = len(carried) if self._leaves(one) else n + 1
            yield sorted({*last.values(), *range(last.get(one.crane, 0), until)})
            last[one.crane] = n

    def _leaves(self, one: Carried) -> bool:
        """Return whether a lift is its crane's last one, and its hook is where it leaves its part."""
        start = self._starts.get(one.crane)
        is_there = one.lift.order not in self._begun or start is None or start.axes is None
        return is_there and self._last[one.crane] == one.lift.order

    def _begin(self) -> None:
        self._assembly, self._next = Assembly(self._plan.site, self._preparation), 0
        self._spaces: dict[int, tuple[int, CollisionSpace]] = {}
        self._since: tuple[Lift, CollisionSpace] | None = None

    def _made(self, order: int, seen: Sequence[Carried], *, every_place: bool = False) -> Legs | MotionError:
        own = next(one for one in seen if one.lift.order == order)
        earlier = [one for one in seen if one.lift.order < order]
        last = {one.crane: one for one in earlier}
        self._go_to(order, [one.lift for one in last.values()])
        self._assembly.skip(own.lift.component)
        space = self._space_of(own.lift)
        was = last.pop(own.crane, None)
        between = [one for one in earlier if was is None or one.lift.order > was.lift.order]
        near = [last[number] for number in sorted(last)]
        maker = self._maker(own, between, near, every_place=every_place)
        try:
            legs = self._legs(own, was, space, maker)
        except MotionError as error:
            return error
        finally:
            self._finish(own.lift, space)
        if self._leaves(own):
            after = [one for one in seen if one.lift.order > order]
            leaving = self._maker(own, after, []).left(LastLift(own.lift, space, own.left_rad))
            return replace(legs, leaves=leaving)
        return legs

    def _legs(
        self,
        own: Carried,
        was: Carried | None,
        space: CollisionSpace,
        maker: LegMaker,
    ) -> Legs:
        if own.lift.order in self._begun:
            return Legs(None, None, (), own.hooked_rad)
        start = self._starts.get(own.crane)
        is_first = was is None or was.lift.order in self._begun
        if start is not None and start.axes is not None and is_first:
            return legs_from_there(maker, space, start.axes, self._since)
        before = None if was is None else LastLift(was.lift, self._spaces[own.crane][1], was.left_rad)
        return maker.made(space, before)

    def _maker(
        self, own: Carried, between: Sequence[Carried], near: Sequence[Carried], *, every_place: bool = False
    ) -> LegMaker:
        assert own.lift.place is not None
        return LegMaker(self._plan, own.crane, own.lift, own.lift.place, between, near, every_place=every_place)

    def _space_of(self, lift: Lift) -> CollisionSpace:
        if lift.order in self._begun:  # its last moves are not cleared: it has left them, or it is on them
            return self._assembly.space(lift.component, lift.kept)
        return self._assembly.space_of(lift)

    def _go_to(self, order: int, last: Sequence[Lift]) -> None:
        """Come to a lift, with the rules of the last lifts of all cranes before it."""
        known = {n for n, _ in self._spaces.values()}
        if order < self._next or any(lift.order < self._next and lift.order not in known for lift in last):
            self._begin()
        wanted = {lift.order for lift in last} | {max(self._begun, default=-1)}
        for lift in self._plan.lifts[self._next : order]:
            self._assembly.skip(lift.component)
            self._finish(lift, self._space_of(lift) if lift.order in wanted else None)

    def _finish(self, lift: Lift, space: CollisionSpace | None) -> None:
        if space is not None:
            self._spaces[self._plan.site.components[lift.component].crane] = lift.order, space
            if lift.order in self._begun:
                self._since = lift, space
        self._assembly.finish(lift.component, placed=lift.is_set)
        self._next = lift.order + 1


def _one_after_another(
    carries: Sequence[LiftMotion],
    carried: Sequence[Carried],
    found: Mapping[int, Legs],
    begun: Collection[int],
    every_parking: Callable[[int], tuple[Parking, ...]],
) -> Iterator[CraneLift]:
    """Yield the lifts, with whole turns added so that each begins where its crane's lift before ends."""
    turns: dict[int, int] = {}
    for carry, one in zip(carries, carried, strict=True):
        order, before = one.lift.order, turns.get(one.crane, 0)
        legs = found.get(order, Legs(None, None, (), one.hooked_rad))
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
            partial(_every_parking, every_parking, order, before),
        )


def _every_parking(make: Callable[[int], tuple[Parking, ...]], order: int, turns: int) -> tuple[Parking, ...]:
    return _turned_parkings(make(order), turns)


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
