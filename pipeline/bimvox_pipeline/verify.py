"""``bimvox verify``: a log proven again, from the log alone."""

from __future__ import annotations

from collections.abc import Iterable
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bimvox_pipeline.artifacts import require_input
from bimvox_pipeline.progress import Progress

if TYPE_CHECKING:
    from bimvox.log.mcap.reader import Contents
    from bimvox.log.plan_log import PlanLog
    from bimvox.records.proof import Check, Verification


def verify(log: Path, *, progress: Progress) -> dict[str, Any]:
    """Prove a log again: plan, motions, digests, and that its topics agree.

    Everything comes from the file: the site with its parts' triangles is inside. The model that the site was made from
    is not, so voxelizing is not repeated; that every part's cells cover its triangles is checked. Of an extract, the
    lifts that it carries are proven; the others count as done or waiting where the plan says.

    Args:
        log: The log.
        progress: Told of the stages.

    Returns:
        The document of ``bimvox verify --json``.

    Raises:
        LogFileError: If it is damaged or not ours.
    """
    from bimvox.log.check import USED_TOPICS
    from bimvox.log.mcap.reader import read_contents, read_file
    from bimvox.log.reader import log_of

    require_input(log)
    progress.stage("read")
    contents = read_contents(read_file(log), log, USED_TOPICS)
    record = log_of(contents, log)
    if record.context:
        progress.note(f"this log is an extract: {len(record.plan.lifts)} of {len(record.all_lifts)} lifts are in it")
    proof = prove(contents, record, progress)
    progress.finish()
    return {
        "log": str(log),
        "verified": proof.verified,
        "checks": _as_json(proof.checks),
        "lifts": len(record.planned),
        "infeasible_lifts": len(record.plan.lifts) - len(record.planned),
        "left_out": len(record.context),
        "revision": record.revision,
        "seconds": progress.seconds,
    }


def prove(contents: Contents, record: PlanLog, progress: Progress) -> Verification:
    """Prove what was read from a log: plan, motions, digests, and that its topics agree.

    Args:
        contents: The log's messages and attachments; of the topics at least ``USED_TOPICS``.
        record: What they mean.
        progress: Told of the stages.
    """
    from bimvox.log.check import check_commands, check_digests, check_load_poses
    from bimvox.records.proof import Verification

    checks = prove_plan(record, progress).checks
    progress.stage("log")
    topics = (check_digests(contents, record), check_load_poses(contents, record), check_commands(contents, record))
    return Verification((*checks, *topics))


def prove_plan(record: PlanLog, progress: Progress) -> Verification:
    """Prove a plan and its motions, whatever they were read from.

    Args:
        record: The plan.
        progress: Told of the stages.
    """
    from bimvox.proof.over_time import verify_motions_over_time, verify_plan_over_time
    from bimvox.records.proof import Verification

    progress.stage("plan")
    checks = verify_plan_over_time(record.plan, record.motions, record.context).checks
    progress.stage("motions")
    return Verification((*checks, *verify_motions_over_time(record.plan, record.motions, record.context).checks))


def _as_json(checks: Iterable[Check]) -> dict[str, Any]:
    return {
        check.name: {
            "passed": check.passed,
            "samples": check.samples,
            "worst": None if check.worst is None or not isfinite(check.worst) else round(check.worst, 9),
            "unit": check.unit or None,
            "failed": check.failed,
            "failures": list(check.failures),
        }
        for check in checks
    }
