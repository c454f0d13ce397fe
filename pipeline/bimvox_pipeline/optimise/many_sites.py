"""``bimvox optimise`` of several sites: each site's search as a run of a fleet, one table and one page of all."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import astuple
from functools import partial
from pathlib import Path
from typing import Any

from bimvox.errors import BimvoxError
from bimvox.files import write_together
from bimvox.library.set_up_search.set_up import Effort
from bimvox.processes import processors
from bimvox.progress import Progress, SilentProgress
from bimvox.rendering.report.many_sites import COLUMNS, many_sites_page
from bimvox_pipeline.fleet.command import locked
from bimvox_pipeline.fleet.runs import FAILED, Run, Wish, digest_of, failed, record_file, runs_of, write_record
from bimvox_pipeline.fleet.schedule import Backend, carry_out_all
from bimvox_pipeline.optimise.optimise import PAGE, optimise

_OPTIMISED = "optimised"
_TABLE, _PAGE = "sites.csv", "sites.html"


def optimise_all(
    sites: Sequence[Path],
    folder: Path,
    *,
    crane: str | None = None,
    effort: Effort | None = None,
    backend: Backend = "loky",
    jobs: int | None = None,
    fresh: bool = False,
    progress: Progress,
) -> dict[str, Any]:
    """Look for the best set-ups of several sites, and return the document of ``--json``.

    Each site has a folder of its own in the given one. A call that was killed is continued: sites that did not change
    since are kept. The arguments are those of :func:`optimise`; ``jobs`` is the number of sites in parallel.

    Raises:
        InputError: If the folder cannot be used, or the backend is not installed.
    """
    runs, work = runs_of(Wish(site) for site in sites), partial(_optimised, crane=crane, effort=effort, fresh=fresh)
    asked = _asked(crane, effort)
    with locked(folder):
        kept = {run.name for run in runs if not fresh and _is_there(run, folder, asked)}
        left = [run for run in runs if run.name not in kept]
        for run in left:
            record_file(folder, run.name).unlink(missing_ok=True)
        carry_out_all(
            left, folder, backend=backend, jobs=jobs or processors(), address=None, progress=progress, work=work
        )
        records = [json.loads(record_file(folder, run.name).read_bytes()) for run in runs]
        progress.stage("table")
        rows = [_row(record) for record in records]
        table, page = folder / _TABLE, folder / _PAGE
        write_together({table: _csv(rows), page: many_sites_page(rows)})
        progress.finish()
    return {
        "sites": [
            {
                **row,
                "kept": record["run"] in kept,
                "found": record.get("found"),
                "error_code": record["error"] and record["error"]["code"],
            }
            for record, row in zip(records, rows, strict=True)
        ],
        "folder": str(folder),
        "table": str(table),
        "page": str(page),
        "failed": sum(record["status"] == FAILED for record in records),
        "kept": len(kept),
        "verified": all(row["verified"] for row in rows),
        "seconds": progress.seconds,
    }


def _optimised(run: Run, folder: Path, *, crane: str | None, effort: Effort | None, fresh: bool) -> None:
    """Optimise a site, its plans one after the other, and write its record, also for an error."""
    try:
        digest, site, out = digest_of(run.wish), run.wish.site, folder / run.name
        found = optimise(site, out, crane=crane, effort=effort, jobs=1, fresh=fresh, progress=SilentProgress())
        record = {**failed(run, "", "", None), "status": _OPTIMISED, "error": None}
        record |= {"inputs": digest, "asked": _asked(crane, effort), "found": found}
    except BimvoxError as error:
        record = failed(run, error.code, error.message, error.hint)
    except Exception as error:  # noqa: BLE001  (a fault in one site must not take the others down; the record names it)
        record = failed(run, "fault", f"{type(error).__name__}: {error}".splitlines()[0], None)
    write_record(folder, record)


def _asked(crane: str | None, effort: Effort | None) -> list[object]:
    """Return what a site's result depends on besides its files."""
    return [crane, *astuple(effort or Effort())]


def _is_there(run: Run, folder: Path, asked: Sequence[object]) -> bool:
    """Return whether an earlier call found the same for the same files, and its page is there."""
    file = record_file(folder, run.name)
    if not (file.exists() and (folder / run.name / PAGE).exists()):
        return False
    try:
        record = json.loads(file.read_bytes())
        return bool(record["status"] != FAILED and record["asked"] == asked and record["inputs"] == digest_of(run.wish))
    except (ValueError, KeyError, TypeError, BimvoxError):
        return False


def _row(record: Mapping[str, Any]) -> dict[str, Any]:
    """Return the row of a site: the given set-up, the fastest and the cheapest one; unknown values are None."""
    error, found = record["error"], record.get("found")
    row = dict.fromkeys(COLUMNS) | {"name": record["run"], "site": record["site"], "status": record["status"]}
    if found is None:
        return row | {"error": f"{error['code']}: {error['message']}"}
    given, front = found["baseline"], found["front"]
    row |= {"verified": found["verified"], "parts": found["parts"], "currency": found["currency"]}
    best = {"fastest": front[0], "cheapest": min(front, key=lambda one: float(one["cost"]))} if front else {}
    for what, one in {"given": given, **best}.items():
        row |= {f"{what}_{key}": one[key] for key in ("machine", "refused", "hours", "cost")}
    return row | {"page": f"{record['run']}/{PAGE}"}


def _csv(rows: Sequence[Mapping[str, Any]]) -> bytes:
    text = io.StringIO()
    writer = csv.DictWriter(text, COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue().encode()
