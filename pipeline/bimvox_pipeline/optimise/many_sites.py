"""``bimvox optimise`` of several sites: each site's search as a run of a fleet, one table and one page of all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import astuple
from functools import partial
from pathlib import Path
from typing import Any

from bimvox.exporters.text import table
from bimvox.files import write_together
from bimvox.library.set_up_search.set_up import Effort
from bimvox.progress import Progress, SilentProgress
from bimvox.rendering.report.many_sites import COLUMNS, many_sites_page
from bimvox_pipeline.fleet.runs import FAILED, Run, Wish, asked, digest_of, runs_of
from bimvox_pipeline.fleet.schedule import Execution, locked, records_of
from bimvox_pipeline.optimise.optimise import PAGE, optimise

_OPTIMISED = "optimised"
_TABLE, _PAGE = "sites.csv", "sites.html"


def optimise_all(
    sites: Sequence[Path],
    folder: Path,
    *,
    crane: str | None = None,
    effort: Effort | None = None,
    execution: Execution | None = None,
    progress: Progress,
) -> dict[str, Any]:
    """Look for the best set-ups of several sites, and return the document of ``--json``.

    Each site has a folder of its own in the given one. A call that was killed is continued: sites that did not change
    since are kept. The arguments are those of :func:`optimise`, and ``execution`` is of the sites.

    Raises:
        InputError: If the folder cannot be used, or the backend is not installed.
    """
    execution, wanted = execution or Execution(), [crane, *astuple(effort or Effort())]
    work = partial(_optimised, crane=crane, effort=effort, fresh=execution.fresh)

    def is_whole(record: Mapping[str, Any]) -> bool:
        return bool(record["asked"] == wanted and (folder / record["run"] / PAGE).exists())

    with locked(folder):
        runs = runs_of(Wish(site) for site in sites)
        records = records_of(runs, folder, execution, is_whole=is_whole, work=work, progress=progress)
        progress.stage("table")
        rows = [_row(record) for record in records]
        listed, page = folder / _TABLE, folder / _PAGE
        cells = ([row[name] for name in COLUMNS] for row in rows)
        write_together({listed: table(COLUMNS, cells).encode(), page: many_sites_page(rows)})
        progress.finish()
    return {
        "sites": [
            {
                **row,
                "kept": record["kept"],
                "found": record.get("found"),
                "error_code": record["error"] and record["error"]["code"],
            }
            for record, row in zip(records, rows, strict=True)
        ],
        "folder": str(folder),
        "table": str(listed),
        "page": str(page),
        "failed": sum(record["status"] == FAILED for record in records),
        "kept": sum(record["kept"] for record in records),
        "verified": all(row["verified"] for row in rows),
        "seconds": progress.seconds,
    }


def _optimised(run: Run, folder: Path, *, crane: str | None, effort: Effort | None, fresh: bool) -> dict[str, Any]:
    """Optimise a site, its plans one after the other, and return its record."""
    digest, alone = digest_of(run.wish), Execution(jobs=1, fresh=fresh)
    found = optimise(
        run.wish.site, folder / run.name, crane=crane, effort=effort, execution=alone, progress=SilentProgress()
    )
    return {
        **asked(run),
        "status": _OPTIMISED,
        "error": None,
        "inputs": digest,
        "asked": [crane, *astuple(effort or Effort())],
        "found": found,
    }


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
