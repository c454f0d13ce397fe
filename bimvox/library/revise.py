"""A plan revised after a change of the obstructions, and a plan carried out among people and vehicles."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from bimvox.errors import InputError, MotionError, VerificationError
from bimvox.library.arguments import insist
from bimvox.library.compare import DECIDER, DECIDES, check_traffic
from bimvox.library.plan import digests_of, obstructions_of
from bimvox.library.plan_value import Plan
from bimvox.library.site import OBSTRUCTIONS, obstructed, survey_in
from bimvox.library.verify import prove_plan
from bimvox.live.execution import Execution, carried_out
from bimvox.live.tracks import Traffic
from bimvox.log.plan_log import PENDING, PlanLog
from bimvox.log.segments import FIRST_PLAN, NOW_NS
from bimvox.planning.preparation import Preparation, preparation_in
from bimvox.progress import Listener, Progress, progress_of
from bimvox.proof.carried_out import check_carried_out, planned_axes, tally_of
from bimvox.records.motion import TRACKS, CarriedOut, Tally
from bimvox.records.proof import Verification
from bimvox.revision.current_plan import RevisionRequest, current_plan_of
from bimvox.revision.revise import revise as revised_parts
from bimvox.site.obstructions.obstruction_set import ObstructionSet
from bimvox.site.site import Site


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
    reporter, plan = progress_of(progress), insist("revise", plan, Plan, "plan")
    insist_on_no_tandem(plan.site)
    found, files = obstructions_of(obstructions, plan.site, survey_in(plan.record))
    site = obstructed(plan.site, found, reporter)
    preparation = plan.preparation or preparation_in(plan.record.whole_plan)
    current = current_plan_of(plan.record.plan, plan.motions)
    reporter.stage("revise")
    request = RevisionRequest(site, preparation, None if plan.policy is None else plan.policy.propose)
    for part in revised_parts(current, request):
        current = part.current
    kept = {name: data for name, data in plan.record.attachments.items() if not name.startswith(OBSTRUCTIONS)}
    record = _next(replace(plan.record, plan=current.plan, motions=current.chain), {**kept, **files})
    verdict = prove_plan(record, reporter)
    reporter.finish()
    return replace(plan, record=record, verdict=verdict, preparation=preparation)


def insist_on_no_tandem(site: Site) -> None:
    """Raise an error if two cranes carry a part together: such a plan is made as a whole.

    Raises InputError: names the first such part.
    """
    part = next((one for one in site.components if one.tandem is not None), None)
    if part is not None:
        raise InputError(
            f"two cranes carry {part.label} together: such a plan is not revised, nor watched or simulated",
            hint="plan again with the obstructions: bimvox plan --obstructions",
        )


def _next(record: PlanLog, files: dict[str, bytes]) -> PlanLog:
    """Return the record of the next revision, with other files."""
    metadata = {key: value for key, value in record.metadata.items() if not key.startswith("sha256 ")}
    return replace(record, attachments=files, metadata={**metadata, **digests_of(files)}, revision=record.revision + 1)


_NOTHING = Tally(0, 0.0, 0, 0, None, 0)


def carry_out(
    record: PlanLog, preparation: Preparation, traffic: Traffic, source: str, tracks: Path | None, progress: Progress
) -> tuple[PlanLog, Execution, Verification]:
    """Return the log of a plan that is carried out in traffic, what happened, and the proof of both.

    The recommended rule of docs/live.md decides. A lift that cannot be proven at another place in the order keeps its
    place, and the plan is carried out anew.

    Args:
        record: A proven plan of one crane.
        preparation: What it was made from.
        traffic: The traffic.
        source: Where it comes from, in words.
        tracks: The file of its recorded tracks, which is attached.
        progress: Receives the stages.

    Raises:
        InputError: If the site has several cranes or none, or the plan was changed while it was carried out.
        MotionError: If the crane can execute none of the lifts that may be next.
        VerificationError: If the plan is not proven in its own order.
    """
    plan = record.plan
    if plan.history or any(lift.left for lift in plan.lifts):
        raise InputError(
            "the plan was changed while it was carried out: part of it is history",
            hint="carry out a new plan: give another log with -o",
        )
    files = {} if tracks is None else {TRACKS + tracks.name: tracks.read_bytes()}
    metadata = {key: value for key, value in record.metadata.items() if key not in (FIRST_PLAN, NOW_NS, PENDING)}
    record = replace(
        record, attachments={**record.attachments, **files}, metadata={**metadata, **digests_of(files)}, events=()
    )
    log, done, verdict = _proven(record, preparation, traffic, progress)
    axes = planned_axes(done.motions, done.plan_ns)
    samples = (done.time_ns, done.plan_ns, done.pace, axes, done.place_m, done.seen_m)
    found = CarriedOut(source, DECIDER, done.others, *samples, _NOTHING)
    found = replace(found, tally=tally_of(done.plan, done.motions, found))
    log, checks = replace(log, carried_out=found), check_carried_out(done.plan, done.motions, found)
    if Verification(checks).verified:
        checks += (check_traffic(log, found),)
    progress.finish()
    return log, done, replace(verdict, checks=(*verdict.checks, *checks))


def _proven(
    record: PlanLog, preparation: Preparation, traffic: Traffic, progress: Progress
) -> tuple[PlanLog, Execution, Verification]:
    """Return an execution whose plan is proven in its own order, with that plan and the proof."""
    known = {part.id: part.index for part in record.plan.site.components}
    pinned: set[int] = set()
    while True:
        progress.stage("traffic")
        try:
            done = carried_out(record.plan, preparation, record.motions, traffic, DECIDES, pinned)
        except MotionError as error:
            if known[error.component] in pinned:
                raise
            pinned.add(known[error.component])
            continue
        log = replace(record, plan=done.plan, motions=done.motions)
        verdict = prove_plan(log, progress)
        if verdict.verified:
            return log, done, verdict
        culprits = {known[part] for part in verdict.culprits} or set(known.values())
        if culprits <= pinned or not done.moved:
            raise VerificationError("the plan is not proven in its own order", failures=verdict.failures)
        pinned |= culprits
