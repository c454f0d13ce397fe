"""Prove the new paths and motions of a part."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import partial

from bimvox.planning.rounds import Refused, refusals
from bimvox.proof.footprint import Footprint, MotionFootprint, motion_footprint, path_footprint
from bimvox.proof.over_time import verify_motions_over_time, verify_plan_over_time
from bimvox.records.lift import Lift, LiftPlan
from bimvox.revision.draft import RevisionDraft
from bimvox.revision.footprints import Footprints
from bimvox.workers import Workers


@dataclass(frozen=True, slots=True, eq=False)
class Proof:
    """The result of proving new lifts.

    Attributes:
        refused: The lifts to refuse and why.
        path_footprints: Footprints of the proven new paths, by order.
        motion_footprints: Footprints of the proven new motions, by order.
        stuck: The components to refuse whose empty hook meets something.
    """

    refused: Refused
    path_footprints: Footprints[Footprint]
    motion_footprints: Footprints[MotionFootprint]
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
        Footprints({order: partial(path_footprint, plan.site, lifts[order]) for order in paths - failed}, {}),
        Footprints(
            {order: partial(motion_footprint, plan.site, lifts[order], timed[order]) for order in motions - failed}, {}
        ),
        frozenset(stuck),
    )


def _split(plan: LiftPlan, orders: Collection[int]) -> tuple[LiftPlan, tuple[Lift, ...]]:
    """Return a plan of only those lifts, and all other lifts."""
    return (
        replace(plan, lifts=tuple(lift for lift in plan.lifts if lift.order in orders)),
        tuple(lift for lift in plan.lifts if lift.order not in orders),
    )
