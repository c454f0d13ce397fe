"""The timed lift plan: every lift's motion, each made by itself, on one site clock."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from typing import Any, NamedTuple

from bimvox.errors import InputError, MotionError
from bimvox.motion.time_lift import Begins, time_lift
from bimvox.motion.trajectories import chained
from bimvox.planning.assembly import Assembly
from bimvox.planning.preparation import Preparation
from bimvox.records.lift import Lift, LiftPlan, Status, same_lift
from bimvox.records.motion import LiftMotion, Trajectory
from bimvox.site.site import Site
from bimvox.workers import ALONE, Workers, in_chunks


class KnownMotions:
    """The motions of the last plan: another plan of the same site and yard does not make the same ones again.

    A motion is the same if it is of the same lift of the same crane after the same lift, and the parts before it are
    set, or not, as they were. Other parts may go to other cranes. Each is kept as it is made: from time 0 and slewing
    angle 0.
    """

    def __init__(self) -> None:
        self._left: list[tuple[int, bool]] = []
        self._motions: dict[int, tuple[Lift, Lift | None, LiftMotion]] = {}

    def turn_to(self, plan: LiftPlan) -> None:
        """Forget the motions before which any part is set that was not in the last plan, or the reverse."""
        left = [(lift.component, lift.is_set) for lift in plan.lifts]
        same = next((n for n, pair in enumerate(zip(self._left, left, strict=False)) if pair[0] != pair[1]), len(left))
        self._motions = {order: known for order, known in self._motions.items() if order <= same}
        self._left = left

    def motion(self, lift: Lift, before: Lift | None, crane: int) -> LiftMotion | None:
        """Return the motion of a crane's lift after another one; None if it is not known."""
        then, previous, motion = self._motions.get(lift.order, (None, None, None))
        is_same = motion is not None and motion.crane == crane and same_lift(then, lift) and same_lift(previous, before)
        return motion if is_same else None

    def add(self, lift: Lift, before: Lift | None, motion: LiftMotion) -> None:
        """Remember a motion."""
        self._motions[lift.order] = (lift, before, motion)


def time_plan(
    plan: LiftPlan, preparation: Preparation, known: KnownMotions | None = None, workers: Workers = ALONE
) -> tuple[LiftMotion, ...]:
    """Return the motion of every planned lift, in order.

    Each is made by itself, from time 0 and slewing angle 0, then moved to where and when the one before it ends.

    Args:
        plan: The plan; its site must have a crane.
        preparation: What was prepared for the site.
        known: Motions of earlier plans of the same site, which are not made again; those that are made are added.
        workers: Share the work.

    Returns:
        One motion per planned lift; the clock starts at 0 with the first.

    Raises:
        InputError: If the site has no crane.
        MotionError: If a path is not free or cannot be driven; names the first such lift.
    """
    site = plan.site
    if not site.cranes:
        raise InputError(
            "the site has no crane, so its lifts have no timed motion", hint="add [crane] to the site file"
        )
    return chained(each_by_itself(plan, preparation, KnownMotions() if known is None else known, workers))


def each_by_itself(
    plan: LiftPlan,
    preparation: Preparation,
    known: KnownMotions,
    workers: Workers = ALONE,
    but: Collection[int] = (),
) -> list[LiftMotion]:
    """Return the motion of every planned lift, in order, as ``LiftTimes`` makes it.

    Args:
        plan: The plan; its site must have a crane.
        preparation: As for ``time_plan``.
        known: As for ``time_plan``.
        workers: As for ``time_plan``.
        but: Orders of lifts whose motions are not needed.

    Raises:
        MotionError: If a path is not free or cannot be driven; names the first such lift.
    """
    site = plan.site
    known.turn_to(plan)
    pairs = [(lift, before) for lift, before in _with_the_one_before(plan) if lift.order not in but]
    cranes = [site.components[lift.component].crane for lift, _ in pairs]
    motions = [known.motion(*pair, crane) for pair, crane in zip(pairs, cranes, strict=True)]
    missing = [lift.order for (lift, _), motion in zip(pairs, motions, strict=True) if motion is None]
    found = dict(zip(missing, LiftTimes(site, preparation, plan.lifts).shared(missing, workers), strict=True))
    _LAST.clear()  # nobody goes on from there
    for lift, before in pairs:
        motion = found.get(lift.order)
        if isinstance(motion, LiftMotion):
            known.add(lift, before, motion)
    for motion in found.values():
        if isinstance(motion, MotionError):
            raise motion
    every = (found.get(lift.order, motion) for (lift, _), motion in zip(pairs, motions, strict=True))
    return [motion for motion in every if isinstance(motion, LiftMotion)]


def _with_the_one_before(plan: LiftPlan) -> Iterator[tuple[Lift, Lift | None]]:
    """Yield every planned lift, and the one before it; none with several cranes, whose hooks come from anywhere."""
    planned = [lift for lift in plan.lifts if lift.status is Status.PLANNED]
    return zip(planned, [None] * len(planned) if plan.site.has_several_cranes else [None, *planned], strict=False)


class KnownLegs(NamedTuple):
    """A lift, and what is known of its motion.

    Attributes:
        order: The lift, by its order.
        approach: The way of the empty hook to its part, from time 0; None if it is to be made.
        carrying: A motion that stays the same from hook on; None if it is to be made.
    """

    order: int
    approach: Trajectory | None = None
    carrying: LiftMotion | None = None


class LiftTimes:
    """Makes the motions of lifts of a plan, each at its own stage, from time 0 and slewing angle 0.

    With one crane they begin where the lift before ends; with several where the part is hooked on.

    It goes through the plan once if it is asked for lifts in ascending order, and goes on where the last one of the
    same site stands if the same parts are set before.

    Args:
        site: The site; it has a crane.
        preparation: What was prepared for it.
        lifts: The lifts of the plan by order, without those after the last one that it is asked for.
    """

    def __init__(self, site: Site, preparation: Preparation, lifts: Sequence[Lift]) -> None:
        self._site, self._preparation, self._lifts = site, preparation, tuple(lifts)
        self._assembly: Assembly | None = None
        self._next = 0

    def __reduce__(self) -> tuple[Any, ...]:
        """Return how another process begins it anew."""
        return LiftTimes, (self._site, self._preparation, self._lifts)

    def shared(self, orders: Sequence[int], workers: Workers) -> list[LiftMotion | MotionError]:
        """Return what ``made`` returns, with the work shared between processes."""
        tasks = [(self, [KnownLegs(order) for order in chunk]) for chunk in in_chunks(orders, workers.count)]
        with workers.knowing(self):
            return [motion for motions in workers.run(LiftTimes.made, tasks) for motion in motions]

    def made(self, lifts: Sequence[KnownLegs]) -> list[LiftMotion | MotionError]:
        """Return the motions of planned lifts, given in ascending order; errors for those that cannot be driven."""
        if lifts:
            self._take_over(lifts[0].order)
        return [self._made(lift) for lift in lifts]

    def _take_over(self, order: int) -> None:
        """Begin at a lift, or at an earlier one from which it can go on."""
        last = next(iter(_LAST), self)
        if last is not self and last._is_before(self, order):
            self._assembly, self._next, last._assembly = last._assembly, last._next, None
        elif self._assembly is None or order < self._next:
            self._assembly, self._next = Assembly(self._site, self._preparation, one_at_a_time=True), 0
        _LAST[:] = [self]

    def _is_before(self, other: LiftTimes, order: int) -> bool:
        """Return whether another one can go on from where this one stands."""
        if self._assembly is None or self._next > order:
            return False
        if other._site is not self._site or other._preparation is not self._preparation:
            return False
        own, its = self._lifts[: self._next], other._lifts[: self._next]
        return all((a.component, a.is_set) == (b.component, b.is_set) for a, b in zip(own, its, strict=True))

    def _made(self, known: KnownLegs) -> LiftMotion | MotionError:
        site, assembly, order = self._site, self._assembly, known.order
        assert assembly is not None
        for lift in self._lifts[self._next : order]:
            assembly.skip(lift.component)
            assembly.finish(lift.component, placed=lift.is_set)
        lift = self._lifts[order]
        before = None
        if not site.has_several_cranes:
            before = next((one for one in reversed(self._lifts[:order]) if one.status is Status.PLANNED), None)
        assembly.skip(lift.component)
        crane = site.cranes[site.components[lift.component].crane]
        try:
            begins = Begins(before, approach=known.approach, carrying=known.carrying)
            return time_lift(site, crane, lift, assembly.space_of(lift), begins)
        except MotionError as error:
            return error
        finally:
            assembly.finish(lift.component, placed=lift.is_set)
            self._next = order + 1


_LAST: list[LiftTimes] = []
"""The one that was asked last."""
