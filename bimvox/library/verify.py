"""Proves plans and logs again."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from pathlib import Path

from bimvox.library.arguments import constants_of, path_of, workers_of
from bimvox.library.attached_files import check_attached_files
from bimvox.library.claims import Given, check_user_files, claims_of
from bimvox.library.compare import check_traffic
from bimvox.library.plan_value import Plan
from bimvox.library.search import with_search
from bimvox.log import schema as topics
from bimvox.log.check import check_commands, check_digests, check_joint_states, check_load_poses
from bimvox.log.codec import derived_from_json
from bimvox.log.mcap.form_check import form_faults
from bimvox.log.mcap.reader import Contents, read_contents, read_file
from bimvox.log.plan_log import PlanLog
from bimvox.log.reader import log_of
from bimvox.log.shown import check_shown
from bimvox.progress import Listener, Progress, progress_of
from bimvox.proof.carried_out import check_carried_out
from bimvox.proof.clock import verify_steps
from bimvox.proof.over_time import not_current, verify_motions_over_time, verify_plan_over_time
from bimvox.proof.props import verify_props
from bimvox.proof.set_ups import verify_set_ups
from bimvox.proof.values import check_values, with_coverage
from bimvox.records.proof import Verification
from bimvox.records.props import Props
from bimvox.records.steps import Steps
from bimvox.site.site import names_by_id, with_names
from bimvox.undisturbed import uncollected
from bimvox.walk import Store
from bimvox.workers import ALONE, Workers


def verify(
    plan: Plan | Path | str,
    *,
    site: Path | str | None = None,
    model: Path | str | None = None,
    obstructions: Path | str | None = None,
    programme: Path | str | None = None,
    traffic: Path | str | None = None,
    search: bool = False,
    progress: Listener = None,
) -> Verification:
    """Return the verdict of a proof made now: one check after the other, with what failed.

    The proof uses only the plan or the log, whose site holds the triangles of all parts; the building model is not
    read. Of an extract, the lifts that it carries are proven.

    Args:
        plan: A plan, or the path of a log. Of a log, its digests and topics are checked as well.
        site: The user's site file: prove that the plan is of it and of its model.
        model: The model, if it is not where the site file says.
        obstructions: The user's obstruction file.
        programme: The programme that was given to ``bimvox plan``, if any.
        traffic: The traffic that was given to ``bimvox watch``: a seed, such as ``heavy:7``, or a file of tracks.
        search: Whether to search again that infeasible lifts are infeasible and that no path has fewer moves than
            stated. This uses the planner's search, and takes about as long as planning without a policy.
        progress: A ``Progress``, or a function that takes a line of text.

    Raises:
        LogFileError: If the log is missing, damaged, or not a log of bimvox.
        InputError: If an argument is of another kind, or a model or a programme is given without a site file.
        FileError: If a file of the user is missing or cannot be used.
    """
    reporter = progress_of(progress)
    if isinstance(plan, Plan):
        record, verdict = plan.record, prove_plan(plan.record, reporter)
    else:
        contents, record = read_whole(path_of("verify", plan, "a log, or a plan"), reporter)
        verdict = prove(contents, record, reporter)
    files = {"site": site, "model": model, "obstructions": obstructions, "programme": programme}
    paths = {name: None if file is None else path_of("verify", file) for name, file in files.items()}
    given = Given(**paths, traffic=None if traffic is None else str(traffic))
    verdict = prove_further(verdict, record, given, search=search, progress=reporter)
    reporter.finish()
    return verdict


def prove_further(
    verdict: Verification, record: PlanLog, given: Given, *, search: bool, progress: Progress
) -> Verification:
    """Return a verdict with what a proof from the log alone cannot have: the files of the user, and the search.

    Its claims are those that remain.

    ``verdict``: the verdict from the log alone; ``search``: whether to search.
    """
    if given.names:
        verdict = replace(verdict, checks=(*verdict.checks, check_user_files(record, given, progress)))
    if search:
        verdict = with_search(verdict, record, progress)
    options = [*given.names, *(["search"] if search else []), *(["programme"] if given.site is not None else [])]
    return with_claims(verdict, record, [f"--{option}" for option in options])


def with_claims(verdict: Verification, record: PlanLog, bound: Collection[str] = ()) -> Verification:
    """Return a verdict with what its log claims and was not proven; nothing follows from values that make no sense.

    ``bound``: the options of ``bimvox verify`` with which it was proven.
    """
    sensible = verdict.checks[0].passed
    return replace(verdict, claims=claims_of(record, verdict.checks, bound) if sensible else ())


@uncollected()
def read_whole(log: Path, progress: Progress) -> tuple[Contents, PlanLog]:
    """Return the messages and attachments of a log, and what they mean.

    Raises:
        LogFileError: If it is missing, damaged, or not a log of bimvox.
    """
    progress.stage("read")
    data = read_file(log)
    contents = read_contents(data, log)
    contents.misleading = form_faults(data)
    record = log_of(contents, log)
    if record.context:
        progress.note(f"this log is an extract: {len(record.plan.lifts)} of {len(record.all_lifts)} lifts are in it")
    return contents, record


def prove(contents: Contents, record: PlanLog, progress: Progress) -> Verification:
    """Prove what was read from a log: plan, motions, digests, and that its topics agree.

    ``contents``: the log's messages and attachments, all topics.
    """
    files = contents.attachments
    steps = derived_from_json(Steps, files[topics.STEPS_FILE], "the log") if topics.STEPS_FILE in files else None
    props = derived_from_json(Props, files[topics.PROPS_FILE], "the log") if topics.PROPS_FILE in files else None
    with workers_of(record.plan.site, None) as workers, workers.knowing(*constants_of(record.plan.site)):
        proven = prove_plan(record, progress, steps, props, workers)
    if not proven.checks[0].passed:
        return proven
    progress.stage("log")
    with uncollected():
        own = (
            check_digests(contents, record),
            check_attached_files(record),
            check_load_poses(contents, record),
            check_joint_states(contents, record),
            check_commands(contents, record),
        )
        found = replace(proven, checks=(*proven.checks, *own))
        if found.verified and record.carried_out is not None:
            found = replace(found, checks=(*found.checks, check_traffic(record, record.carried_out)))
        if found.verified:  # what is shown of a plan that is refused need not be made again
            found = replace(found, checks=(*found.checks, check_shown(contents, record)))
        return with_claims(found, record)


def prove_plan(
    record: PlanLog,
    progress: Progress,
    stated: Steps | None = None,
    stated_props: Props | None = None,
    workers: Workers = ALONE,
) -> Verification:
    """Prove a plan, its motions, and how it was carried out, if the record says so and the plan is proven.

    If its values make no sense, that is the only check: nothing follows from them.

    ``stated``, ``stated_props``: the steps, and what holds parts, that its log states. Default: what follows from the
    plan.
    """
    progress.stage("plan")
    values = check_values(record.plan, record.motions, record.context)
    if not values.passed:
        return _named(Verification((values,)), record)
    store = Store()
    of_plan = verify_plan_over_time(record.plan, record.motions, record.context, store=store, workers=workers).checks
    progress.stage("motions")
    of_motions = verify_motions_over_time(
        record.plan, record.motions, record.context, store=store, workers=workers
    ).checks
    steps = stated or record.steps
    # The joints of an extract are not all known.
    is_whole = not record.context and len(record.motions) == len(record.planned)
    any_steps = steps != Steps() or (is_whole and record.plan.site.rules.curing is not None)
    of_steps = (verify_steps(record.plan, record.motions, steps, store),) if any_steps else ()
    props = record.props if stated_props is None else stated_props
    any_props = props != Props() or (is_whole and record.plan.site.rules.props is not None)
    of_props = (verify_props(record.plan, record.motions, steps, props, store),) if any_props else ()
    if record.motions and (record.plan.site.moving is not None or steps.moves):
        of_steps = (*of_steps, verify_set_ups(record.plan, record.motions, steps, record.context))
    checks = (values, *with_coverage(record.plan, (*of_plan, *of_motions, *of_steps, *of_props)))
    if record.carried_out is not None and Verification(checks).verified:
        checks += check_carried_out(record.plan, record.motions, record.carried_out)
    return _named(Verification(checks, not_current(record.plan, record.motions)), record)


def _named(verdict: Verification, record: PlanLog) -> Verification:
    """Return a verdict whose failures name parts as people know them: the proof knows them by their ids."""
    if verdict.verified:
        return verdict
    names = names_by_id(record.plan.site)
    checks = (replace(one, failures=[with_names(failure, names) for failure in one.failures]) for one in verdict.checks)
    return replace(verdict, checks=tuple(checks))
