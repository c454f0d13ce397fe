"""What holds parts, as far as it is proven: a part whose props the proof refuses has none, and says so."""

from __future__ import annotations

from dataclasses import replace

from bimvox.kept import kept
from bimvox.motion.props import props_of
from bimvox.motion.steps import steps_of
from bimvox.proof.props import verify_props
from bimvox.records.lift import Lift, LiftPlan
from bimvox.records.motion import LiftMotion
from bimvox.records.props import Hold, Props


@kept
def proven_props(plan: LiftPlan, motions: tuple[LiftMotion, ...], context: tuple[Lift, ...] = ()) -> Props:
    """Return what ``props_of`` chooses, without what the proof refuses: one bad prop never costs a lift.

    Args:
        plan: The plan, or what a log carries of it.
        motions: Its motions.
        context: Lifts of the same plan that it does not contain.
    """
    chosen = props_of(plan, motions, context)
    if not chosen.held:
        return chosen
    wrong = verify_props(plan, motions, steps_of(plan.site, plan.lifts, motions), chosen).culprits
    refused = {part.index for part in plan.site.components if part.id in wrong}
    held = (
        replace(one, hold=Hold.NOTHING, by=(), props=(), until_ns=None, waits_for=(), holds_up=())
        if one.component in refused
        else one
        for one in chosen.held
    )
    return Props(tuple(held))
