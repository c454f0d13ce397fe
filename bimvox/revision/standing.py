"""A proven plan that stands, with all that is needed to keep it true after a change."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from bimvox.planning.propose import Propose
from bimvox.proof.footprint import Footprint, motion_footprint, path_footprint
from bimvox.records.lift import LiftPlan, Status
from bimvox.records.motion import LiftMotion
from bimvox.revision.held_cranes import HeldCranes
from bimvox.revision.obstruction_change import ObstructionChange
from bimvox.revision.recall import Memory
from bimvox.stop.underway import Held, Redirected


@dataclass(frozen=True, slots=True, eq=False)
class Standing:
    """The plan that stands: every lift in it is proven, but for those that are pending.

    Attributes:
        plan: Site and lifts, ascending order; a pending lift has its path already.
        motions: By order; none on a site without a crane.
        paths: Footprints of the planned lifts' paths, by order.
        ways: Footprints of their motions, by order.
        examined: Of infeasible lifts, by order: the cells that decided; a lift that is missing is tried again whenever
            anything changes.
        pending: Orders of the planned lifts that are not timed and proven yet.
        memory: How lifts that were changed stood before.
        held: The lift under way that is stopped and finds no way on; all after it are pending.
        held_cranes: The same of several cranes: all of them.
    """

    plan: LiftPlan
    motions: Mapping[int, LiftMotion]
    paths: Mapping[int, Footprint]
    ways: Mapping[int, Footprint]
    examined: Mapping[int, Footprint] = field(default_factory=dict)
    pending: frozenset[int] = frozenset()
    memory: Memory = field(default_factory=dict)
    held: Held | None = None
    held_cranes: HeldCranes | None = None

    @property
    def waits(self) -> bool:
        """Whether a load on a hook finds no way on, so that all that is left waits for a change."""
        return self.held is not None or self.held_cranes is not None

    @property
    def held_loads(self) -> tuple[Held, ...]:
        """The lifts under way that are stopped and find no way on."""
        one = () if self.held is None else (self.held,)
        return one if self.held_cranes is None else (*one, *self.held_cranes.loads)

    @property
    def on_the_clock(self) -> Mapping[int, LiftMotion]:
        """The motions whose time is known, by order: from the first pending lift on it is not, whatever they say."""
        first = min(self.pending, default=None)
        if first is None:
            return self.motions
        return {order: motion for order, motion in self.motions.items() if order < first}

    @property
    def chain(self) -> tuple[LiftMotion, ...]:
        """All motions, in order."""
        return tuple(self.motions[order] for order in sorted(self.motions))


@dataclass(frozen=True, slots=True)
class Better:
    """A policy that was trained further.

    Attributes:
        components: The components for whose lifts.
        propose: The policy.
    """

    components: frozenset[int]
    propose: Propose


@dataclass(frozen=True, slots=True, eq=False)
class RevisedPart:
    """A plan revised as far as it is proven.

    Attributes:
        standing: What stands now.
        made: Orders of the lifts whose path, motion or verdict is new in this part, ascending.
        replanned: Of these, those with a new path.
        retimed: Of these, those that keep their path and have a new motion.
        change: What changed; nothing in later parts.
        redirected: The lift under way that was stopped or takes another way.
        stops: Of several cranes: every lift under way when they were stopped, with its way on, or held.
    """

    standing: Standing
    made: tuple[int, ...]
    replanned: tuple[int, ...]
    retimed: tuple[int, ...]
    change: ObstructionChange
    redirected: Redirected | None = None
    stops: tuple[Redirected | Held, ...] = ()


def standing_of(plan: LiftPlan, motions: Iterable[LiftMotion]) -> Standing:
    """Return a proven plan with its footprints; infeasible lifts will be tried again at the next change.

    A planned lift without a path, or without a motion where there is a crane, is pending.
    """
    by_order = {motion.order: motion for motion in motions}
    paths, ways, pending = {}, {}, set()
    for lift in plan.lifts:
        if lift.status is not Status.PLANNED:
            continue
        timed = lift.order in by_order
        if lift.path_vox is None or (plan.site.cranes and not timed):
            pending.add(lift.order)
            continue
        paths[lift.order] = path_footprint(plan.site, lift)
        if timed:
            motion = by_order[lift.order]
            ways[lift.order] = motion_footprint(plan.site, lift, motion)
    return Standing(plan, by_order, paths, ways, pending=frozenset(pending))
