"""What is known of several cranes' lifts from the last plan of their site."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from bimvox.cranes.lift import Carried, Legs
from bimvox.motion.time_plan import KnownMotions
from bimvox.records.lift import Lift, LiftPlan, Status, YardPlace
from bimvox.records.motion import LiftMotion


class KnownLifts(KnownMotions):
    """The motions of the last plan, its tracks, and the legs of its empty hooks, none of which is made again.

    Legs are the same if the carries that they depend on are the same, and all parts lie, and are set or not, as they
    were; a leg does not depend on which crane lifts the other parts.
    """

    def __init__(self) -> None:
        super().__init__()
        self._stand: list[tuple[int, Status, bool, YardPlace | None]] = []
        self._carried: dict[int, tuple[LiftMotion, Carried]] = {}
        self._legs: dict[int, tuple[tuple[Carried, ...], Legs]] = {}

    def turn_to(self, plan: LiftPlan) -> None:
        """Forget the motions that are others in this plan, and all legs if a part lies or is set otherwise."""
        super().turn_to(plan)
        stand = [(lift.component, lift.status, lift.by_other_means, lift.place) for lift in plan.lifts]
        if stand != self._stand:
            self._stand = stand
            self._legs.clear()

    def carried(self, lift: Lift, motion: LiftMotion, make: Callable[[], Carried]) -> Carried:
        """Return a lift with its track, made if it is not known of this motion."""
        known = self._carried.get(lift.order)
        if known is None or known[0] is not motion:
            known = self._carried[lift.order] = motion, make()
        return known[1]

    def legs(self, order: int, seen: Sequence[Carried]) -> Legs | None:
        """Return the legs to a lift, given the lifts that they depend on; None if they are not known."""
        then, legs = self._legs.get(order, ((), None))
        return legs if len(then) == len(seen) and all(a is b for a, b in zip(then, seen, strict=True)) else None

    def add_legs(self, order: int, seen: Sequence[Carried], legs: Legs) -> None:
        """Remember the legs to a lift."""
        self._legs[order] = tuple(seen), legs
