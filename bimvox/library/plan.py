"""Planning a site: preparation, policy, lifts, motions and proof in one call."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from bimvox.errors import InputError, PlanningError, shown
from bimvox.library.arguments import PolicyWish, code_name, constants_of, external_of, insist, whole, workers_of
from bimvox.library.hand_over import may_go_to_others
from bimvox.library.plan_value import Plan
from bimvox.library.prove import Planned, Retraining, insist_on_one_lift, plan_and_prove, prepared
from bimvox.library.site import OBSTRUCTIONS, LoadedSite, ReadObstructions, attached_as, obstructed, read_obstructions
from bimvox.log.plan_log import GEOREFERENCE, PlanLog
from bimvox.planning.external import TIME_LIMIT_S, Paths
from bimvox.planning.given_order import Order
from bimvox.planning.planner import plan_lifts
from bimvox.planning.preparation import Preparation
from bimvox.policy.choice import DEFAULT_STEPS, PolicyInUse, PolicyRequest, choose_policy, retrained
from bimvox.progress import Listener, Progress, progress_of
from bimvox.site.obstructions.coordinates import Survey
from bimvox.site.obstructions.file import obstructions_to_json
from bimvox.site.obstructions.obstruction_set import ObstructionSet
from bimvox.site.site import Site
from bimvox.walk import Store
from bimvox.workers import Workers


def plan(  # noqa: PLR0913  (the options of a verb)
    site: LoadedSite,
    *,
    obstructions: ObstructionSet | ReadObstructions | Path | str | None = None,
    policy: str | Any = None,
    seed: int | None = None,
    steps: int | None = None,
    train: bool = False,
    retrain: int = 0,
    paths: Paths | None = None,
    order: Order | None = None,
    paths_limit_s: float = TIME_LIMIT_S,
    jobs: int | None = None,
    progress: Listener = None,
) -> Plan:
    """Return the proven plan of a site: every lift planned or infeasible with its reason, timed, and proven.

    Args:
        site: As loaded or guessed.
        obstructions: What is in the way: a value, or the path of an obstruction, IFC, mesh or point file.
        policy: Id of a stored policy; ``none``: search alone; ``greedy``: towards the target; ``nearest``: the policy
            of the most similar site; ``default``: the network that ships with bimvox. If it is left out: the site
            file's, otherwise the one trained for this site before, otherwise ``greedy``. Or a policy of yours: a model
            of stable-baselines3, or a function from (N, 2597) float32 observations to (N, 6) values of the actions of
            ``bimvox/Lift-v0``, or to (N,) actions.
        seed: Seed of the training, from 0; default: the site file's.
        steps: Training budget in environment steps, from 1, and trains; default: the site file's, otherwise the
            built-in one.
        train: Whether a policy is trained for this site if there is none; otherwise nothing is tested or trained.
        retrain: Environment steps of more training, on the site with its obstructions, if the policy fails lifts; 0:
            the search finds these at once.
        paths: A planner of yours, asked first: ``paths(start_vox, goal_vox, space)`` returns (N, 3) cells or waypoints
            from start to goal, or None; ``space`` is a ``LiftSpace``. A lift for which it has no valid path is planned
            without it, and says why (``plan.lifts[n].lift.planner_note``).
        order: The ids of all parts, first lift first; or a function that returns them, of a tuple of ``PartToOrder``. A
            pair of an id and the name of a crane says which of several cranes lifts the part.
        paths_limit_s: Longest that ``paths``, or a policy of yours, may take for a lift, seconds. Then it is
            interrupted. Python code ends at once; compiled code ends when it returns, and is not asked until then.
        jobs: Number of processes that share the work, from 1; default: one per processor. The plan is the same.
        progress: A ``Progress``, or a function that takes a line of text.

    Raises:
        InputError: If ``site`` is not a site, a number is out of range, or the order is not one of all parts in which
            each comes after what it rests on.
        NoPlanError: If no lift can be planned; ``reasons`` says why, by component.
        VerificationError: If a proof of the plan as a whole fails; ``failures`` says what.
        PolicyError: If the named policy is missing or does not fit.
        ObstructionFileError: If the obstructions cannot be used.
    """
    wish = PolicyWish(policy, seed, steps, train, retrain, paths, order, paths_limit_s)
    with planned(site, wish, obstructions=obstructions, jobs=jobs, progress=progress) as (made, _):
        return made


@contextmanager
def planned(
    site: LoadedSite,
    wish: PolicyWish,
    *,
    obstructions: ObstructionSet | ReadObstructions | Path | str | None = None,
    jobs: int | None = None,
    progress: Listener = None,
    timed: Callable[[PlanLog, Workers], object] | None = None,
) -> Iterator[tuple[Plan, Workers]]:
    """Plan a site as :func:`plan`; within the block there are the plan and the workers that made it.

    They know the plan's site, and share the work on its log.

    Args:
        site: As for ``plan``.
        wish: The arguments of ``plan`` about the policy.
        obstructions: As for ``plan``, like the others, and the errors.
        jobs: As above.
        progress: As above.
        timed: Called with what the log of a plan will hold, and the workers, before the plan's motions are proven. If
            they are, the plan has that record; otherwise another one may follow.
    """
    reporter, site = progress_of(progress), insist("plan", site, LoadedSite, "site")
    seed, steps = whole("seed", wish.seed, 0), whole("steps", wish.steps, 1)
    retrain = whole("retrain", wish.retrain, 0) or 0
    is_order = callable(wish.order) or (isinstance(wish.order, Iterable) and not isinstance(wish.order, str))
    if not (wish.order is None or is_order):
        raise InputError(f"order is {shown(wish.order)}", hint="give the ids of all parts, or a function that does")
    built, files = site.site, dict(site.files)
    if obstructions is not None:
        found, content = obstructions_of(obstructions, built, site.survey)
        built, files = obstructed(built, found, reporter), {**files, **content}
    with workers_of(built, whole("jobs", jobs, 1)) as workers:
        free = may_go_to_others(replace(site, site=built))
        store = Store()
        external = external_of(wish, built)
        built, preparation = prepared(built, reporter, workers, free, store, wish.order)
        chosen = policy_of(site, built, preparation, replace(wish, seed=seed, steps=steps), reporter)
        chosen = replace(chosen, external=external) if external else chosen
        number = seed_of(site, seed)
        used = [chosen]

        def retraining(failed: tuple[int, ...]) -> PolicyInUse:
            used.append(
                retrained(built, preparation, chosen, failed=failed, seed=number, steps=retrain, progress=reporter)
            )
            reporter.note(f"the policy failed {len(failed)} lifts: {_outcome(chosen, used[-1])}")
            return used[-1]

        def record_of(proven: Planned) -> PlanLog:
            return log_of(proven, site, chosen, files, seed=number, revision=0)

        begun: list[PlanLog] = []

        def begin(to_be_proven: Planned) -> None:
            begun[:] = [record_of(to_be_proven)]
            if timed is not None:
                timed(begun[0], workers)

        again: Retraining | None = retraining if retrain else None
        with workers.knowing(*constants_of(built, preparation)):
            proven = plan_and_prove(
                built,
                preparation,
                chosen,
                progress=reporter,
                retraining=again,
                workers=workers,
                may_hand_over=free,
                timed=begin,
                store=store,
            )
            record = begun[0] if begun else record_of(proven)  # the last one that was timed is the proven one
            better = used[-1] if used[-1] is not chosen else None
            with workers.knowing(record.plan.site):  # another one if a lift was handed over
                yield Plan(record, proven.verdict, chosen, proven.preparation or preparation, better), workers


def obstructions_of(
    obstructions: ObstructionSet | ReadObstructions | Path | str, site: Site, survey: Survey
) -> tuple[ObstructionSet, Mapping[str, bytes]]:
    """Return the obstructions, and the file that a log carries of them; it is made if they are given as a value."""
    if isinstance(obstructions, ObstructionSet):
        given = {f"{OBSTRUCTIONS}json": obstructions_to_json(obstructions)}
        return obstructions, given if obstructions.obstructions else {}
    if isinstance(obstructions, str | Path):
        obstructions = read_obstructions(Path(obstructions))
    if not isinstance(obstructions, ReadObstructions):
        raise InputError(
            f"obstructions are an ObstructionSet or the path of a file, not a {type(obstructions).__name__}",
            hint="ObstructionSet.of([...]) makes a set of obstructions",
        )
    return obstructions.on(site, survey), {attached_as(obstructions.path): obstructions.content}


def policy_of(
    loaded: LoadedSite,
    site: Site,
    preparation: Preparation,
    wish: PolicyWish,
    progress: Progress,
) -> PolicyInUse:
    """Return the policy that the caller asks for, otherwise the one that the site file asks for.

    Raises:
        NoPlanError: If there is nothing to learn from because no lift can be planned; says why.
    """
    asked = loaded.config.policy
    if not (wish.policy is None or isinstance(wish.policy, str)):
        return PolicyInUse(id=code_name(wish.policy))
    budget = wish.steps if wish.steps is not None else asked.steps
    wanted = PolicyRequest(
        seed=seed_of(loaded, wish.seed),
        required_success=asked.required_success,
        policy_id=wish.policy or asked.id,
        steps=DEFAULT_STEPS if budget is None else budget,
        train=wish.train or wish.steps is not None,
    )
    try:
        return choose_policy(site, preparation, wanted, progress)
    except PlanningError:
        insist_on_one_lift(plan_lifts(site, preparation))
        raise


def seed_of(loaded: LoadedSite, seed: int | None) -> int:
    """Return the caller's seed, otherwise the site file's."""
    return loaded.config.policy.seed if seed is None else seed


def log_of(
    proven: Planned,
    loaded: LoadedSite,
    policy: PolicyInUse,
    files: Mapping[str, bytes],
    *,
    seed: int,
    revision: int,
) -> PlanLog:
    """Return what the log of a plan holds.

    Args:
        proven: The plan.
        loaded: The site as loaded.
        policy: What proposed the paths.
        files: Files that the plan was made from, by name; their hashes go into the metadata.
        seed: Seed of the training.
        revision: Number of the plan among those for this site.
    """
    metadata = {"seed": str(seed), "policy": policy.id, "policy_steps": str(policy.steps), **digests_of(files)}
    metadata |= georeference_of(loaded)
    return PlanLog(
        plan=proven.plan, motions=proven.motions, attachments=dict(files), metadata=metadata, revision=revision
    )


def georeference_of(loaded: LoadedSite) -> dict[str, str]:
    """Return the metadata entry of the model's map conversion; empty if it has none."""
    return {GEOREFERENCE: json.dumps(dict(loaded.georeference), sort_keys=True)} if loaded.georeference else {}


def digests_of(files: Mapping[str, bytes]) -> dict[str, str]:
    """Return the metadata entries of files: ``sha256 NAME`` -> hexadecimal digest of the bytes."""
    return {f"sha256 {name}": hashlib.sha256(data).hexdigest() for name, data in files.items()}


def _outcome(before: PolicyInUse, after: PolicyInUse) -> str:
    """Return the outcome of retraining as words."""
    if after is before:
        return "no retrained policy was better, so the search finds these"
    return f"policy {after.id} was trained on them for {after.steps:,} steps and is asked next"
