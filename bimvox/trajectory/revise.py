"""A plan revised after a change of the obstructions: only the lifts that the change meets are made and proven again.

A lift whose footprint (``bimvox.trajectory.footprint``) no added cell is in keeps path, motion and proof. All others
are examined in order, each at its own stage:

- a planned lift that is met gets a new path, or a new motion where only that is met;
- an infeasible lift is tried again where the change touches what made it infeasible;
- a lift whose state changes from planned to infeasible or back changes what later lifts find: it stands at its place or
  lies in the yard. Those cells count as added and removed for the lifts after it, its neighbours are examined in any
  case (they may have leaned on it), and the next lift's empty hook starts elsewhere.

The first lifts come first: after so many lifts made anew the rest is planned only (that is the verdict), and is timed
and proven in the parts that follow.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace

from bimvox.errors import MotionError, VerificationError
from bimvox.planning.assembly import Assembly, Obstacle, Preparation, with_cleared
from bimvox.planning.insertion import SIDEWAYS_VOX
from bimvox.planning.lift import Epoch, Lift, LiftPlan, Status, same_path
from bimvox.planning.obstruction_change import ObstructionChange, change_between
from bimvox.planning.occupancy import stored_cells, target_cells
from bimvox.planning.planner import plan_lift, proposed_again
from bimvox.planning.proof import Verification
from bimvox.planning.propose import Propose
from bimvox.site.clearance import Clearance
from bimvox.site.site import Site
from bimvox.trajectory.footprint import (
    CellMask,
    Footprint,
    examined_by,
    jib_meets,
    motion_footprint,
    path_footprint,
)
from bimvox.trajectory.motion import LiftMotion
from bimvox.trajectory.over_time import verify_motions_over_time, verify_plan_over_time
from bimvox.trajectory.recall import Memory, Recall, Version, obstructed_cells, remembered
from bimvox.trajectory.shift import joined_on, waiting
from bimvox.trajectory.time_plan import time_lift
from bimvox.trajectory.timing import NS_PER_S
from bimvox.trajectory.underway import HOLD_S, Held, Redirected, is_set, redirect, release

_ROUNDS = 12  # of making and proving again without the lifts that failed their proof


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
    """

    plan: LiftPlan
    motions: Mapping[int, LiftMotion]
    paths: Mapping[int, Footprint]
    ways: Mapping[int, Footprint]
    examined: Mapping[int, Footprint] = field(default_factory=dict)
    pending: frozenset[int] = frozenset()
    memory: Memory = field(default_factory=dict)
    held: Held | None = None

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
class Part:
    """A plan revised as far as it is proven.

    Attributes:
        standing: What stands now.
        made: Orders of the lifts whose path, motion or verdict is new in this part, ascending.
        replanned: Of these, those with a new path.
        retimed: Of these, those that keep their path and have a new motion.
        change: What changed; nothing in later parts.
        redirected: The lift under way that was stopped or takes another way.
    """

    standing: Standing
    made: tuple[int, ...]
    replanned: tuple[int, ...]
    retimed: tuple[int, ...]
    change: ObstructionChange
    redirected: Redirected | None = None


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
        if lift.path_vox is None or (plan.site.crane is not None and not timed):
            pending.add(lift.order)
            continue
        paths[lift.order] = path_footprint(plan.site, lift)
        if timed:
            ways[lift.order] = motion_footprint(plan.site, lift, by_order[lift.order])
    return Standing(plan, by_order, paths, ways, pending=frozenset(pending))


def revise(
    standing: Standing,
    site: Site,
    preparation: Preparation,
    *,
    propose: Propose | None = None,
    first: int = 20,
    known_shapes: set[int] | None = None,
    on_verdict: Callable[[], None] | None = None,
    now_ns: int | None = None,
    hold_s: float = HOLD_S,
    better: Better | None = None,
) -> Iterator[Part]:
    """Revise a plan for a site with other obstructions.

    Args:
        standing: The plan that stands.
        site: The same site, obstructions aside.
        preparation: What was prepared for it.
        propose: The policy; None for search alone.
        first: How many lifts made anew a part holds; the rest follows in parts as large.
        known_shapes: See ``verify_plan``.
        on_verdict: Called whenever it is known which lifts can be planned.
        now_ns: Of a plan that is being carried out: the time on the site's clock. What was done until then stays as it
            was driven; a lift under way that the change meets is stopped and goes on from where it is.
        hold_s: How long a stopped load is held at least.
        better: A policy that was trained further, asked once more for some lifts; its paths are taken where they are
            proven and no longer.

    Yields:
        The plan in parts, the first lifts first; the last part has nothing pending.

    Raises:
        VerificationError: If a proof fails of which no lift is at fault.
    """
    change = change_between(standing.plan.site, site)
    shapes = set() if known_shapes is None else known_shapes
    while True:
        part = _proven_part(
            standing, site, preparation, propose, first, change, shapes, on_verdict, now_ns, hold_s, better
        )
        yield part
        standing, change = part.standing, change_between(site, site)
        if not standing.pending or standing.held is not None:
            return


def _proven_part(
    standing: Standing,
    site: Site,
    preparation: Preparation,
    propose: Propose | None,
    first: int,
    change: ObstructionChange,
    known_shapes: set[int],
    on_verdict: Callable[[], None] | None,
    now_ns: int | None,
    hold_s: float,
    better: Better | None,
) -> Part:
    refused: dict[str, str] = {}
    for _ in range(_ROUNDS):
        walk = _Walk(standing, site, preparation, propose, first, change, refused, now_ns, hold_s, better)
        walk.run()
        if on_verdict is not None:
            on_verdict()
        found = walk.prove(known_shapes)
        if not found:
            return walk.part()
        refused |= found
    raise VerificationError(
        f"after {_ROUNDS} rounds lifts still fail their proof, so nothing was changed",
        failures=[f"{component}: {reason}" for component, reason in refused.items()],
        hint="a finer [model] voxel_size_m, or other areas, may help",
    )


class _Walk:
    """One walk through the lifts in order; keeps what it makes."""

    def __init__(
        self,
        standing: Standing,
        site: Site,
        preparation: Preparation,
        propose: Propose | None,
        first: int,
        change: ObstructionChange,
        refused: Mapping[str, str],
        now_ns: int | None,
        hold_s: float,
        better: Better | None,
    ) -> None:
        self.was, self.site, self.preparation, self.propose = standing, site, preparation, propose
        self.first, self.change, self.refused = first, change, refused
        self.added, self.changed = CellMask(site.shape), CellMask(site.shape)
        self.added.add(change.added)
        self.changed.add(change.added)
        self.changed.add(change.removed)
        self.in_yard, self.delivery = CellMask(site.shape), -1
        self.lean_on: set[int] = set()
        self.lifts: list[Lift] = []
        self.motions: dict[int, LiftMotion] = {}
        self.examined: dict[int, Footprint] = {}
        self.new_paths: set[int] = set()
        self.new_motions: set[int] = set()
        self.new_verdicts: set[int] = set()
        self.recalled_paths: dict[int, Version] = {}
        self.recalled_motions: dict[int, Version] = {}
        self.pending: set[int] = set()
        self.recall = Recall(standing.memory, site)
        self.memory = dict(standing.memory)
        self.was_obstructed: CellMask | None = None
        self.done = 0
        self.now_ns, self.behind = now_ns, _behind(standing, now_ns)
        self.hold_s = hold_s
        self.better = better
        self.held: Held | None = None
        self.redirected: Redirected | None = None
        self.history = standing.plan.history
        if now_ns and change.ids:
            gone = tuple(blocker for blocker in standing.plan.site.blockers if blocker.kind == "obstruction")
            self.history = (*self.history, Epoch(now_ns, gone))

    def run(self) -> None:
        """Keep or make every lift."""
        assembly = Assembly(self.site, self.preparation, one_at_a_time=True)
        before: Lift | None = None
        was_before: int | None = None
        was_done = 0
        for was in self.was.plan.lifts:
            if was.place is not None and was.place.delivery != self.delivery:
                self.in_yard, self.delivery = CellMask(self.site.shape), was.place.delivery
            assembly.skip(was.component)
            if was.order <= self.behind:
                lift = self._as_driven(was)
            elif (motion := self._under_way(was)) is not None:
                lift = self._redirected(assembly, was, motion, before)
            else:
                lift, clearance = self._lift(assembly, was)
                same_start = (before.component if before else None) == was_before
                if lift.status is Status.PLANNED:
                    lift = self._timed(assembly, lift, was, before, clearance, same_start=same_start)
                self._follow_up(was, lift)
                self._remember(was, lift, was_done, was_before)
            if lift.status is Status.PLANNED:
                before = lift
            if self.held is None or self.held.lift.order != lift.order:  # a part that hangs on the hook is nowhere
                assembly.finish(lift.component, placed=lift.status is Status.PLANNED)
            self.lifts.append(lift)
            if lift.status is Status.PLANNED:
                self.done |= 1 << lift.order
            if was.status is Status.PLANNED:
                was_before = was.component
                was_done |= 1 << was.order

    def _as_driven(self, was: Lift) -> Lift:
        """Keep what is done, or was passed over."""
        if was.order in self.was.motions:
            self.motions[was.order] = self.was.motions[was.order]
        return was

    def _under_way(self, was: Lift) -> LiftMotion | None:
        """Return the motion of a lift that is under way."""
        held = self.was.held
        if held is not None:
            return held.motion if held.lift.order == was.order else None
        motion = self.was.motions.get(was.order)
        if self.now_ns is None or motion is None or not motion.start_ns < self.now_ns:
            return None
        return motion

    def _redirected(self, assembly: Assembly, was: Lift, motion: LiftMotion, before: Lift | None) -> Lift:
        """Keep the lift under way where the change does not meet what is left of it, else stop it and find a way on."""
        crane, held = self.site.crane, self.was.held
        assert crane is not None
        assert self.now_ns is not None
        lift = was if held is None else held.lift
        component = self.site.components[was.component]
        if held is None and not self._is_met(was, motion, self.now_ns) and component.id not in self.refused:
            self.motions[was.order] = motion
            return was
        assert lift.path_vox is not None
        last_vox = lift.path_vox[len(lift.path_vox) - 1 - lift.contact_moves :]
        rule, blocked = assembly.on_the_way(was.component, last_vox)
        if (reason := self.refused.get(component.id)) is not None:
            blocked = Obstacle(reason)
        if held is None:
            found = redirect(self.site, crane, lift, motion, before, rule, blocked, self.now_ns, self.hold_s)
        else:
            found = release(self.site, crane, held, rule, blocked, self.now_ns, self.hold_s)
        if isinstance(found, Held):
            self.held = found
            self.new_verdicts.add(was.order)
            return found.infeasible
        self.redirected = found
        self.new_paths.add(was.order)
        self.new_motions.add(was.order)
        self.motions[was.order] = found.motion
        return found.lift

    def _is_met(self, lift: Lift, motion: LiftMotion, now_ns: int) -> bool:
        if self.added.empty or is_set(motion, now_ns):
            return False
        rest = motion_footprint(self.site, lift, motion, now_ns)
        return self.added.meets(rest) or jib_meets(self.site, motion, self.change.added)

    def _lift(self, assembly: Assembly, was: Lift) -> tuple[Lift, Clearance | None]:
        """Return the lift, the earlier object itself where its path is kept; and its collision rule where known."""
        component = self.site.components[was.component]
        reason = self.refused.get(component.id)
        if self.better is not None and was.component in self.better.components and was.status is Status.PLANNED:
            reason = None  # only its better path was not proven; the one that it has is
        obstacle = Obstacle(reason) if reason is not None else assembly.unsupported(was.component)
        if obstacle is not None:
            if was.status is Status.INFEASIBLE and (was.reason, was.blocked_by) == (
                obstacle.reason,
                obstacle.blocked_by,
            ):
                return was, None
            return self._planned(assembly, obstacle, was), None
        if not self._must_be_examined(was):
            return self._asked_again(assembly, was)
        known = self.recall.path(was.order, self.done)
        if known is not None:
            self.new_paths.add(was.order)
            self.recalled_paths[was.order] = known
            return known.lift, None
        stage = assembly.begin(was.component)
        lift = self._planned(assembly, stage, was)
        if lift.status is Status.INFEASIBLE:
            if isinstance(stage, Obstacle) and was.place is not None:
                self.examined[was.order] = examined_by(self.site, component, was.place, SIDEWAYS_VOX)
            return lift, None
        assert not isinstance(stage, Obstacle)
        return lift, stage.clearance

    def _asked_again(self, assembly: Assembly, was: Lift) -> tuple[Lift, Clearance | None]:
        """Ask the policy that was trained further, where this lift is one that it was trained for."""
        better = self.better
        if better is None or was.component not in better.components or was.status is not Status.PLANNED:
            return was, None
        stage = assembly.begin(was.component)
        if isinstance(stage, Obstacle) or self.site.components[was.component].id in self.refused:
            return was, None
        lift = proposed_again(stage, was, better.propose)
        if lift is not was:
            self.new_paths.add(was.order)
        return lift, stage.clearance

    def _planned(self, assembly: Assembly, stage: object, was: Lift) -> Lift:
        before = was if was.status is Status.PLANNED else None
        lift = plan_lift(
            assembly,
            stage,  # type: ignore[arg-type]
            was.order,
            was.component,
            self.preparation,
            before,
            self.propose,
        )
        if lift.status is Status.PLANNED:
            self.new_paths.add(was.order)  # proven again in any case, also where it could be kept
        else:
            self.new_verdicts.add(was.order)
        return lift

    def _must_be_examined(self, was: Lift) -> bool:
        """Whether the change, or what became of an earlier lift, may touch this one's path or its infeasibility."""
        if was.component in self.lean_on:
            return True
        if self.pending and was.order in self.was.pending and was.path_vox is not None and not self.change.ids:
            return False  # its verdict is known, and its turn has not come yet
        if was.status is Status.INFEASIBLE:
            seen = self.was.examined.get(was.order)
            if seen is None:
                return bool(self.change.ids) or not self.changed.empty or not self.in_yard.empty
            touched = self.changed.meets(seen) or self.in_yard.meets(seen)
            if not touched:
                self.examined[was.order] = seen
            return touched or not self.change.ids.isdisjoint(was.blocked_by)
        path = self.was.paths.get(was.order)
        return path is None or self.added.meets(path) or self.in_yard.meets(path)

    def _timed(
        self,
        assembly: Assembly,
        lift: Lift,
        was: Lift,
        before: Lift | None,
        clearance: Clearance | None,
        *,
        same_start: bool,
    ) -> Lift:
        """Keep the lift's motion where that is proven still, else make a new one; infeasible where there is none."""
        crane, order = self.site.crane, lift.order
        if self.held is not None:
            self.pending.add(order)
            return lift
        made = len(self.new_paths - self.pending | self.new_motions)
        if self._keeps_motion(lift, was, same_start=same_start):
            if crane is not None:
                last = self.motions[before.order] if before is not None and before.order in self.motions else None
                kept = self.was.motions[order]
                # Behind a pending lift the clock is not known yet; the part after that sets it.
                self.motions[order] = kept if self.pending else self._in_time(joined_on(kept, last))
            return lift
        if self.pending or made > self.first - (order not in self.new_paths):
            self.pending.add(order)
            return lift
        if crane is None:
            return lift
        known = self.recall.motion(lift, self.done, before.component if before else None)
        if known is not None and known.motion is not None:
            last = self.motions[before.order] if before is not None else None
            self.motions[order] = self._in_time(joined_on(known.motion, last))
            self.new_motions.add(order)
            self.recalled_motions[order] = known
            return lift
        rule = _with_last_moves(clearance or assembly.clearance(lift.component), lift)
        last = self.motions[before.order] if before is not None else None
        try:
            made_now = time_lift(
                self.site,
                crane,
                lift,
                rule,
                before,
                last.end_ns if last else 0,
                float(last.loaded.slew_rad[-1]) if last else 0.0,
            )
            self.motions[order] = self._in_time(made_now)
        except MotionError as error:
            self.new_paths.discard(order)
            self.recalled_paths.pop(order, None)
            obstacle = Obstacle(f"the crane cannot drive its path: {error.message}")
            return self._planned(assembly, obstacle, was)
        self.new_motions.add(order)
        return lift

    def _in_time(self, motion: LiftMotion) -> LiftMotion:
        """A lift that is not under way does not begin in the past: where the crane stood idle, it waits until now."""
        if self.now_ns is None or motion.start_ns >= self.now_ns:
            return motion
        return waiting(motion, self.now_ns + round(self.hold_s * NS_PER_S) - motion.start_ns)

    def _keeps_motion(self, lift: Lift, was: Lift, *, same_start: bool) -> bool:
        if lift is not was or lift.order in self.new_paths or lift.order in self.was.pending:
            return False
        if self.site.crane is None:
            return True
        motion, way = self.was.motions.get(lift.order), self.was.ways.get(lift.order)
        if motion is None or way is None or not same_start:
            return False
        met = self.added.meets(way) or self.in_yard.meets(way)
        return not met and not jib_meets(self.site, motion, self.change.added)

    def _follow_up(self, was: Lift, lift: Lift) -> None:
        """Note what a lift that became infeasible, or possible again, changes for those after it."""
        if was.status is lift.status:
            return
        component = self.site.components[lift.component]
        target = target_cells(component)
        if lift.status is Status.PLANNED:
            self.added.add(target)
        elif lift.place is not None:
            self.in_yard.add(stored_cells(lift.place))
        self.changed.add(target)
        if lift.place is not None:
            self.changed.add(stored_cells(lift.place))
        neighbours = self.preparation.contacts.neighbours
        self.lean_on |= {n for n in range(len(self.site.components)) if component.index in neighbours[n]}

    def _remember(self, was: Lift, lift: Lift, done: int, before: int | None) -> None:
        """Keep how a lift stood that is changed; ``done`` and ``before`` as they were then."""
        order = was.order
        if was.status is not Status.PLANNED or order in self.was.pending or order not in self.was.paths:
            return
        if lift is was and order not in self.new_motions | self.pending:
            return
        if self.was_obstructed is None:
            self.was_obstructed = obstructed_cells(self.was.plan.site)
        motion, way = self.was.motions.get(order), self.was.ways.get(order)
        version = Version(was, self.was.paths[order], motion, way, done, before, self.was_obstructed)
        self.memory[order] = remembered(self.memory, version)

    def prove(self, known_shapes: set[int]) -> dict[str, str]:
        """Prove what was made; return which lifts to refuse, and why."""
        plan = self._plan()
        reasons: dict[str, str] = {}
        paths, motions = self.new_paths - self.recalled_paths.keys(), self.new_motions - self.recalled_motions.keys()
        for orders, timed in ((paths - self.pending, False), (motions, True)):
            if orders:
                part, context = _split(plan, orders)
                own = [self.motions[order] for order in sorted(orders) if order in self.motions]
                if timed:
                    proof = verify_motions_over_time(part, own, context)
                else:
                    proof = verify_plan_over_time(part, own, context, known_shapes=known_shapes)
                for component, reason in refusals(proof).items():
                    reasons.setdefault(component, reason)
        return reasons

    def _plan(self) -> LiftPlan:
        return replace(self.was.plan, site=self.site, lifts=tuple(self.lifts), history=self.history)

    def part(self) -> Part:
        """What stands after this walk, all of it proven."""
        made_paths = self.new_paths - self.pending
        planned = {lift.order: lift for lift in self.lifts if lift.status is Status.PLANNED}
        paths = {order: self.was.paths[order] for order in planned if order in self.was.paths}
        ways = {order: self.was.ways[order] for order in planned if order in self.was.ways}
        for order in made_paths:
            known = self.recalled_paths.get(order)
            paths[order] = known.path if known is not None else path_footprint(self.site, planned[order])
        for order in self.new_motions:
            known = self.recalled_motions.get(order)
            way = None if known is None else known.way
            ways[order] = motion_footprint(self.site, planned[order], self.motions[order]) if way is None else way
        for order in self.pending:
            ways.pop(order, None)
            if order in self.new_paths or order in self.was.pending - self.was.paths.keys():
                paths.pop(order, None)
        plan = self._plan()
        before = {lift.order: lift for lift in self.was.plan.lifts}
        replanned = {order for order in made_paths if not same_path(before[order], planned[order])}
        return Part(
            Standing(plan, self.motions, paths, ways, self.examined, frozenset(self.pending), self.memory, self.held),
            made=tuple(sorted(made_paths | self.new_motions | self.new_verdicts)),
            replanned=tuple(sorted(replanned)),
            retimed=tuple(sorted(self.new_motions - replanned)),
            change=self.change,
            redirected=self.redirected,
        )


def _behind(standing: Standing, now_ns: int | None) -> int:
    """Order of the last lift that is done or was passed over: a later one is done, or under way; -1 for none."""
    if now_ns is None:
        return -1
    behind = -1 if standing.held is None else standing.held.lift.order - 1
    for order, motion in standing.motions.items():
        if is_set(motion, now_ns):
            behind = max(behind, order)
        elif motion.start_ns < now_ns:
            behind = max(behind, order - 1)
    return behind


def refusals(proof: Verification) -> dict[str, str]:
    """Return the lifts that a proof failed about, with what failed.

    Raises:
        VerificationError: If it failed about none of them.
    """
    reasons: dict[str, str] = {}
    for check in proof.checks:
        for component in sorted(check.culprits):
            said = next((f for f in check.failures if component in f), check.failures[0])
            reasons.setdefault(component, f"its lift could not be proven ({check.name}: {said})")
    if not proof.verified and not reasons:
        raise VerificationError(
            f"the plan was not proven, so it was not written: {proof.failures[0]}",
            failures=proof.failures,
            hint="this is a fault of bimvox; please report it with the site file",
        )
    return reasons


def _split(plan: LiftPlan, orders: Collection[int]) -> tuple[LiftPlan, tuple[Lift, ...]]:
    """Return a plan of those lifts alone, and all others."""
    return (
        replace(plan, lifts=tuple(lift for lift in plan.lifts if lift.order in orders)),
        tuple(lift for lift in plan.lifts if lift.order not in orders),
    )


def _with_last_moves(clearance: Clearance, lift: Lift) -> Clearance:
    """Return the collision rule with a lift's own last moves cleared."""
    assert lift.path_vox is not None
    return with_cleared(clearance, lift.path_vox[len(lift.path_vox) - 1 - lift.contact_moves :])
