"""``bimvox plan``: every lift planned, proven, timed, and written to the log."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bimvox.errors import NoPlanError, PlanningError, VerificationError
from pipeline.artifacts import check_output, default_output, require_input, write_atomically
from pipeline.load_site import LoadedSite, load_obstructions, load_site, rasterise
from pipeline.policy_choice import PolicyInUse, choose_policy
from pipeline.progress import Progress

if TYPE_CHECKING:
    from bimvox.log.plan_log import PlanLog
    from bimvox.planning.assembly import Preparation
    from bimvox.planning.lift import LiftPlan
    from bimvox.planning.proof import Verification
    from bimvox.site.obstructions import ObstructionSet
    from bimvox.site.site import Site
    from bimvox.trajectory.motion import LiftMotion


_NOTES_SHOWN = 5
_ROUNDS = 12  # of planning and proving again without the lifts that failed their proof


@dataclass(frozen=True, slots=True, eq=False)
class Planned:
    """A plan that was proven.

    Attributes:
        plan: The lifts.
        motions: Their motions; none without a crane.
    """

    plan: LiftPlan
    motions: tuple[LiftMotion, ...]


def plan(
    site: Path,
    out: Path | None = None,
    *,
    obstructions: Path | None = None,
    policy: str | None = None,
    seed: int | None = None,
    steps: int | None = None,
    progress: Progress,
) -> dict[str, Any]:
    """Plan a site.

    Args:
        site: The site file.
        out: The log; default: the site's name with ``.mcap``, in the current folder.
        obstructions: What is in the way: an obstruction file, an IFC or mesh file.
        policy: Id of a policy of the store; default: the site file's, else the one trained for this site.
        seed: Seed of the training; default: the site file's.
        steps: Training budget in environment steps; default: the site file's, else the built-in one.
        progress: Told of the stages.

    Returns:
        The document of ``bimvox plan --json``.

    Raises:
        NoPlanError: If no lift can be planned; nothing is written.
        VerificationError: If a proof fails; nothing is written.
    """
    target = out or default_output(site, ".mcap")
    inputs = [site, *([obstructions] if obstructions else [])]
    check_output(target, inputs=inputs)
    if obstructions is not None:
        require_input(obstructions)
    loaded = load_site(site, progress)
    check_output(target, inputs=[*inputs, loaded.config.model.path])
    files = dict(loaded.files)
    built = loaded.site
    if obstructions is not None:
        built = obstructed(built, load_obstructions(obstructions, built), progress)
        files[f"obstructions{obstructions.suffix.lower()}"] = obstructions.read_bytes()
    preparation = prepared(built, progress)
    chosen = policy_of(loaded, built, preparation, policy=policy, seed=seed, steps=steps, progress=progress)
    proven = plan_and_prove(built, preparation, chosen, progress=progress)
    record = log_of(proven, loaded, chosen, files, seed=seed_of(loaded, seed), revision=0)
    progress.stage("write")
    write_log_file(target, record, inputs=inputs)
    progress.finish()
    return {**document_of(proven, chosen), "log": str(target), "seconds": progress.seconds}


def obstructed(site: Site, obstructions: ObstructionSet, progress: Progress) -> Site:
    """Return the site with obstructions, and say what was clipped."""
    from bimvox.site.build import with_obstructions

    changed = with_obstructions(site, obstructions, rasterise)
    for note in changed.obstruction_notes:
        progress.note(note)
    return changed


def prepared(site: Site, progress: Progress) -> Preparation:
    """Find contacts, order and yard, and say what was noticed."""
    from bimvox.planning.assembly import prepare

    preparation = prepare(site, progress.report)
    notes = preparation.sequence.notes
    for note in notes[:_NOTES_SHOWN]:
        progress.note(note)
    if len(notes) > _NOTES_SHOWN:
        progress.note(f"{len(notes) - _NOTES_SHOWN} more notes about the order (--json and the log list all)")
    clashes = preparation.contacts.clashes
    if clashes:
        deepest = max(clashes, key=lambda clash: clash.depth_m)
        progress.note(
            f"{len(clashes)} pairs of parts are drawn into each other, at most {deepest.depth_m:.3f} m "
            f"({deepest.first} and {deepest.second}); each may overlap as deep as drawn and no deeper"
        )
    progress.finish()
    return preparation


def policy_of(
    loaded: LoadedSite,
    site: Site,
    preparation: Preparation,
    *,
    policy: str | None,
    seed: int | None,
    steps: int | None,
    progress: Progress,
) -> PolicyInUse:
    """Return the policy by the command's wishes, then the site file's.

    Raises:
        NoPlanError: If there is nothing to learn from because no lift can be planned; says why.
    """
    from bimvox.planning.planner import plan_lifts

    wanted = loaded.config.policy
    try:
        return choose_policy(
            site,
            preparation,
            policy_id=policy or wanted.id,
            seed=seed_of(loaded, seed),
            steps=steps if steps is not None else wanted.steps,
            required_success=wanted.required_success,
            progress=progress,
        )
    except PlanningError:
        _insist_on_one_lift(plan_lifts(site, preparation))
        raise


def seed_of(loaded: LoadedSite, seed: int | None) -> int:
    """Return the command's seed, else the site file's."""
    return loaded.config.policy.seed if seed is None else seed


def plan_and_prove(
    site: Site,
    preparation: Preparation,
    policy: PolicyInUse,
    *,
    previous: LiftPlan | None = None,
    progress: Progress,
) -> Planned:
    """Plan all lifts, time them, and prove both.

    A lift that cannot be proven, or that the crane cannot drive, is not written as planned: it becomes infeasible with
    what failed as its reason, what rests on it with it, and the rest is proven again.

    Raises:
        NoPlanError: If no lift can be planned.
        VerificationError: If a proof of the plan as a whole fails.
    """
    from bimvox.planning.planner import plan_lifts
    from bimvox.planning.rollout import proposer

    refused: dict[str, str] = {}
    propose = proposer(policy.network)
    for _ in range(_ROUNDS):
        progress.stage("plan", len(site.components))
        made = plan_lifts(
            site, preparation, propose=propose, previous=previous, refused=refused, progress=progress.report
        )
        _insist_on_one_lift(made)
        found = _prove(made, preparation, progress)
        if isinstance(found, Planned):
            progress.finish()
            return found
        previous = made
        refused |= found
        for component, reason in found.items():
            progress.note(f"{component}: {reason}")
    raise VerificationError(
        f"after {_ROUNDS} rounds lifts still fail their proof, so nothing was written",
        failures=[f"{component}: {reason}" for component, reason in refused.items()],
        hint="a finer [model] voxel_size_m, or other areas, may help",
    )


def _prove(made: LiftPlan, preparation: Preparation, progress: Progress) -> Planned | dict[str, str]:
    """Prove and time a plan; or say which lifts to refuse, and why."""
    from bimvox.errors import MotionError
    from bimvox.planning.assembly import replay
    from bimvox.planning.verify import verify_plan
    from bimvox.trajectory.time_plan import time_plan
    from bimvox.trajectory.verify import verify_motions

    progress.stage("prove")
    proof = verify_plan(made)
    if not proof.verified:
        return _refused(proof)
    if made.site.crane is None:
        return Planned(made, ())
    progress.stage("time", len(made.lifts))
    try:
        motions = time_plan(made, replay(made.site, preparation, made))
    except MotionError as error:
        return {error.component: f"the crane cannot drive its path: {error.message}"}
    progress.stage("prove")
    proof = verify_motions(made, motions)
    return Planned(made, motions) if proof.verified else _refused(proof)


def _refused(proof: Verification) -> dict[str, str]:
    """The lifts that a proof failed about, with what failed; an error where it is about none of them."""
    reasons: dict[str, str] = {}
    for check in proof.checks:
        for component in sorted(check.culprits):
            said = next((f for f in check.failures if component in f), check.failures[0])
            reasons.setdefault(component, f"its lift could not be proven ({check.name}: {said})")
    if not reasons:
        raise VerificationError(
            f"the plan was not proven, so it was not written: {proof.failures[0]}",
            failures=proof.failures,
            hint="this is a fault of bimvox; please report it with the site file",
        )
    return reasons


def _insist_on_one_lift(made: LiftPlan) -> None:
    from bimvox.planning.lift import Status

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


def log_of(
    proven: Planned, loaded: LoadedSite, policy: PolicyInUse, files: dict[str, bytes], *, seed: int, revision: int
) -> PlanLog:
    """Return what the log holds.

    Args:
        proven: The plan.
        loaded: The site as loaded.
        policy: What proposed the paths.
        files: Files that the plan was made from, by name; their hashes go into the metadata.
        seed: Seed of the training.
        revision: Number of the plan among those for this site.
    """
    from bimvox.log.plan_log import PlanLog

    metadata = {"seed": str(seed), "policy": policy.id, "policy_steps": str(policy.steps)}
    for name, data in files.items():
        metadata[f"sha256 {name}"] = hashlib.sha256(data).hexdigest()
    if loaded.georeference:
        metadata["georeference"] = json.dumps(dict(loaded.georeference), sort_keys=True)
    return PlanLog(plan=proven.plan, motions=proven.motions, attachments=files, metadata=metadata, revision=revision)


def write_log_file(path: Path, record: PlanLog, *, inputs: list[Path]) -> None:
    """Write a log whole or not at all."""
    from bimvox.log.recorder import write_log

    write_atomically(path, lambda stream: write_log(stream, record), inputs=inputs)


def document_of(proven: Planned, policy: PolicyInUse) -> dict[str, Any]:
    """Return what ``bimvox plan --json`` says about a plan that was proven."""
    from bimvox.planning.lift import Status

    site = proven.plan.site
    motions = {motion.order: motion for motion in proven.motions}
    lifts, infeasible = [], []
    for lift in proven.plan.lifts:
        component, motion = site.components[lift.component], motions.get(lift.order)
        lifts.append(
            {
                "component": component.id,
                "global_id": component.global_id,
                "ifc_class": component.ifc_class,
                "name": component.name,
                "order": lift.order,
                "method": lift.method.value if lift.method else None,
                "moves": lift.moves,
                "shortest_moves": lift.shortest_moves,
                "contact_moves": lift.contact_moves if lift.path_vox is not None else None,
                "duration_s": round(motion.loaded.duration_s, 3) if motion else None,
                "bound_s": round(motion.loaded.bound_s, 3) if motion else None,
                "start_s": round(motion.start_ns / 1e9, 3) if motion else None,
                "end_s": round(motion.end_ns / 1e9, 3) if motion else None,
                "status": lift.status.value,
            }
        )
        if lift.status is Status.INFEASIBLE:
            infeasible.append(
                {
                    "component": component.id,
                    "global_id": component.global_id,
                    "reason": lift.reason,
                    "blocked_by": list(lift.blocked_by),
                }
            )
    return {
        "verified": True,
        "policy": policy.to_dict(),
        "lifts": lifts,
        "infeasible": infeasible,
        "clashes": [
            {"first": c.first, "second": c.second, "depth_m": round(c.depth_m, 4), "at_least": c.at_least}
            for c in proven.plan.clashes
        ],
        "notes": list(proven.plan.notes),
    }
