"""``bimvox verify``: proves a log again, from the log alone."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from bimvox.crane.machine import identity
from bimvox.library.claims import Given
from bimvox.library.verify import prove, prove_further, read_whole
from bimvox.log.plan_log import PlanLog, all_remarks
from bimvox.progress import Progress
from bimvox.records.lift import infeasible_among
from bimvox.records.proof import CHECK, Check, Verification
from bimvox.records.steps import by_other_means, not_lifted_groups, proven_in_words, set_up_documents
from bimvox.remarks.conditions import conditions_of
from bimvox.remarks.not_covered import NotCovered, not_covered_by
from bimvox.units import clock


def verify(
    log: Path,
    *,
    site: Path | None = None,
    model: Path | None = None,
    obstructions: Path | None = None,
    programme: Path | None = None,
    traffic: str | None = None,
    search: bool = False,
    progress: Progress,
) -> dict[str, Any]:
    """Prove a log again, as :func:`bimvox.verify` does, and return the document of ``bimvox verify --json``.

    ``site``, ``model``, ``obstructions`` and ``programme`` are files that one holds, ``traffic`` is what was given to
    ``bimvox watch``: the log must be of them. With ``search``, what is called infeasible is searched again, and so are
    the fewest moves.

    Raises:
        LogFileError: If it is damaged or not a bimvox log.
    """
    contents, record = read_whole(log, progress)
    given = Given(site, model, obstructions, programme, traffic)
    proof = prove(contents, record, progress)
    proof = prove_further(proof, record, given, search=search, progress=progress)
    progress.finish()
    return {
        "log": str(log),
        "verified": proof.verified,
        "bound_to": list(given.names),
        "cranes": [identity(crane) for crane in record.plan.site.cranes],
        "checks": _as_json(proof.checks),
        "verdict": _in_words(proof, record),
        "claims": [claim.to_dict() for claim in proof.claims],
        "conditions": _conditions(record),
        "not_covered": [line.to_dict() for line in _not_covered(record)],
        "remarks": [remark.to_dict() for remark in all_remarks(record)],
        "not_current": _lifts_as_json(record, proof.not_current),
        "current_since_s": record.plan.history[-1].until_ns / 1e9 if record.plan.history else None,
        "lifts": len(record.planned),
        "infeasible_lifts": len(infeasible_among(record.plan.lifts)),
        "not_lifted": [
            one.to_dict() for one in not_lifted_groups(record.plan.site, record.all_lifts, record.motions, record.steps)
        ],
        **set_up_documents(record.plan.site, record.motions, record.steps),
        **record.steps.documents(record.plan.site),
        **record.props.documents(record.plan.site),
        "by_other_means": len(by_other_means(record.all_lifts)),
        "left_out": len(record.context),
        "revision": record.revision,
        "seconds": progress.seconds,
    }


def _conditions(record: PlanLog) -> list[str]:
    """Return the conditions under which the verdict holds; none if the values of the plan make no sense."""
    if record.remarks is None:
        return []
    return list(conditions_of(record.plan, record.motions, record.context))


def _not_covered(record: PlanLog) -> tuple[NotCovered, ...]:
    """Return what the plan does not cover; nothing if its values make no sense."""
    return () if record.remarks is None else not_covered_by(record.plan, record.context)


def _in_words(proof: Verification, record: PlanLog) -> str:
    """Return the verdict as one sentence, with the number of claims that it rests on."""
    if not record.planned:
        return "NO: nothing was proven, the log carries no planned lift"
    if not proof.verified:
        return "NO: a check failed"
    earlier, undecided = len(proof.not_current), sum(len(check.undecided) for check in proof.checks)
    before = f": done before {clock(record.plan.history[-1].until_ns / 1e9)}" if earlier else ""
    against = f" (for {earlier:,} lifts against earlier obstructions only{before})" if earlier else ""
    left = f"; {undecided:,} lifts could not be decided" if undecided else ""
    words = proven_in_words(len(by_other_means(record.all_lifts)), len(proof.claims))
    return f"yes: every check passed{against}{left}: {words}"


def _lifts_as_json(record: PlanLog, parts: Iterable[str]) -> list[dict[str, Any]]:
    components = record.plan.site.components
    lifts = {components[lift.component].id: lift for lift in record.plan.lifts}
    return [
        {
            "order": lifts[part].order,
            "number": lifts[part].number,
            "component": part,
            "name": components[lifts[part].component].label,
        }
        for part in parts
    ]


def _as_json(checks: Iterable[Check]) -> dict[str, Any]:
    return {
        check.name: {key: value for key, value in CHECK.of(check).items() if key != "name"}
        | {"unit": check.unit or None, "undecided": list(check.undecided)}
        for check in checks
    }
