"""A plan revised after a change of the obstructions."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from bimvox.library.arguments import insist
from bimvox.library.obstructions import obstructed, survey_in
from bimvox.library.plan import digests_of, obstructions_of
from bimvox.library.plan_value import Plan
from bimvox.library.site import OBSTRUCTIONS
from bimvox.library.verify import prove_plan
from bimvox.log.plan_log import PlanLog
from bimvox.planning.preparation import preparation_in
from bimvox.progress import Listener, progress_of
from bimvox.revision.current_plan import RevisionRequest, current_plan_of
from bimvox.revision.revise import revise as revised_parts
from bimvox.site.obstructions.obstruction_set import ObstructionSet


def revise(plan: Plan, obstructions: ObstructionSet | Path | str, *, progress: Listener = None) -> Plan:
    """Return the plan for other obstructions: only lifts that the change affects get a new path or a new motion.

    ``bimvox watch`` does the same at every change of a file. The given plan is not changed.

    Args:
        plan: A proven plan. If it was read from a log, contacts and order are found again first, and new paths are
            found by search.
        obstructions: All obstructions from now on: a value, or the path of an obstruction, IFC, mesh or point file.
        progress: A ``Progress``, or a function that takes a line of text.

    Raises:
        InputError: If ``plan`` is not a plan, or the obstructions are neither a set nor a path.
        VerificationError: If a proof fails for which no lift is the cause.
        ObstructionFileError: If the obstructions cannot be used.
    """
    told, plan = progress_of(progress), insist("revise", plan, Plan, "plan")
    found, files = obstructions_of(obstructions, plan.site, survey_in(plan.record))
    site = obstructed(plan.site, found, told)
    preparation = plan.preparation or preparation_in(plan.record.whole_plan)
    current = current_plan_of(plan.record.plan, plan.motions)
    told.stage("revise")
    request = RevisionRequest(site, preparation, None if plan.policy is None else plan.policy.propose)
    for part in revised_parts(current, request):
        current = part.current
    kept = {name: data for name, data in plan.record.attachments.items() if not name.startswith(OBSTRUCTIONS)}
    record = _next(replace(plan.record, plan=current.plan, motions=current.chain), {**kept, **files})
    verdict = prove_plan(record, told)
    told.finish()
    return replace(plan, record=record, verdict=verdict, preparation=preparation)


def _next(record: PlanLog, files: dict[str, bytes]) -> PlanLog:
    """Return the record of the next revision, with other files."""
    metadata = {key: value for key, value in record.metadata.items() if not key.startswith("sha256 ")}
    return replace(record, attachments=files, metadata={**metadata, **digests_of(files)}, revision=record.revision + 1)
