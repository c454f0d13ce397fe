"""What is on the site during the moves of an empty hook, if several cranes work in parallel.

Between two lifts of a crane, other cranes pick parts from the yard and set them. So what is present depends on the
time; it is derived from the motions.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import NamedTuple

import numpy as np

from bimvox.proof.moment import NO_SOLID, Moment, Thing, fixed_things, set_thing, stored_thing
from bimvox.records.lift import Lift, LiftPlan, Status
from bimvox.records.motion import LiftMotion, PhaseName, Trajectory
from bimvox.site.component import Component
from bimvox.site.site import Site


class EmptyWay(NamedTuple):
    """A move of the empty hook.

    Attributes:
        what: Name of the move, for messages.
        way: Its samples.
        left: The part at whose place it starts; None if it starts elsewhere.
        present: What may be on the site during the move.
    """

    what: str
    way: Trajectory
    left: Component | None
    present: tuple[Thing, ...]


def one_way(site: Site, moment: Moment, motion: LiftMotion) -> tuple[EmptyWay, ...]:
    """Return the approach of a site's only crane, with what is on the site when the hook leaves the part before."""
    if motion.approach is None or moment.before is None:
        return ()
    arrived = set(moment.arrived)
    present = tuple(thing for thing in moment.present if thing not in arrived) if arrived else moment.present
    place = moment.lift.place
    if place is not None:
        own = place.shape.cells + np.array(place.cell_vox, np.int32)
        present = (*present, Thing(site.components[moment.lift.component].id, own, NO_SOLID))
    return (EmptyWay("approach", motion.approach, site.components[moment.before.component], present),)


class Turn(NamedTuple):
    """The times of a motion that decide where its part is, on the site's clock.

    Attributes:
        raised_ns: When it has left the yard.
        set_ns: When it is in place.
        released_ns: When its slings are off.
    """

    raised_ns: int
    set_ns: int
    released_ns: int


def turn_of(motion: LiftMotion) -> Turn:
    """Return the times of a motion."""
    return Turn(motion.raised_ns, motion.set_ns, motion.released_ns)


class Between:
    """Finds what is on the site during the empty hook moves of several cranes.

    Args:
        plan: The plan.
        turns: The times of the known motions, by order.
        context: Lifts that the plan does not contain.
    """

    def __init__(self, plan: LiftPlan, turns: Mapping[int, Turn], context: Collection[Lift]) -> None:
        self._site, self._turns = plan.site, turns
        self._lifts = sorted([*plan.lifts, *context], key=lambda lift: lift.order)
        self._fixed = fixed_things(plan.site)

    def before(self, lift: Lift) -> Lift | None:
        """Return the previous planned lift of the same crane."""
        crane = self._site.components[lift.component].crane
        found = None
        for other in self._lifts:
            if other.order >= lift.order:
                break
            if other.status is Status.PLANNED and self._site.components[other.component].crane == crane:
                found = other
        return found

    def ways(self, moment: Moment, motion: LiftMotion) -> Iterator[EmptyWay]:
        """Yield the empty hook moves of a lift, each with what may be on the site; ``moment`` is that of its crane."""
        components = self._site.components
        left = None if moment.before is None else components[moment.before.component]
        for what, name, whole, first in (
            ("approach", PhaseName.APPROACH, motion.approach, left),
            ("departure", PhaseName.LEAVE, motion.departure, components[moment.lift.component]),
        ):
            for n, (start_ns, end_ns, _) in enumerate(motion.ways_ns(name)):
                if whole is None:
                    continue  # inconsistent with the phases; another check reports it
                way = _cut(whole, start_ns - motion.start_ns, end_ns - motion.start_ns)
                if len(way.time_ns) >= 2:
                    yield EmptyWay(what, way, first if n == 0 else None, self._present(moment, start_ns, end_ns))

    def _present(self, moment: Moment, start_ns: int, end_ns: int) -> tuple[Thing, ...]:
        """Return what is on the site or in the yard at any time in a span.

        If the motion of a lift is unknown, its part is in place if it comes before the crane's last lift, and in the
        yard otherwise.
        """
        things = list(self._fixed)
        since = -1 if moment.before is None else moment.before.order
        first = self._delivery_at(start_ns, since)
        last = 0 if moment.lift.place is None else moment.lift.place.delivery
        for lift in self._lifts:
            turn = self._turns.get(lift.order)
            if lift.is_set and self._is_there(lift, turn, since, end_ns):
                things.append(set_thing(self._site, lift))
            if lift.in_yard is None or not first <= lift.in_yard.delivery <= max(last, first):
                continue
            planned = lift.status is Status.PLANNED
            lies = not planned or (lift.order > since if turn is None else turn.raised_ns > start_ns)
            if lift.is_set_otherwise:  # it leaves its stack when it is its turn
                lies = lift.order > moment.lift.order
            if lies:
                things.append(stored_thing(self._site, lift, lift.in_yard))
        return tuple(things)

    def _is_there(self, lift: Lift, turn: Turn | None, since: int, end_ns: int) -> bool:
        """Return whether a part may be in place before a time; by other means as soon as all earlier slings are off."""
        if turn is not None:
            return turn.set_ns < end_ns
        earlier = [one.order for one in self._lifts if one.order < lift.order and one.status is Status.PLANNED]
        if lift.order <= since or not lift.is_set_otherwise or any(order not in self._turns for order in earlier):
            return lift.order <= since
        return all(self._turns[order].released_ns < end_ns for order in earlier)

    def _delivery_at(self, at_ns: int, since: int) -> int:
        """Return the earliest delivery with a part that is not set yet."""
        left = [one.place.delivery for one in self._lifts if one.place and not self._is_over(one, at_ns, since)]
        return min(left, default=0)

    def _is_over(self, lift: Lift, at_ns: int, since: int) -> bool:
        """Return whether a lift no longer keeps its delivery in the yard."""
        if lift.status is not Status.PLANNED:
            return True
        turn = self._turns.get(lift.order)
        return lift.order <= since if turn is None else turn.released_ns <= at_ns


def _cut(way: Trajectory, start_ns: int, end_ns: int) -> Trajectory:
    inside = (way.time_ns >= start_ns) & (way.time_ns <= end_ns)
    no_corner = np.zeros(0, np.int64)
    return Trajectory(
        way.time_ns[inside], way.slew_rad[inside], way.radius_m[inside], way.height_m[inside], no_corner, way.bound_s
    )
