"""What a walk through the lifts is given, and what it makes."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from bimvox.planning.assembly import Preparation
from bimvox.planning.propose import Propose
from bimvox.proof.footprint import Footprint
from bimvox.records.lift import Epoch, Lift, LiftPlan
from bimvox.records.motion import LiftMotion
from bimvox.revision.obstruction_change import ObstructionChange
from bimvox.revision.recall import Version
from bimvox.revision.standing import Better, Standing
from bimvox.site.site import Site
from bimvox.stop.underway import HOLD_S, Held, Redirected


@dataclass(frozen=True, slots=True, eq=False)
class Wanted:
    """What a revision is to be made of.

    Attributes:
        site: The site with its obstructions now.
        preparation: What was prepared for it.
        propose: The policy; None for search alone.
        first: How many lifts made anew a part holds.
        now_ns: Of a plan that is being carried out: the time on the site's clock; None where it is not.
        hold_s: How long a stopped load is held at least.
        better: A policy that was trained further.
    """

    site: Site
    preparation: Preparation
    propose: Propose | None = None
    first: int = 20
    now_ns: int | None = None
    hold_s: float = HOLD_S
    better: Better | None = None


@dataclass(slots=True, eq=False)
class Made:
    """What a walk made, as it fills up; lifts by order.

    Attributes:
        lifts: Every lift so far.
        motions: Their motions, as far as they are on the clock.
        examined: Of infeasible lifts: the cells that decided.
        new_paths: Lifts whose path is proven anew, or was taken again.
        new_motions: The same of their motions.
        new_verdicts: Lifts that are infeasible for a reason found now.
        recalled_paths: Of the new paths, those taken again as they were.
        recalled_motions: The same of the motions.
        pending: Planned lifts that are not timed and proven yet.
        memory: How lifts that were changed stood before.
        held: The lift under way that is stopped and finds no way on.
        redirected: The lift under way that was stopped or takes another way.
        laid: Motions to be laid on the clock one after the other, by ascending order; None for those still to be made.
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
    memory: dict[int, tuple[Version, ...]] = field(default_factory=dict)
    held: Held | None = None
    redirected: Redirected | None = None
    laid: dict[int, LiftMotion | None] = field(default_factory=dict)

    @property
    def motions_to_make(self) -> tuple[int, ...]:
        """Lifts whose motion is still to be made."""
        return tuple(order for order, motion in self.laid.items() if motion is None)

    @property
    def paths_to_prove(self) -> set[int]:
        """Lifts whose path is to be proven now."""
        return self.new_paths - self.recalled_paths.keys() - self.pending

    @property
    def motions_to_prove(self) -> set[int]:
        """Lifts whose motion is to be proven now."""
        return self.new_motions - self.recalled_motions.keys()

    def plan(self, standing: Standing, wanted: Wanted, change: ObstructionChange) -> LiftPlan:
        """Return the plan of these lifts, those to come as they were; with the obstructions that the change ended."""
        lifts = (*self.lifts, *standing.plan.lifts[len(self.lifts) :])
        return replace(standing.plan, site=wanted.site, lifts=lifts, history=history_after(standing, wanted, change))


def history_after(standing: Standing, wanted: Wanted, change: ObstructionChange) -> tuple[Epoch, ...]:
    """Return the obstructions of every epoch of a plan that is being carried out, with those that a change ended."""
    history = standing.plan.history
    if not wanted.now_ns or not change.ids:
        return history
    gone = tuple(blocker for blocker in standing.plan.site.blockers if blocker.kind == "obstruction")
    return (*history, Epoch(wanted.now_ns, gone))
