"""The current plan, proven, with all that a revision needs to know about it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from bimvox.planning.propose import Propose
from bimvox.proof.footprint import Footprint, MotionFootprint, motion_footprint, path_footprint
from bimvox.records.lift import LiftPlan, Status
from bimvox.records.motion import LiftMotion
from bimvox.revision.footprints import Footprints
from bimvox.revision.held_cranes import HeldCranes
from bimvox.revision.obstruction_change import ObstructionChange
from bimvox.revision.recall import Memory
from bimvox.stop.redirect import Held, Redirected


@dataclass(frozen=True, slots=True, eq=False)
class CurrentPlan:
    """The current plan: every lift is proven, except those that are pending.

    Attributes:
        plan: Site and lifts, in ascending order; a pending lift already has its path, unless it is undecided.
        motions: By order; none on a site without a crane.
        path_footprints: Footprints of the planned lifts' paths, by order.
        motion_footprints: Footprints of their motions, by order.
        examined: The cells that made lifts infeasible, by order; an infeasible lift without an entry is tried again
            at every change.
        pending: Orders of the planned lifts that are not timed and proven yet.
        undecided: Of these, the lifts that a change affects and that still have the path of before it: the next part
            keeps them, gives them another path, or finds them infeasible.
        memory: Earlier versions of lifts that were changed.
        held: The cranes, if they are stopped because a load has no free path; all later lifts are pending.
    """

    plan: LiftPlan
    motions: Mapping[int, LiftMotion]
    path_footprints: Mapping[int, Footprint]
    motion_footprints: Mapping[int, MotionFootprint]
    examined: Mapping[int, Footprint] = field(default_factory=dict)
    pending: frozenset[int] = frozenset()
    undecided: frozenset[int] = frozenset()
    memory: Memory = field(default_factory=dict)
    held: HeldCranes | None = None

    @property
    def held_loads(self) -> tuple[Held, ...]:
        """The loads on the hooks of held cranes."""
        return () if self.held is None else self.held.loads

    @property
    def on_the_clock(self) -> Mapping[int, LiftMotion]:
        """The motions whose time is known, by order: those before the first pending lift."""
        first = min(self.pending, default=None)
        if first is None:
            return self.motions
        return {order: motion for order, motion in self.motions.items() if order < first}

    @property
    def chain(self) -> tuple[LiftMotion, ...]:
        """All motions, in order."""
        return tuple(self.motions[order] for order in sorted(self.motions))


@dataclass(frozen=True, slots=True)
class RetrainedPolicy:
    """A policy that was trained further.

    Attributes:
        components: The components whose lifts it was trained for.
        propose: The policy.
    """

    components: frozenset[int]
    propose: Propose


@dataclass(frozen=True, slots=True, eq=False)
class RevisionPart:
    """A part of a revision, proven.

    Attributes:
        current: The plan after it.
        made: Orders of the lifts whose path, motion or verdict is new in this part, ascending.
        replanned: Of these, those with a new path.
        retimed: Of these, those that keep their path and have a new motion.
        change: What changed about the obstructions; empty in later parts.
        stops: The lifts under way that were stopped, each redirected or held.
    """

    current: CurrentPlan
    made: tuple[int, ...]
    replanned: tuple[int, ...]
    retimed: tuple[int, ...]
    change: ObstructionChange
    stops: tuple[Redirected | Held, ...] = ()

    def make_footprints(self) -> None:
        """Make the footprints of its new lifts: the next revision needs them, and nobody before."""
        for footprints in (self.current.path_footprints, self.current.motion_footprints):
            if isinstance(footprints, Footprints):
                footprints.make_all()


def current_plan_of(plan: LiftPlan, motions: Iterable[LiftMotion]) -> CurrentPlan:
    """Return a proven plan with its footprints; infeasible lifts are tried again at the next change.

    A planned lift without a path, or without a motion on a site with a crane, is pending.
    """
    by_order = {motion.order: motion for motion in motions}
    paths, moved, pending = {}, {}, set()
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
            moved[lift.order] = motion_footprint(plan.site, lift, motion)
    return CurrentPlan(plan, by_order, paths, moved, pending=frozenset(pending))
