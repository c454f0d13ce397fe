"""Planning and proving together: what is not proven is not handed on as planned."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from bimvox.errors import NoPlanError
from bimvox_pipeline.policy.choice import PolicyInUse
from bimvox_pipeline.progress import Progress

if TYPE_CHECKING:
    from bimvox.planning.assembly import Preparation
    from bimvox.records.lift import LiftPlan
    from bimvox.records.motion import LiftMotion
    from bimvox.site.site import Site

Retraining = Callable[[tuple[int, ...]], PolicyInUse]
"""From the components whose lifts a policy failed to the policy after more training, or to itself."""


@dataclass(frozen=True, slots=True, eq=False)
class Planned:
    """A plan that was proven.

    Attributes:
        plan: The lifts.
        motions: Their motions; none without a crane.
    """

    plan: LiftPlan
    motions: tuple[LiftMotion, ...]


def plan_and_prove(
    site: Site,
    preparation: Preparation,
    policy: PolicyInUse,
    *,
    previous: LiftPlan | None = None,
    progress: Progress,
    retraining: Retraining | None = None,
) -> Planned:
    """Plan all lifts, time them, and prove both.

    A lift that cannot be proven, or that the crane cannot drive, is not written as planned: it becomes infeasible with
    what failed as its reason, what rests on it with it, and the rest is proven again.

    Args:
        site: The site.
        preparation: What was prepared for it.
        policy: What proposes paths.
        previous: An earlier plan of the same geometry; a lift whose path still holds is kept.
        progress: Told of the stages.
        retraining: Given the components whose lifts the policy failed, where there are any, it returns a policy that
            was trained further; these lifts are then planned once more.

    Raises:
        NoPlanError: If no lift can be planned.
        VerificationError: If a proof of the plan as a whole fails.
    """
    from bimvox.planning.planner import plan_lifts
    from bimvox.planning.rollout import proposer
    from bimvox.planning.rounds import Refused, proven_in_rounds

    propose = None if policy.network is None else proposer(policy.network)

    def attempt(refused: Refused) -> Planned | Refused:
        nonlocal previous, retraining
        progress.stage("plan", len(site.components))
        made = plan_lifts(
            site, preparation, propose=propose, previous=previous, refused=refused, progress=progress.report
        )
        insist_on_one_lift(made)
        failed = _left_to_search(made)
        if retraining is not None and propose is not None and failed:
            better, retraining = retraining(failed), None
            if better.network is not None and better.network is not policy.network:
                progress.stage("plan", len(site.components))
                made = plan_lifts(
                    site,
                    preparation,
                    propose=propose,
                    retrained=proposer(better.network),
                    previous=_without(made, failed),
                    refused=refused,
                    progress=progress.report,
                )
        previous = made
        found = _prove(made, preparation, progress)
        if isinstance(found, Planned):
            progress.finish()
        else:
            for component, reason in found.items():
                progress.note(f"{component}: {reason}")
        return found

    return proven_in_rounds(attempt, "written")


def _left_to_search(made: LiftPlan) -> tuple[int, ...]:
    """Return the components whose lifts the policy did not find."""
    from bimvox.records.lift import Method

    return tuple(lift.component for lift in made.lifts if lift.method is Method.SEARCH)


def _without(made: LiftPlan, components: tuple[int, ...]) -> LiftPlan:
    return replace(made, lifts=tuple(lift for lift in made.lifts if lift.component not in components))


def _prove(made: LiftPlan, preparation: Preparation, progress: Progress) -> Planned | dict[str, str]:
    """Prove and time a plan; or say which lifts to refuse, and why."""
    from bimvox.cranes.schedule import time_lifts
    from bimvox.errors import MotionError
    from bimvox.planning.assembly import replay
    from bimvox.planning.rounds import refusals
    from bimvox.proof.motion import verify_motions
    from bimvox.proof.plan import verify_plan

    progress.stage("prove")
    proof = verify_plan(made)
    if not proof.verified:
        return refusals(proof)
    if not made.site.cranes:
        return Planned(made, ())
    progress.stage("time", len(made.lifts))
    try:
        motions = time_lifts(made, replay(made.site, preparation, made))
    except MotionError as error:
        return {error.component: f"the crane cannot drive its path: {error.message}"}
    progress.stage("prove")
    proof = verify_motions(made, motions)
    return Planned(made, motions) if proof.verified else refusals(proof)


def insist_on_one_lift(made: LiftPlan) -> None:
    """Refuse a plan in which nothing is planned.

    Raises:
        NoPlanError: With the first lift's reason, and all of them as evidence.
    """
    from bimvox.records.lift import Status

    if any(lift.status is Status.PLANNED for lift in made.lifts):
        return
    site, first = made.site, made.lifts[0]
    blockers = ", ".join(first.blocked_by)
    raise NoPlanError(
        f"no lift can be planned; {site.components[first.component].id}: {first.reason}"
        + (f" ({blockers})" if blockers else ""),
        reasons={site.components[lift.component].id: lift.reason or "" for lift in made.lifts},
        hint="check the areas, the crane and the obstructions",
    )
