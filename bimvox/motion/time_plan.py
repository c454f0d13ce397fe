"""The timed lift plan: every lift's motion, each made by itself, on one site clock."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

from bimvox.errors import InputError, MotionError
from bimvox.motion.tandem import time_together
from bimvox.motion.time_lift import Begins, time_lift
from bimvox.motion.trajectories import chained
from bimvox.planning.assembly import Assembly
from bimvox.planning.preparation import Preparation
from bimvox.records.lift import Lift, LiftPlan, Status
from bimvox.records.motion import LiftMotion, Trajectory
from bimvox.site.site import Site
from bimvox.walk import Store, Walk
from bimvox.workers import ALONE, Workers


def time_plan(
    plan: LiftPlan, preparation: Preparation, store: Store | None = None, workers: Workers = ALONE
) -> tuple[LiftMotion, ...]:
    """Return the motion of every planned lift, in order.

    Each is made by itself, from time 0 and slewing angle 0, then moved to where and when the one before it ends.

    Args:
        plan: The plan; its site must have a crane.
        preparation: What was prepared for the site.
        store: Motions that were made before are not made again.
        workers: Share the work.

    Returns:
        One motion per planned lift; the clock starts at 0 with the first.

    Raises:
        InputError: If the site has no crane.
        MotionError: If a path is not free or cannot be driven; names the first such lift.
    """
    if not plan.site.cranes:
        raise InputError(
            "the site has no crane, so its lifts have no timed motion", hint="add [crane] to the site file"
        )
    return chained(each_by_itself(plan, preparation, store, workers))


def each_by_itself(
    plan: LiftPlan,
    preparation: Preparation,
    store: Store | None = None,
    workers: Workers = ALONE,
    but: Collection[int] = (),
) -> list[LiftMotion]:
    """Return the motion of every planned lift, in order, as ``MotionMaking`` makes it.

    Args:
        plan: The plan; its site must have a crane.
        preparation: As for ``time_plan``.
        store: As for ``time_plan``.
        workers: As for ``time_plan``.
        but: Orders of lifts whose motions are not needed.

    Raises:
        MotionError: If a path is not free or cannot be driven; names the first such lift.
    """
    wanted = [KnownLegs(lift.order) for lift in plan.lifts if lift.status is Status.PLANNED and lift.order not in but]
    making = MotionMaking(plan.site, preparation, plan.lifts)
    motions = []
    for found in making.results(wanted, Store() if store is None else store, workers):
        if isinstance(found, MotionError):
            raise found
        motions.append(found)
    return motions


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


@dataclass(frozen=True, eq=False)
class MotionMaking(Walk[Assembly, KnownLegs, "LiftMotion | MotionError"]):
    """Makes the motions of planned lifts, each at its own stage, from time 0 and slewing angle 0.

    With one crane they begin where the lift before ends; with several where the part is hooked on. What cannot be
    driven is an error.

    Attributes:
        site: The site; it has a crane.
        preparation: What was prepared for it.
        lifts: The lifts of the plan by order, at least up to the last one that is asked for.
    """

    site: Site
    preparation: Preparation
    lifts: Sequence[Lift]

    @property
    def roots(self) -> tuple[object, ...]:
        """The site and what was prepared for it."""
        return self.site, self.preparation

    @property
    def grounds(self) -> tuple[object, ...]:
        """All but the cranes of other parts, which may change."""
        return *self.site.all_but_parts, self.preparation.contacts, self.preparation.places

    @cached_property
    def passed(self) -> Sequence[tuple[int, bool]]:
        """By order, the component, and whether it is set."""
        return [(lift.component, lift.is_set) for lift in self.lifts]

    def begin(self) -> Assembly:
        """Return the site before the first lift."""
        return Assembly(self.site, self.preparation, one_at_a_time=True)

    def go_past(self, state: Assembly, turn: int, until: int) -> None:
        """Set the part of a lift, or leave it in the yard."""
        lift = self.lifts[turn]
        state.skip(lift.component)
        state.finish(lift.component, placed=lift.is_set)

    def turn_of(self, task: KnownLegs) -> int:
        """Return the order of the lift."""
        return task.order

    def read(self, task: KnownLegs) -> tuple[object, ...]:
        """Return the lift, the one before it, and which crane lifts it."""
        lift = self.lifts[task.order]
        return task, lift, self._one_before(lift), self.site.components[lift.component].crane

    def step(self, state: Assembly, task: KnownLegs) -> LiftMotion | MotionError:
        """Return the motion of a lift."""
        lift = self.lifts[task.order]
        state.skip(lift.component)
        component = self.site.components[lift.component]
        crane = self.site.cranes[component.crane]
        begins = Begins(self._one_before(lift), approach=task.approach, carrying=task.carrying)
        try:
            if component.tandem is not None:
                return time_together(self.site, lift, state.space_of(lift))
            return time_lift(self.site, crane, lift, state.space_of(lift), begins)
        except MotionError as error:
            return error

    def _one_before(self, lift: Lift) -> Lift | None:
        """Return the planned lift before; none with several cranes, whose hooks come from anywhere."""
        if self.site.has_several_cranes:
            return None
        found = next((one for one in reversed(self.lifts[: lift.order]) if one.status is Status.PLANNED), None)
        cranes = (self.site.components[one.component].crane for one in (lift, found) if one is not None)
        return found if len(set(cranes)) == 1 else None  # it has moved in between
