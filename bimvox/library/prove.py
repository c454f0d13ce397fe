"""Planning and proving in rounds: only proven lifts are returned as planned."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

from bimvox.cranes.lift import NoFreeTimeError
from bimvox.cranes.schedule import time_lifts
from bimvox.errors import MotionError, NoPlanError, listed
from bimvox.library.hand_over import as_ordered, handed_over, preparation_of
from bimvox.motion.steps import steps_of
from bimvox.planning.given_order import Order, prepare_in_order
from bimvox.planning.planner import plan_lifts
from bimvox.planning.preparation import Preparation
from bimvox.planning.rollout import proposer
from bimvox.planning.rounds import OtherWays, Refused, proven_in_rounds, refusals
from bimvox.planning.stage import Propose
from bimvox.policy.choice import PolicyInUse
from bimvox.progress import Progress
from bimvox.proof.clock import verify_steps
from bimvox.proof.motion import verify_motions
from bimvox.proof.plan import triangles_of, verify_plan
from bimvox.proof.props import verify_props
from bimvox.proof.set_ups import verify_set_ups
from bimvox.proof.values import check_motion_values, check_values
from bimvox.records.lift import NOT_DRIVEN, LiftPlan, Method, ModelledClash, Status
from bimvox.records.motion import LiftMotion
from bimvox.records.proof import Verification
from bimvox.records.steps import Steps
from bimvox.remarks.proven_props import proven_props
from bimvox.site.site import Site, names_by_id
from bimvox.walk import Store
from bimvox.workers import ALONE, Workers

Retraining = Callable[[tuple[int, ...]], PolicyInUse]
"""From the components whose lifts a policy failed to the policy after more training, or to the same one."""

_NOTES_SHOWN = 5


@dataclass(frozen=True, slots=True, eq=False)
class Planned:
    """A proven plan.

    Attributes:
        plan: The lifts.
        motions: Their motions; none without a crane.
        verdict: The proof of both; None if it was proven earlier.
        preparation: What was prepared for its site, if a lift was handed over to another crane.
    """

    plan: LiftPlan
    motions: tuple[LiftMotion, ...]
    verdict: Verification | None = None
    preparation: Preparation | None = None


def prepared(
    site: Site,
    progress: Progress,
    workers: Workers = ALONE,
    free: Collection[str] = (),
    store: Store | None = None,
    order: Order | None = None,
) -> tuple[Site, Preparation]:
    """Return what ``preparation_of`` does, or what is prepared for an order that the caller gives; report the notes."""
    if order is None:
        site, preparation = preparation_of(site, progress.report, workers, free, store)
    else:
        site, preparation = as_ordered(site, *prepare_in_order(site, order, progress.report, free))
    notes = preparation.sequence.notes
    for note in notes[:_NOTES_SHOWN]:
        progress.note(note)
    if len(notes) > _NOTES_SHOWN:
        progress.note(f"{len(notes) - _NOTES_SHOWN} more notes about the order (the log and --json list all)")
    clashes = preparation.contacts.clashes
    if clashes:
        progress.note(overlap_note(clashes, names_by_id(site)))
    progress.finish()
    return site, preparation


def overlap_note(clashes: Sequence[ModelledClash], names: Mapping[str, str]) -> str:
    """Return the note on the pairs of parts that overlap in the model; ``names`` are those of ``names_by_id``."""
    deepest = max(clashes, key=lambda clash: clash.depth_m)
    first, second = (names.get(part, part) for part in (deepest.first, deepest.second))
    pairs = "1 pair of parts overlaps" if len(clashes) == 1 else f"{len(clashes)} pairs of parts overlap"
    return (
        f"{pairs} in the model, by at most {deepest.depth_m:.3f} m ({first} and {second}); "
        "each pair may overlap by no more than the model does"
    )


def plan_and_prove(  # noqa: PLR0913  (all but the first three are optional, and given by name)
    site: Site,
    preparation: Preparation,
    policy: PolicyInUse,
    *,
    progress: Progress,
    retraining: Retraining | None = None,
    workers: Workers = ALONE,
    may_hand_over: Collection[str] = (),
    timed: Callable[[Planned], object] | None = None,
    store: Store | None = None,
) -> Planned:
    """Plan all lifts, time them, and prove both.

    A lift that cannot be proven, or that the crane cannot execute, gets other last moves. If these fail too, it becomes
    infeasible, with the failed check as its reason; so do the lifts of parts that rest on it. The rest is planned and
    proven again.

    Args:
        site: The site.
        preparation: Its contacts, order and yard.
        policy: What proposes paths.
        progress: Told of the stages.
        retraining: Called once with the components whose lifts the policy failed, if there are any; these lifts are
            then planned again with the policy that it returns.
        workers: Share the work; they know site and preparation.
        may_hand_over: Ids of the components that another crane may lift if their own has no free time for them. The
            site of the plan then is not the given one.
        timed: Called with each plan whose motions are proven next.
        store: What was planned, timed or proven before is not done again.

    Raises:
        NoPlanError: If no lift can be planned.
        VerificationError: If a proof of the plan as a whole fails.
    """
    may, known = frozenset(may_hand_over), Store() if store is None else store
    attempts = _Attempts(site, preparation, policy, progress, retraining, workers, may, timed, known)
    return proven_in_rounds(attempts.attempt, "written", attempts.lifts)


@dataclass(eq=False)
class _Attempts:
    """Attempts to plan and prove a site, each with what the ones before found out; as ``plan_and_prove``.

    Attributes:
        retrained: The policy after more training.
        other_ways: What the proof refused, before the lift is refused.
        handed: Ids of the components that were handed over to another crane.
        made: The last plan.
        given: The preparation at the beginning.
    """

    site: Site
    preparation: Preparation
    policy: PolicyInUse
    progress: Progress
    retraining: Retraining | None
    workers: Workers
    may_hand_over: Collection[str]
    timed: Callable[[Planned], object] | None
    store: Store
    retrained: Propose | None = None
    other_ways: OtherWays = field(default_factory=OtherWays)
    handed: set[str] = field(default_factory=set)
    made: LiftPlan | None = None

    def __post_init__(self) -> None:
        self.given = self.preparation

    def attempt(self, refused: Refused) -> Planned | Refused:
        """Return the proven plan without some lifts, or more lifts to refuse, and why."""
        made = self._planned(refused)
        insist_on_one_lift(made)
        failed = _left_to_search(made)
        if self.retraining is not None and self.policy.propose is not None and failed:
            better, self.retraining = self.retraining(failed), None
            if better.network is not None and better.network is not self.policy.network:
                self.retrained = proposer(better.network, every_guard=True)
                made = self._planned(refused)
        self.made = made = self._as_drawn(made)
        reassigned: list[str] = []
        found: Planned | Mapping[str, str]
        try:
            found = self._prove(made)
        except NoFreeTimeError as error:
            may = [part for part in error.reasons if part in self.may_hand_over and part not in self.handed]
            self.handed.update(may)
            self.site, self.preparation, reassigned = handed_over(self.site, self.preparation, may)
            found = {part: f"{NOT_DRIVEN}{why}" for part, why in error.reasons.items() if part not in reassigned}
        if isinstance(found, Planned):
            self.progress.finish()
            return found if self.preparation is self.given else replace(found, preparation=self.preparation)
        left = self.other_ways.without(made.site, made.lifts, found)
        for component, reason in found.items():
            self.progress.note(f"{component}: {reason}" + ("" if component in left else "; another way is tried"))
        if not reassigned:
            return left or self.attempt(refused)
        for note in self.preparation.sequence.notes[-len(reassigned) :]:
            self.progress.note(note)
        with self.workers.knowing(self.site, self.preparation):
            rest = self.attempt({**refused, **left})
        return rest if isinstance(rest, Planned) else {**left, **rest}

    def lifts(self) -> list[str]:
        """Return the ids of the components that the last plan lifts."""
        lifts = () if self.made is None else self.made.lifts
        return [self.site.components[one.component].id for one in lifts if one.status is Status.PLANNED]

    def _planned(self, refused: Refused) -> LiftPlan:
        self.progress.stage("plan", len(self.site.components))
        return plan_lifts(
            self.site,
            self.preparation,
            propose=self.policy.propose,
            retrained=self.retrained,
            refused=refused,
            other_ways=self.other_ways,
            progress=self.progress.report,
            workers=ALONE if self.policy.external else self.workers,  # code of the caller runs here, lift after lift
            store=self.store,
        )

    def _as_drawn(self, made: LiftPlan) -> LiftPlan:
        """Return a plan without the clashes that the proof does not measure, and turn the preparation to it.

        It measures in its own way. Such a pair keeps its moves, and its parts' lifts are proven as all others are.
        """
        undrawn = triangles_of(made, self.store).refuted_clashes()
        if not undrawn:
            return made
        contacts = self.preparation.contacts.listing([clash for clash in made.clashes if clash not in undrawn])
        self.preparation = replace(self.preparation, contacts=contacts)
        return replace(made, clashes=contacts.clashes)

    def _prove(self, made: LiftPlan) -> Planned | dict[str, str]:
        """Prove and time a plan; return the lifts to refuse, and why, if it is not proven.

        Raises NoFreeTimeError: if one of several cranes has no free time for a lift.
        """
        store, workers = self.store, self.workers
        self.progress.stage("prove")
        values = check_values(made)
        of_plan = Verification((values,))
        if values.passed:
            of_plan = Verification((values, *verify_plan(made, store=store, workers=workers).checks))
        if not of_plan.verified:
            return refusals(of_plan)
        if not made.site.cranes:
            return Planned(made, (), of_plan)
        self.progress.stage("time", len(made.lifts))
        try:
            motions = time_lifts(made, self.preparation, store, workers)
        except NoFreeTimeError:
            raise
        except MotionError as error:
            return {error.component: f"{NOT_DRIVEN}{error.message}"}
        self.progress.stage("prove")
        check_motion_values(values, made.site, motions)
        if not values.passed:
            return refusals(Verification((values,)))
        if self.timed is not None:
            self.timed(Planned(made, motions))
        of_motions = verify_motions(made, motions, store=store, workers=workers)
        if not of_motions.verified:
            return refusals(of_motions)
        steps = steps_of(made.site, made.lifts, motions)
        if steps != Steps() or made.site.rules.curing is not None:
            of_motions = Verification((*of_motions.checks, verify_steps(made, motions, steps, store)))
        if not of_motions.verified:
            return refusals(of_motions)
        if made.site.moving is not None:
            of_motions = Verification((*of_motions.checks, verify_set_ups(made, motions, steps)))
        if not of_motions.verified:
            return refusals(of_motions)
        if made.site.rules.props is not None:
            of_props = verify_props(made, motions, steps, proven_props(made, tuple(motions)), store)
            of_motions = Verification((*of_motions.checks, of_props))
        if not of_motions.verified:
            return refusals(of_motions)
        return Planned(made, motions, Verification((values, *of_plan.checks[1:], *of_motions.checks)))


def _left_to_search(made: LiftPlan) -> tuple[int, ...]:
    """Return the components whose lifts the policy did not find."""
    return tuple(lift.component for lift in made.lifts if lift.method is Method.SEARCH)


def insist_on_one_lift(made: LiftPlan) -> None:
    """Raise an error if no lift of a plan is planned.

    Raises:
        NoPlanError: With the reason of the first lift that is infeasible, and all of them as evidence.
    """
    if any(lift.status is Status.PLANNED for lift in made.lifts):
        return
    site, labels = made.site, names_by_id(made.site)
    first = next((lift for lift in made.lifts if lift.status is Status.INFEASIBLE), made.lifts[0])
    blockers = listed(labels.get(blocker, blocker) for blocker in first.blocked_by)
    raise NoPlanError(
        f"no lift can be planned; {site.components[first.component].label}: {first.reason}"
        + (f" ({blockers})" if blockers else ""),
        reasons={site.components[lift.component].id: lift.reason or "" for lift in made.lifts},
        hint="check the areas, the crane and the obstructions",
    )
