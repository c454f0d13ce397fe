"""The revised plan as far as a round of the revision has decided it; its motions, and the proof of what is new."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

from bimvox.errors import MotionError
from bimvox.motion.time_plan import KnownLegs, MotionMaking
from bimvox.motion.trajectories import joined_on, waiting
from bimvox.planning.rounds import Refused, refusals
from bimvox.proof.footprint import Footprint, MotionFootprint, motion_footprint, path_footprint
from bimvox.proof.over_time import verify_motions_over_time, verify_plan_over_time
from bimvox.records.lift import NOT_DRIVEN, Epoch, Lift, LiftPlan, Status
from bimvox.records.motion import LiftMotion
from bimvox.revision.current_plan import CurrentPlan, HeldCranes, ObstructionChange, RevisionRequest
from bimvox.revision.versions import Once, Reading, Version, Versions, with_version
from bimvox.stop.redirect import Held, Redirected
from bimvox.units import NS_PER_S
from bimvox.workers import Begun, Workers


@dataclass(slots=True, eq=False)
class RevisionDraft:
    """What a round of the revision has decided so far; lifts by order.

    Attributes:
        lifts: Every lift so far.
        motions: Their motions that are on the clock.
        read: The state of the site before each.
        examined: The cells that make lifts infeasible, where a change may free them.
        paths: Versions of lifts whose path, or reason for being infeasible, still holds.
        moved: Versions of lifts whose motion still holds.
        new_paths: Lifts whose path is not that of the current plan.
        new_motions: The same for motions.
        new_verdicts: Lifts that are infeasible for a new reason.
        pending: Planned lifts that are not timed and proven yet.
        undecided: Of the pending lifts, those that a later part keeps or plans again.
        unproven_motions: Lifts whose motion is to be proven.
        written: Lifts that are written to the log even if nothing about them is new.
        held: The cranes, if they are stopped because a load has no free path.
        stops: The lifts under way that were stopped, each redirected or held.
        fewest_unknown: Kept and recalled lifts with a longer path than may now be possible.
        laid: Motions to put on the clock one after the other, in ascending order; None for those still to be made.
    """

    lifts: list[Lift] = field(default_factory=list)
    motions: dict[int, LiftMotion] = field(default_factory=dict)
    read: dict[int, Reading] = field(default_factory=dict)
    examined: dict[int, Once[Footprint]] = field(default_factory=dict)
    paths: dict[int, Version] = field(default_factory=dict)
    moved: dict[int, Version] = field(default_factory=dict)
    new_paths: set[int] = field(default_factory=set)
    new_motions: set[int] = field(default_factory=set)
    new_verdicts: set[int] = field(default_factory=set)
    pending: set[int] = field(default_factory=set)
    undecided: set[int] = field(default_factory=set)
    unproven_motions: set[int] = field(default_factory=set)
    written: frozenset[int] = frozenset()
    held: HeldCranes | None = None
    stops: tuple[Redirected | Held, ...] = ()
    fewest_unknown: set[int] = field(default_factory=set)
    laid: dict[int, LiftMotion | None] = field(default_factory=dict)

    @property
    def paths_to_prove(self) -> set[int]:
        """Lifts whose path is to be proven now."""
        return self.new_paths - self.paths.keys() - self.pending

    def plan(self, current: CurrentPlan, request: RevisionRequest, change: ObstructionChange) -> LiftPlan:
        """Return the plan of these lifts, with the obstructions that the change ended."""
        own = (replace(x, shortest_moves=None) if x.order in self.fewest_unknown else x for x in self.lifts)
        lifts = (*own, *current.plan.lifts[len(self.lifts) :])
        return replace(current.plan, site=request.site, lifts=lifts, history=history_after(current, request, change))


def history_after(current: CurrentPlan, request: RevisionRequest, change: ObstructionChange) -> tuple[Epoch, ...]:
    """Return the obstructions of every epoch of a plan being carried out, with those that a change ended."""
    history = current.plan.history
    if not request.now_ns or not change.ids:
        return history
    until_ns = request.now_ns
    if current.motions and not current.pending and current.held is None:  # nothing happens after the last motion
        until_ns = min(until_ns, max((motion.end_ns for motion in current.motions.values()), default=until_ns))
        if history and history[-1].until_ns >= until_ns:
            return history
    gone = tuple(blocker for blocker in current.plan.site.blockers if blocker.kind == "obstruction")
    return (*history, Epoch(until_ns, gone))


_AT_ONCE = 3
"""So many motions are begun at once: few, so that the workers begin early and end together."""


class MotionsInTheMaking:
    """The motions that a round leaves open: workers make them while later lifts are still planned.

    Each is timed at its own stage, from time 0 and slew angle 0.

    Args:
        request: What to revise the plan for.
    """

    def __init__(self, request: RevisionRequest) -> None:
        self._request = request
        self._begun: list[tuple[list[KnownLegs], Begun[list[LiftMotion | MotionError]]]] = []
        self._waiting: list[KnownLegs] = []
        self._lifts: Sequence[Lift] = ()

    def add(self, known: KnownLegs, lifts: Sequence[Lift]) -> None:
        """Have the motion of a lift made; ``lifts`` are all up to this one."""
        self._waiting.append(known)
        self._lifts = lifts
        if len(self._waiting) == _AT_ONCE:
            self._begin()

    def finished(self) -> dict[int, LiftMotion | MotionError]:
        """Return the motions by order; an error for each that cannot be driven."""
        if self._waiting:
            self._begin()
        for _, begun in self._begun:
            begun.help()
        result = dict[int, LiftMotion | MotionError]()
        for known, begun in self._begun:
            (motions,) = begun.finished()
            result.update(zip([one.order for one in known], motions, strict=True))
        return result

    def _begin(self) -> None:
        making = MotionMaking(self._request.site, self._request.preparation, self._lifts)
        task = (making, self._waiting)
        self._begun.append((self._waiting, self._request.workers.begin(MotionMaking.steps, [task])))
        self._waiting = []


def made_in_full(request: RevisionRequest, draft: RevisionDraft, making: MotionsInTheMaking) -> RevisionDraft | Refused:
    """Return a draft with all motions made and put on the clock one after the other.

    Args:
        request: What to revise the plan for.
        draft: The draft.
        making: The motions that it left open.

    Returns:
        The same with every motion; or the lifts that the crane cannot drive, and why.
    """
    made, motions, refused = making.finished(), dict[int, LiftMotion](), dict[str, str]()
    for order, motion in made.items():
        if isinstance(motion, MotionError):
            refused[motion.component] = f"{NOT_DRIVEN}{motion.message}"
        else:
            motions[order] = motion
    if refused:
        return refused
    on_clock, before = dict(draft.motions), None
    for lift in draft.lifts:
        order = lift.order
        if order in draft.laid:
            motion = draft.laid[order] or motions[order]
            on_clock[order] = _in_time(request, joined_on(motion, None if before is None else on_clock.get(before)))
        if lift.status is Status.PLANNED:
            before = order
    return replace(draft, motions={order: on_clock[order] for order in sorted(on_clock)}, laid={})


def _in_time(request: RevisionRequest, motion: LiftMotion) -> LiftMotion:
    """Return a motion that does not start in the past: an idle crane waits until now and for the hold."""
    now_ns = request.now_ns
    if now_ns is None or motion.start_ns >= now_ns:
        return motion
    return waiting(motion, now_ns + round(request.hold_s * NS_PER_S) - motion.start_ns)


@dataclass(frozen=True, slots=True, eq=False)
class Proof:
    """The result of proving new lifts.

    Attributes:
        refused: The lifts to refuse and why.
        paths: Footprints of the proven new paths, by order.
        swept: Footprints of the proven new motions, by order.
        stuck: The components to refuse whose empty hook meets something.
    """

    refused: Refused
    paths: Mapping[int, Once[Footprint]]
    swept: Mapping[int, Once[MotionFootprint]]
    stuck: frozenset[str] = frozenset()


def prove_new(plan: LiftPlan, draft: RevisionDraft, known_shapes: set[int], workers: Workers) -> Proof:
    """Return the proof of the paths and motions that are new in a part.

    Args:
        plan: The plan of the part.
        draft: The draft, with all motions.
        known_shapes: See ``verify_plan``.
        workers: Share the work.

    Raises:
        VerificationError: If the proof fails, and no lift is at fault.
    """
    paths, motions, timed = draft.paths_to_prove, draft.unproven_motions, draft.motions
    reasons: dict[str, str] = {}
    stuck: set[str] = set()
    for orders, verify in (
        (paths, partial(verify_plan_over_time, known_shapes=known_shapes, workers=workers)),
        (motions, partial(verify_motions_over_time, workers=workers)),
    ):
        if orders:
            is_whole = plan.site.has_several_cranes and orders == timed.keys()
            part, context = (plan, ()) if is_whole else _split(plan, orders)
            own = [timed[order] for order in sorted(orders) if order in timed]
            found = verify(part, own, context)
            for component, reason in refusals(found).items():
                reasons.setdefault(component, reason)
            stuck |= {name for check in found.checks if check.name == "empty_hook" for name in check.culprits}
    lifts = {lift.order: lift for lift in plan.lifts}
    failed = {order for order, lift in lifts.items() if plan.site.components[lift.component].id in reasons}
    return Proof(
        reasons,
        {order: Once(partial(path_footprint, plan.site, lifts[order])) for order in paths - failed},
        {order: Once(partial(motion_footprint, plan.site, lifts[order], timed[order])) for order in motions - failed},
        frozenset(stuck),
    )


def _split(plan: LiftPlan, orders: Collection[int]) -> tuple[LiftPlan, tuple[Lift, ...]]:
    """Return a plan of only those lifts, and all other lifts."""
    return (
        replace(plan, lifts=tuple(lift for lift in plan.lifts if lift.order in orders)),
        tuple(lift for lift in plan.lifts if lift.order not in orders),
    )


def versions_after(versions: Versions, draft: RevisionDraft, plan: LiftPlan, proof: Proof) -> Versions:
    """Return the versions of lifts with what is proven of a draft, in the state of the site that it was proven in."""
    result = dict(versions)
    for lift in plan.lifts:
        order = lift.order
        path: Callable[[], Footprint] | None = proof.paths.get(order) or draft.examined.get(order)
        if path is None and order in draft.paths:
            path = draft.paths[order].path
        if path is None:
            continue
        swept = proof.swept.get(order) or (draft.moved[order].swept if order in draft.moved else None)
        motion = None if swept is None else draft.motions[order]
        new = Version(lift, draft.read[order], path, motion, swept)
        result[order] = with_version(result.get(order, ()), new)
    return result
