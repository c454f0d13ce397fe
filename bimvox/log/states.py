"""The states of all components while a plan is carried out."""

from __future__ import annotations

from bisect import bisect_left
from collections import defaultdict
from collections.abc import Iterable

from bimvox.records.lift import Lift
from bimvox.records.motion import LiftMotion
from bimvox.records.track import LiftTimes
from bimvox.site.construction import ConstructionState

UNBUILT, ASSEMBLED = ConstructionState.UNBUILT, ConstructionState.ASSEMBLED


def states_before(lifts: Iterable[Lift], order: int) -> dict[int, ConstructionState]:
    """Return the states of all components when the lift of that order begins.

    Earlier lifts are assembled; the delivery of this lift lies in the yard. A delivery arrives when all lifts of the
    earlier ones are done, so the yard holds no other parts.
    """
    lifts = tuple(lifts)
    delivery = next((_delivery(lift) for lift in lifts if lift.order == order), None)
    states = {lift.component: _state_before(lift, order, delivery) for lift in lifts}
    return {component: state for component, state in states.items() if state is not None}


def states_at(
    lifts: Iterable[Lift], motions: Iterable[LiftMotion], tracks: Iterable[LiftTimes], time_ns: int
) -> dict[int, ConstructionState]:
    """Return the states of all components at a time on the site's clock.

    Args:
        lifts: All lifts of the plan.
        motions: Those of its motions whose time is known.
        tracks: The load tracks of the lifts under way at the time.
        time_ns: The time.
    """
    lifts, ordered = tuple(lifts), sorted(motions, key=lambda motion: (motion.start_ns, motion.order))
    begun = [motion for motion in ordered if motion.start_ns <= time_ns] or ordered[:1]
    if not begun:
        # Nothing has a time: show the finished plan.
        return {lift.component: ASSEMBLED for lift in lifts if lift.is_set}
    states = states_before(lifts, begun[-1].order)
    for motion in ordered:
        # With several cranes, a later lift in the order may end before an earlier one begins.
        if motion.end_ns <= time_ns:
            states[motion.component] = ASSEMBLED
        elif states.get(motion.component) is ASSEMBLED:
            states[motion.component] = UNBUILT
    for track in tracks:
        states[track.lift.component] = track.state_at(time_ns)
    return states


class StatesAtStarts:
    """The states of all components when one lift after another begins, as what may change since the one before.

    They are those of ``states_before``. With several cranes, earlier lifts in the order may still be under way, or
    begin later: a part whose lift has begun keeps the state that it has, and one whose lift begins later is unbuilt.

    Args:
        lifts: All lifts of the plan.
        tracks: The tracks of those with a time.
    """

    def __init__(self, lifts: Iterable[Lift], tracks: Iterable[LiftTimes]) -> None:
        self._lifts = sorted(lifts, key=lambda lift: lift.order)
        self._orders = [lift.order for lift in self._lifts]
        self._delivered: defaultdict[int | None, list[Lift]] = defaultdict(list)
        for lift in self._lifts:
            self._delivered[_delivery(lift)].append(lift)
        self._timed, self._begun = {track.lift.component for track in tracks}, set[int]()
        self._passed = 0
        self._delivery: int | None = None

    def begin(self, track: LiftTimes) -> dict[int, ConstructionState | None]:
        """Return the states that may have changed when a lift begins, by component; None: not delivered, or gone.

        Args:
            track: The lift's; the tracks are given by start, then by order.
        """
        order, delivery = track.lift.order, _delivery(track.lift)
        passed = bisect_left(self._orders, order)
        lifts = self._lifts[min(passed, self._passed) : max(passed, self._passed)]
        if delivery != self._delivery:
            lifts += self._delivered[self._delivery] + self._delivered[delivery]
        self._passed, self._delivery = passed, delivery
        self._begun.add(track.lift.component)
        changed = {}
        for lift in lifts:
            if lift.component not in self._begun:
                state = _state_before(lift, order, delivery)
                begins_later = state is ASSEMBLED and lift.component in self._timed
                changed[lift.component] = UNBUILT if begins_later else state
        return {**changed, track.lift.component: UNBUILT}


def _delivery(lift: Lift) -> int | None:
    return None if lift.place is None else lift.place.delivery


def _state_before(lift: Lift, order: int, delivery: int | None) -> ConstructionState | None:
    """Return the state of a lift's part when the lift of that order and delivery begins; None if it is not there."""
    if lift.order < order and lift.is_set:
        return ASSEMBLED
    in_yard = lift.in_yard
    return UNBUILT if in_yard is not None and in_yard.delivery == delivery else None
