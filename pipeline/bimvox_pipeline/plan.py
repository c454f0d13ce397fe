"""``bimvox plan``: every lift planned, proven, timed, and written to the log."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bimvox.errors import PlanningError
from bimvox_pipeline.artifacts import check_output, default_output, require_input, write_atomically
from bimvox_pipeline.load_site import LoadedSite, load_obstructions, load_site, rasterise
from bimvox_pipeline.policy.choice import PolicyInUse, choose_policy, retrained
from bimvox_pipeline.progress import Progress
from bimvox_pipeline.prove import Planned, insist_on_one_lift, plan_and_prove

if TYPE_CHECKING:
    from bimvox.log.plan_log import PlanLog
    from bimvox.motion.figures import CraneFigures, PlanFigures
    from bimvox.planning.assembly import Preparation
    from bimvox.site.obstructions.obstruction_set import ObstructionSet
    from bimvox.site.site import Site


_NOTES_SHOWN = 5


def plan(
    site: Path,
    out: Path | None = None,
    *,
    obstructions: Path | None = None,
    policy: str | None = None,
    seed: int | None = None,
    steps: int | None = None,
    retrain: int = 0,
    progress: Progress,
) -> dict[str, Any]:
    """Plan a site.

    Args:
        site: The site file.
        out: The log; default: the site's name with ``.mcap``, in the current folder.
        obstructions: What is in the way: an obstruction file, an IFC or mesh file.
        policy: Id of a policy of the store, or ``nearest``: that of the most similar site; default: the site file's,
            else the one trained for this site.
        seed: Seed of the training; default: the site file's.
        steps: Training budget in environment steps; default: the site file's, else the built-in one.
        retrain: Environment steps of more training, on the site as it is with its obstructions, where the policy fails
            lifts; 0: these go to the search at once.
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
    used = [chosen]

    def retraining(failed: tuple[int, ...]) -> PolicyInUse:
        number = seed_of(loaded, seed)
        used.append(retrained(built, preparation, chosen, failed=failed, seed=number, steps=retrain, progress=progress))
        progress.note(f"the policy failed {len(failed)} lifts: {retrained_words(chosen, used[-1])}")
        return used[-1]

    proven = plan_and_prove(built, preparation, chosen, progress=progress, retraining=retraining if retrain else None)
    record = log_of(proven, loaded, chosen, files, seed=seed_of(loaded, seed), revision=0)
    progress.stage("write")
    write_log_file(target, record, inputs=inputs)
    progress.finish()
    more = {"retrained": used[-1].to_dict()} if used[-1] is not chosen else {}
    return {**document_of(proven, chosen), **more, "log": str(target), "seconds": progress.seconds}


def retrained_words(before: PolicyInUse, after: PolicyInUse) -> str:
    """Say what came of retraining."""
    if after is before:
        return "no retrained policy was better, so the search finds these"
    return f"policy {after.id} was trained on them for {after.steps:,} steps and is asked next"


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
        insist_on_one_lift(plan_lifts(site, preparation))
        raise


def seed_of(loaded: LoadedSite, seed: int | None) -> int:
    """Return the command's seed, else the site file's."""
    return loaded.config.policy.seed if seed is None else seed


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
    from bimvox.motion.figures import plan_figures
    from bimvox.records.lift import Status

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
                "number": lift.number,
                "method": lift.method.value if lift.method else None,
                "moves": lift.moves,
                "shortest_moves": lift.shortest_moves,
                "contact_moves": lift.contact_moves if lift.path_vox is not None else None,
                "duration_s": round(motion.loaded.duration_s, 3) if motion else None,
                "bound_s": round(motion.loaded.bound_s, 3) if motion else None,
                "start_s": round(motion.start_ns / 1e9, 3) if motion else None,
                "end_s": round(motion.end_ns / 1e9, 3) if motion else None,
                "status": lift.status.value,
                **({"crane": site.cranes[component.crane].name} if site.has_several_cranes else {}),
            }
        )
        if lift.status is Status.INFEASIBLE:
            infeasible.append(
                {
                    "number": lift.number,
                    "component": component.id,
                    "global_id": component.global_id,
                    "name": component.name,
                    "reason": lift.reason,
                    "blocked_by": list(lift.blocked_by),
                }
            )
    return {
        "verified": True,
        "policy": policy.to_dict(),
        "figures": figures_document(plan_figures(proven.plan, proven.motions)),
        "lifts": lifts,
        "infeasible": infeasible,
        "clashes": [
            {"first": c.first, "second": c.second, "depth_m": round(c.depth_m, 4), "at_least": c.at_least}
            for c in proven.plan.clashes
        ],
        "notes": list(proven.plan.notes),
    }


def figures_document(figures: PlanFigures) -> dict[str, Any]:
    """Return the figures of a plan as the JSON documents hold them; what needs a crane is None without one."""
    ratio, travel = figures.length_ratio, figures.hook_travel_m
    return {
        "planned": figures.planned,
        "shares": {method: round(figures.share(method), 6) for method in figures.methods},
        "moves": figures.moves,
        "shortest_moves": figures.shortest_moves,
        "moves_over_shortest": None if ratio is None else round(ratio, 6),
        "crane_hours": None if figures.crane_s is None else round(figures.crane_s / 3600.0, 6),
        "loaded_hours": None if figures.loaded_s is None else round(figures.loaded_s / 3600.0, 6),
        "hook_travel_m": None if travel is None else round(travel, 3),
        "critical_lifts": figures.critical,
        "critical_share": figures.critical_share,
        "swing": None if figures.swing is None else figures.swing.value,
        **({"cranes": [_crane_document(crane) for crane in figures.cranes]} if figures.cranes else {}),
    }


def _crane_document(crane: CraneFigures) -> dict[str, Any]:
    return {
        "name": crane.name,
        "lifts": crane.lifts,
        "busy_hours": round(crane.busy_s / 3600.0, 6),
        "busy_share": round(crane.share, 6),
    }
