"""The current plan, proven, and the change that it is to be revised for."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bimvox.grid.bricks import distinct
from bimvox.grid.frame import NO_CELLS
from bimvox.planning.preparation import Preparation
from bimvox.planning.stage import Propose
from bimvox.proof.footprint import MotionFootprint
from bimvox.records.lift import Lift, LiftPlan, Status
from bimvox.records.motion import LiftMotion, Trajectory
from bimvox.revision.versions import Reading, Version, Versions, make_footprints, obstructed_cells, version_of
from bimvox.site.site import Site
from bimvox.stop.redirect import HOLD_S, Held, Redirected, is_set
from bimvox.workers import ALONE, Workers


@dataclass(frozen=True, slots=True, eq=False)
class HookWay:
    """A move of an empty hook that has begun.

    Attributes:
        start_ns: When it began, on the site's clock.
        way: Its samples, from 0, to where the hook is at rest.
        stopped_ns: When the crane began to brake, on the site's clock; None if the hook completes the move.
        is_free: Whether the hook, including its swing, met nothing while it stopped.
    """

    start_ns: int
    way: Trajectory
    stopped_ns: int | None = None
    is_free: bool = True

    @property
    def end_ns(self) -> int:
        """When the hook is at rest."""
        return self.start_ns + int(self.way.time_ns[-1])


@dataclass(frozen=True, slots=True, eq=False)
class HeldHook:
    """The position of a crane.

    Attributes:
        crane: Its number.
        stands: Slew (rad), radius (m) and height (m) at the start of the clock.
        ways: Moves of its empty hook since its last lift was hooked on or done, in order.
    """

    crane: int
    stands: tuple[float, float, float]
    ways: tuple[HookWay, ...]


@dataclass(frozen=True, slots=True, eq=False)
class HeldCranes:
    """The cranes of a site while loads are held; one may still complete an earlier lift.

    Attributes:
        loads: The loads on their hooks, in order.
        hooks: Positions of the cranes; empty if there is only one (its load gives its position).
    """

    loads: tuple[Held, ...]
    hooks: tuple[HeldHook, ...] = ()

    @property
    def orders(self) -> frozenset[int]:
        """Orders of the lifts whose loads are on the hooks."""
        return frozenset(load.lift.order for load in self.loads)


@dataclass(frozen=True, slots=True, eq=False)
class ObstructionChange:
    """The difference between the obstructions of two sites with the same fixed part.

    Attributes:
        added: (N, 3) int32 cells that an obstruction occupies now and none did before, whatever else occupies them.
        removed: (M, 3) int32 cells that an obstruction occupied before and none does now.
        ids: Ids of the obstructions that were added, removed, or changed.
    """

    added: NDArray[np.int32]
    removed: NDArray[np.int32]
    ids: frozenset[str]

    @property
    def cells(self) -> int:
        """Number of cells that changed."""
        return len(self.added) + len(self.removed)


def change_between(before: Site, after: Site) -> ObstructionChange:
    """Return the difference between the obstructions of two sites."""
    old, new = _obstructions(before), _obstructions(after)
    ids = {name for name in old.keys() | new.keys() if not _same(old.get(name), new.get(name))}
    if not ids:
        return ObstructionChange(NO_CELLS, NO_CELLS, frozenset())
    there, here = _flat(old, after.shape), _flat(new, after.shape)
    return ObstructionChange(
        _cells(np.setdiff1d(here, there, assume_unique=True), after.shape),
        _cells(np.setdiff1d(there, here, assume_unique=True), after.shape),
        frozenset(ids),
    )


def _obstructions(site: Site) -> dict[str, NDArray[np.int32]]:
    return {blocker.id: blocker.cells for blocker in site.blockers if blocker.kind == "obstruction"}


def _same(one: NDArray[np.int32] | None, other: NDArray[np.int32] | None) -> bool:
    return one is not None and other is not None and np.array_equal(one, other)


def _flat(obstructions: dict[str, NDArray[np.int32]], shape: tuple[int, int, int]) -> NDArray[np.int64]:
    """Return (N,) int64 flat indices of all cells, ascending, without duplicates."""
    if not obstructions:
        return np.zeros(0, np.int64)
    cells = np.concatenate(list(obstructions.values())).astype(np.int64)
    return distinct((cells[:, 0] * shape[1] + cells[:, 1]) * shape[2] + cells[:, 2])


def _cells(flat: NDArray[np.int64], shape: tuple[int, int, int]) -> NDArray[np.int32]:
    return np.stack(np.unravel_index(flat, shape), axis=1).astype(np.int32)


@dataclass(frozen=True, slots=True, eq=False)
class CurrentPlan:
    """The current plan: every lift is proven, except those that are pending.

    Attributes:
        plan: Site and lifts, in ascending order; a pending lift already has its path, unless it is undecided.
        motions: By order; none on a site without a crane.
        versions: What was proven of lifts; an infeasible lift without a version is tried again at every change.
        pending: Orders of the planned lifts that are not timed and proven yet.
        undecided: Of these, the lifts that a change affects and that still have the path of before it: the next part
            keeps them, gives them another path, or finds them infeasible.
        held: The cranes, if they are stopped because a load has no free path; all later lifts are pending.
    """

    plan: LiftPlan
    motions: Mapping[int, LiftMotion]
    versions: Versions = field(default_factory=dict)
    pending: frozenset[int] = frozenset()
    undecided: frozenset[int] = frozenset()
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

    def swept_by(self, order: int) -> MotionFootprint:
        """Return what the motion of a lift sweeps, which is proven and on the clock."""
        swept = self.versions[order][0].swept
        assert swept is not None
        return swept()

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
        make_footprints(self.current.versions)


def current_plan_of(plan: LiftPlan, motions: Iterable[LiftMotion]) -> CurrentPlan:
    """Return a proven plan with its footprints; infeasible lifts are tried again at the next change.

    A planned lift without a path, or without a motion on a site with a crane, is pending.
    """
    by_order = {motion.order: motion for motion in motions}
    versions, pending, read = dict[int, tuple[Version, ...]](), set[int](), Reading(obstructed_cells(plan.site))
    for lift in plan.lifts:
        motion = by_order.get(lift.order)
        if lift.status is Status.PLANNED and (lift.path_vox is None or (plan.site.cranes and motion is None)):
            pending.add(lift.order)
        elif lift.status is Status.PLANNED:
            versions[lift.order] = (version_of(plan.site, lift, read, motion),)
        read = read.after(lift, is_set=lift.is_set)
    make_footprints(versions)  # here, so that nobody waits for them when something changes
    return CurrentPlan(plan, by_order, versions, frozenset(pending))


@dataclass(frozen=True, slots=True, eq=False)
class RevisionRequest:
    """What to revise a plan for, and how.

    Attributes:
        site: The same site with its current obstructions.
        preparation: What was prepared for it.
        propose: The policy; None for search without a policy.
        first: How many new lifts the first part contains; the rest follows in larger parts. With several cranes there
            is one part.
        now_ns: The time on the site's clock if the plan is being carried out, otherwise None. What was done until then
            stays as driven; a load under way that the change meets is stopped, and continues from where it is.
        hold_s: The shortest time for which a stopped load is held.
        retrained: A policy that was trained further, asked again for some lifts; its paths are taken if they are proven
            and no longer.
        workers: Share the work.
    """

    site: Site
    preparation: Preparation
    propose: Propose | None = None
    first: int = 20
    now_ns: int | None = None
    hold_s: float = HOLD_S
    retrained: RetrainedPolicy | None = None
    workers: Workers = ALONE


def last_finished(current: CurrentPlan, now_ns: int | None) -> int:
    """Return the order of the last lift that is done or was skipped; -1 if there is none.

    Later lifts have not begun, or are under way.

    ``now_ns``: the time on the site's clock; None if the plan is not being carried out.
    """
    if now_ns is None:
        return -1
    last = -1 if current.held is None else current.held.loads[0].lift.order - 1
    for order, motion in current.on_the_clock.items():
        if is_set(motion, now_ns):
            last = max(last, order)
        elif motion.start_ns < now_ns:
            last = max(last, order - 1)
    return last


def motion_under_way(current: CurrentPlan, lift: Lift, now_ns: int | None) -> LiftMotion | None:
    """Return the motion of a lift that is not done, if it is under way; otherwise None.

    ``now_ns``: the time on the site's clock; None if the plan is not being carried out.
    """
    if current.held is not None:
        held = current.held.loads[0]
        return held.motion if held.lift.order == lift.order else None
    if now_ns is None:
        return None
    motion = current.on_the_clock.get(lift.order)
    return motion if motion is not None and motion.start_ns < now_ns else None
