"""The proof of a part: of its new paths and motions, a few lifts at a time."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, replace
from functools import partial

from bimvox.planning.rounds import Refused, refusals
from bimvox.proof.footprint import Footprint, motion_footprint, path_footprint
from bimvox.proof.over_time import verify_motions_over_time, verify_plan_over_time
from bimvox.records.lift import Lift, LiftPlan
from bimvox.records.motion import LiftMotion
from bimvox.revision.made import Made

_PROVEN_AT_ONCE = 4
"""Lifts that are proven together."""


@dataclass(frozen=True, slots=True, eq=False)
class Proof:
    """What a proof of new lifts says.

    Attributes:
        refused: Those to refuse; the rest is of no use where there are any.
        paths: Footprints of the new paths, by order.
        ways: Footprints of the new motions, by order.
    """

    refused: Refused
    paths: Mapping[int, Footprint]
    ways: Mapping[int, Footprint]


def prove_new(plan: LiftPlan, made: Made, known_shapes: set[int]) -> Proof:
    """Return the proof of the paths and motions that are new in a part.

    Args:
        plan: The plan of the part.
        made: What the walk made, with all motions.
        known_shapes: See ``verify_plan``.

    Raises:
        VerificationError: If the proof fails, and no lift is at fault.
    """
    to_prove_paths, to_prove_motions = made.paths_to_prove, made.motions_to_prove
    orders = sorted(to_prove_paths | to_prove_motions)
    refused: dict[str, str] = {}
    paths: dict[int, Footprint] = {}
    ways: dict[int, Footprint] = {}
    for n in range(0, len(orders), _PROVEN_AT_ONCE):
        batch = set(orders[n : n + _PROVEN_AT_ONCE])
        found = _prove(plan, batch & to_prove_paths, batch & to_prove_motions, made.motions, known_shapes)
        refused |= found.refused
        paths |= found.paths
        ways |= found.ways
    return Proof(refused, paths, ways)


def _prove(
    plan: LiftPlan,
    paths: AbstractSet[int],
    motions: AbstractSet[int],
    timed: Mapping[int, LiftMotion],
    known_shapes: set[int],
) -> Proof:
    """Prove the paths and the motions of some lifts."""
    reasons: dict[str, str] = {}
    for orders, verify in (
        (paths, partial(verify_plan_over_time, known_shapes=known_shapes)),
        (motions, verify_motions_over_time),
    ):
        if orders:
            part, context = _split(plan, orders)
            own = [timed[order] for order in sorted(orders) if order in timed]
            for component, reason in refusals(verify(part, own, context)).items():
                reasons.setdefault(component, reason)
    if reasons:
        return Proof(reasons, {}, {})
    lifts = {lift.order: lift for lift in plan.lifts}
    return Proof(
        {},
        {order: path_footprint(plan.site, lifts[order]) for order in sorted(paths)},
        {order: motion_footprint(plan.site, lifts[order], timed[order]) for order in sorted(motions)},
    )


def _split(plan: LiftPlan, orders: Collection[int]) -> tuple[LiftPlan, tuple[Lift, ...]]:
    """Return a plan of those lifts alone, and all others."""
    return (
        replace(plan, lifts=tuple(lift for lift in plan.lifts if lift.order in orders)),
        tuple(lift for lift in plan.lifts if lift.order not in orders),
    )
