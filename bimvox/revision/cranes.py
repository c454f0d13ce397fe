"""A plan of several cranes revised: paths that still hold are kept, and all lifts are put on the clock anew.

When a lift begins depends on what the other cranes do meanwhile, so a new path of one lift may shift all after it, of
every crane. Lifts before the first that changes keep their times where nothing that follows reaches back to them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from bimvox.cranes.schedule import time_lifts
from bimvox.errors import MotionError
from bimvox.planning.assembly import replay
from bimvox.planning.planner import plan_lifts
from bimvox.planning.rounds import Refused, proven_in_rounds, refusals
from bimvox.proof.motion import verify_motions
from bimvox.proof.plan import verify_plan
from bimvox.records.lift import LiftPlan, same_path
from bimvox.records.motion import LiftMotion
from bimvox.revision.made import Wanted
from bimvox.revision.obstruction_change import ObstructionChange
from bimvox.revision.standing import RevisedPart, Standing, standing_of

_LOST = 1e-9
"""Radians and metres."""


def revised_together(
    standing: Standing,
    wanted: Wanted,
    change: ObstructionChange,
    known_shapes: set[int],
    on_verdict: Callable[[], None] | None,
) -> RevisedPart:
    """Return a plan revised as a whole, proven.

    Args:
        standing: The plan that stands.
        wanted: The site as it is now, and what the revision is made with.
        change: What changed.
        known_shapes: See ``verify_plan``; added to.
        on_verdict: Called when it is known which lifts can be planned.

    Raises:
        VerificationError: If a proof fails of which no lift is at fault.
    """
    better = wanted.better
    previous = standing.plan
    if better is not None:
        kept = tuple(lift for lift in previous.lifts if lift.component not in better.components)
        previous = replace(previous, lifts=kept)

    def attempt(refused: Refused) -> RevisedPart | Refused:
        plan = plan_lifts(
            wanted.site,
            wanted.preparation,
            propose=wanted.propose,
            retrained=None if better is None else better.propose,
            previous=previous,
            refused=refused,
        )
        if on_verdict is not None:
            on_verdict()
        proof = verify_plan(plan, known_shapes=known_shapes)
        if not proof.verified:
            return refusals(proof)
        try:
            motions = time_lifts(plan, replay(wanted.site, wanted.preparation, plan))
        except MotionError as error:
            return {error.component: f"the crane cannot drive its path: {error.message}"}
        proof = verify_motions(plan, motions)
        if not proof.verified:
            return refusals(proof)
        known_shapes.update(lift.component for lift in plan.lifts if lift.path_vox is not None)
        return part_of(standing, plan, motions, change)

    return proven_in_rounds(attempt, "changed")


def part_of(was: Standing, plan: LiftPlan, motions: tuple[LiftMotion, ...], change: ObstructionChange) -> RevisedPart:
    """Return a plan of several cranes as what stands after another one; motions that are the same are kept."""
    kept = [
        was.motions[new.order] if new.order in was.motions and _same(was.motions[new.order], new) else new
        for new in motions
    ]
    timed = {new.order for new in kept if was.motions.get(new.order) is not new}
    before = {lift.component: lift for lift in was.plan.lifts}
    replanned = {
        lift.order for lift in plan.lifts if lift.path_vox is not None and not same_path(before[lift.component], lift)
    }
    verdicts = {
        lift.order
        for lift in plan.lifts
        if (lift.status, lift.reason) != (before[lift.component].status, before[lift.component].reason)
    }
    return RevisedPart(
        standing_of(plan, kept),
        made=tuple(sorted(replanned | timed | verdicts)),
        replanned=tuple(sorted(replanned)),
        retimed=tuple(sorted(timed - replanned)),
        change=change,
    )


def _same(one: LiftMotion, other: LiftMotion) -> bool:
    """Whether two motions are the same, but for the last bits that are lost on the way through a log."""
    if (one.component, one.start_ns, one.phases) != (other.component, other.start_ns, other.phases):
        return False
    (time_ns, axes), (other_ns, other_axes) = one.samples(), other.samples()
    return np.array_equal(time_ns, other_ns) and np.allclose(axes, other_axes, rtol=0.0, atol=_LOST)
