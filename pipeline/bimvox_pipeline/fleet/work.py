"""Plans one run and writes its outcome to disk, also if it is an error."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from bimvox.errors import BimvoxError
from bimvox.files import sha256_of, write_atomically
from bimvox_pipeline.fleet.runs import Run, digest_of

RECORDS = "runs"
"""Folder of the records inside the fleet's folder."""

PLANNED, PARTLY, FAILED = "planned", "partly", "failed"
"""The outcome of a run: every lift planned, some infeasible, no plan."""


def record_file(folder: Path, name: str) -> Path:
    """Return the path of a run's record."""
    return folder / RECORDS / f"{name}.json"


def log_file(folder: Path, name: str) -> Path:
    """Return the path of a run's log."""
    return folder / f"{name}.mcap"


def carry_out(run: Run, folder: Path) -> None:
    """Plan a run and write its record, also for an error."""
    try:
        record = _planned(run, folder)
    except BimvoxError as error:
        record = failed(run, error.code, error.message, error.hint)
    except Exception as error:  # noqa: BLE001  (a fault in one run must not take the others down; the record names it)
        record = failed(run, "fault", f"{type(error).__name__}: {error}".splitlines()[0], None)
    write_record(folder, record)


def write_record(folder: Path, record: dict[str, Any]) -> None:
    """Write a run's record atomically."""
    write_atomically(record_file(folder, record["run"]), json.dumps(record, indent=1, ensure_ascii=False).encode())


def failed(run: Run, code: str, message: str, hint: str | None) -> dict[str, Any]:
    """Return the record of a run without a plan."""
    return {**_asked(run), "status": FAILED, "error": {"code": code, "message": message, "hint": hint}}


def _planned(run: Run, folder: Path) -> dict[str, Any]:
    from bimvox.library.arguments import PolicyWish
    from bimvox.progress import SilentProgress
    from bimvox_pipeline.plan import plan

    wish, log = run.wish, log_file(folder, run.name)
    digest = digest_of(wish)
    document = plan(
        wish.site,
        log,
        obstructions=wish.obstructions,
        wish=PolicyWish(wish.policy, wish.seed, wish.steps, wish.train),
        jobs=1,  # the runs share the processors
        progress=SilentProgress(),
    )
    return {
        **_asked(run),
        "status": PARTLY if document["infeasible"] else PLANNED,
        "error": None,
        "inputs": digest,
        "verified": document["verified"],
        "lifts": len(document["lifts"]),
        "infeasible": len(document["infeasible"]),
        "policy": document["policy"]["id"],
        "figures": document["figures"],
        "remarks": sum(remark["severity"] != "note" for remark in document["remarks"]),
        "serious_remarks": sum(remark["severity"] == "serious" for remark in document["remarks"]),
        "log": log.name,
        "log_sha256": sha256_of(log),
        "seconds": document["seconds"],
    }


def _asked(run: Run) -> dict[str, Any]:
    wish = run.wish
    return {
        "run": run.name,
        "site": wish.site.name,
        "obstructions": wish.obstructions.name if wish.obstructions else None,
        "seed": wish.seed,
    }
