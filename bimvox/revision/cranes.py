"""A revision with several cranes before their plan is carried out: all lifts are scheduled again.

The start of a lift depends on what the other cranes do, so one new path may shift all later lifts of every crane. Lifts
before the first change keep their times if nothing later affects them.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bimvox.cranes.schedule import time_lifts
from bimvox.errors import MotionError
from bimvox.planning.rounds import Refused
from bimvox.records.lift import Lift
from bimvox.records.motion import LiftMotion
from bimvox.records.reasons import NOT_DRIVEN
from bimvox.revision.current_plan import CurrentPlan
from bimvox.revision.draft import RevisionDraft
from bimvox.revision.obstruction_change import ObstructionChange
from bimvox.revision.part_proof import Proof
from bimvox.revision.request import RevisionRequest

if TYPE_CHECKING:
    from bimvox.revision.keep_or_replan import Replanning

_LOST = 1e-9
"""Radians and metres."""


class SeveralCranes:
    """The ``CraneWork`` of a site with several cranes whose plan is not being carried out.

    Args:
        current: The current plan.
        request: What to revise it for.
        change: What changed.
    """

    def __init__(self, current: CurrentPlan, request: RevisionRequest, change: ObstructionChange) -> None:
        self._was, self._request, self._change = current, request, change

    def begun(self, replanning: Replanning, was: Lift) -> Lift | None:
        """Return None: no lift has begun."""

    def choose_motion(self, replanning: Replanning, lift: Lift, was: Lift) -> None:
        """Do nothing: all motions are made together."""

    def timed(self, draft: RevisionDraft) -> RevisionDraft | Refused:
        """Return the draft with all motions on the clock; or which lift cannot be driven, and why."""
        plan = draft.plan(self._was, self._request, self._change)
        try:
            motions = time_lifts(plan, self._request.preparation, workers=self._request.workers)
        except MotionError as error:
            return {part: f"{NOT_DRIVEN}{why}" for part, why in error.reasons.items()}
        return with_motions(self._was, draft, motions)

    def refused(self, proof: Proof) -> Refused:
        """Return the lifts that failed."""
        return proof.refused


def with_motions(was: CurrentPlan, draft: RevisionDraft, motions: Iterable[LiftMotion]) -> RevisionDraft:
    """Return a draft with the motions of several cranes, all of them to be proven; equal ones are kept."""
    kept = {new.order: new for new in motions}
    kept |= {order: was.motions[order] for order, new in kept.items() if _same(was.motions.get(order), new)}
    new_motions = {order for order, motion in kept.items() if was.motions.get(order) is not motion}
    return replace(draft, motions=kept, new_motions=new_motions, unproven_motions=set(kept))


def _same(one: LiftMotion | None, other: LiftMotion) -> bool:
    """Return whether two motions are equal up to the rounding of a log."""
    if one is None or (one.component, one.start_ns, one.phases) != (other.component, other.start_ns, other.phases):
        return False
    (time_ns, axes), (other_ns, other_axes) = one.samples(), other.samples()
    return np.array_equal(time_ns, other_ns) and np.allclose(axes, other_axes, rtol=0.0, atol=_LOST)
