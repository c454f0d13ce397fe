"""The revised plan as far as a round of the revision has decided it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from bimvox.proof.footprint import Footprint
from bimvox.records.lift import Epoch, Lift, LiftPlan
from bimvox.records.motion import LiftMotion
from bimvox.revision.current_plan import CurrentPlan
from bimvox.revision.held_cranes import HeldCranes
from bimvox.revision.obstruction_change import ObstructionChange
from bimvox.revision.recall import Version
from bimvox.revision.request import RevisionRequest
from bimvox.stop.redirect import Held, Redirected


@dataclass(slots=True, eq=False)
class RevisionDraft:
    """What a round of the revision has decided so far; lifts by order.

    Attributes:
        lifts: Every lift so far.
        motions: Their motions that are on the clock.
        examined: The cells that made lifts infeasible.
        new_paths: Lifts whose path is new or recalled.
        new_motions: Lifts whose motion is new or recalled.
        new_verdicts: Lifts that are infeasible for a new reason.
        recalled_paths: Of the new paths, those recalled from an earlier version.
        recalled_motions: The same for motions.
        pending: Planned lifts that are not timed and proven yet.
        undecided: Of the pending lifts, those that a later part keeps or plans again.
        memory: Earlier versions of lifts that were changed.
        unproven_motions: Lifts whose motion is to be proven.
        written: Lifts that are written to the log even if nothing about them is new.
        held: The cranes, if they are stopped because a load has no free path.
        stops: The lifts under way that were stopped, each redirected or held.
        fewest_unknown: Kept and recalled lifts with a longer path than may now be possible.
        laid: Motions to put on the clock one after the other, in ascending order; None for those still to be made.
    """

    lifts: list[Lift] = field(default_factory=list)
    motions: dict[int, LiftMotion] = field(default_factory=dict)
    examined: dict[int, Footprint] = field(default_factory=dict)
    new_paths: set[int] = field(default_factory=set)
    new_motions: set[int] = field(default_factory=set)
    new_verdicts: set[int] = field(default_factory=set)
    recalled_paths: dict[int, Version] = field(default_factory=dict)
    recalled_motions: dict[int, Version] = field(default_factory=dict)
    pending: set[int] = field(default_factory=set)
    undecided: set[int] = field(default_factory=set)
    memory: dict[int, tuple[Version, ...]] = field(default_factory=dict)
    unproven_motions: set[int] = field(default_factory=set)
    written: frozenset[int] = frozenset()
    held: HeldCranes | None = None
    stops: tuple[Redirected | Held, ...] = ()
    fewest_unknown: set[int] = field(default_factory=set)
    laid: dict[int, LiftMotion | None] = field(default_factory=dict)

    @property
    def paths_to_prove(self) -> set[int]:
        """Lifts whose path is to be proven now."""
        return self.new_paths - self.recalled_paths.keys() - self.pending

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
