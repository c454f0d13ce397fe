"""``bimvox optimise``: a better place and machine for the crane of a site, planned and proven."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from bimvox.errors import FileError, InputError
from bimvox.files import default_output, require_input, write_atomically
from bimvox.progress import Progress
from bimvox.rendering.report.heat_map import HeatMap, heat_map
from bimvox.site.catalogue import catalogue
from bimvox.site.costs import Rates
from bimvox.site.crane_guess import machine_of_crane
from bimvox.site.machine import cranes_of
from bimvox.site.machine_names import machines_called
from bimvox_pipeline.fleet.backends import Backend
from bimvox_pipeline.fleet.command import fleet
from bimvox_pipeline.fleet.runs import Wish, runs_of
from bimvox_pipeline.fleet.work import log_file
from bimvox_pipeline.optimise.front import front_of, to_plan, why_lost
from bimvox_pipeline.optimise.search import Search, Tried
from bimvox_pipeline.studio.opened import SITE_SUFFIX, Opened, open_site
from bimvox_pipeline.studio.saving import as_text
from bimvox_pipeline.studio.setup import CraneSetup

MEMBERS = 6
"""How many set-ups are planned in full if nothing else is asked for."""
_TABLE = "set-ups.csv"
_MAP = "crane-hours.svg"
_COLUMNS = (
    "machine", "jib_m", "falls", "load_moment_tm", "x_m", "y_m", "places", "parts", "parts_served",
    "estimated_hours", "estimated_cost", "currency", "why_lost",
)  # fmt: skip


def optimise(
    site: Path,
    out: Path | None = None,
    *,
    crane: str | None = None,
    members: int = MEMBERS,
    backend: Backend = "loky",
    jobs: int | None = None,
    fresh: bool = False,
    progress: Progress,
) -> dict[str, Any]:
    """Try every machine at every place, plan the best set-ups in full, and return the document of ``--json``.

    The site files of the set-ups are written next to the given one, which is planned too.

    Args:
        site: The site file, of one crane.
        out: Folder of logs, tables and the map; default: the site's name with ``-set-ups``, in the current folder.
        crane: A kind of crane, or a machine of the catalogue; default: all machines.
        members: How many set-ups are planned in full.
        backend: Name of the backend that plans them.
        jobs: Number of plans in parallel; default: one per processor core.
        fresh: Plan again what an earlier call has planned.
        progress: Receives the stages.

    Raises:
        InputError: If the site has several cranes or none, no machine serves any part, or the machine is not known.
        FileError: If a site file of that name exists with other content.
    """
    machines = catalogue() if crane is None else machines_called(crane)
    opened = open_site(require_input(site))
    cranes = cranes_of(opened.config)
    if len(cranes) != 1:
        raise InputError(
            f"{site}: the place of one crane is looked for, but the site has {len(cranes)}",
            hint="give the site file one crane",
        )
    folder = out or default_output(site, "-set-ups")
    search = Search(opened, progress)
    progress.stage("try", len(machines))
    found: list[Tried] = []
    for machine in machines:
        found += search.tried([machine])
        progress.advance()
    progress.finish()
    front = front_of(found)
    chosen = to_plan(found, front, members)
    if not chosen and any(one.served for one in found):
        cheapest = min(one.cost for one in found if one.served)
        raise InputError(
            f"{site}: no set-up is within the budget; the cheapest costs {cheapest:,.0f}",
            hint="raise [costs] budget",
        )
    if not chosen:
        raise InputError(
            f"{site}: no machine serves any part", hint="`bimvox cranes SITE` says why; move the yard, or lift less"
        )
    files = [_written(opened, one) for one in chosen]
    wishes = [Wish(path) for path in (site, *files)]
    runs = fleet(wishes, folder, backend=backend, jobs=jobs, fresh=fresh, progress=progress)
    progress.stage("table")
    table, picture = folder / _TABLE, folder / _MAP
    write_atomically(table, _csv(found, front, len(search.work.places_m), opened.config.costs.currency).encode())
    fastest = front[0]
    write_atomically(picture, heat_map(_heat(opened, fastest)))
    progress.finish()
    planned = zip(runs_of(wishes), runs["runs"], strict=True)
    records = {run.wish.site: {**record, "log": str(log_file(folder, run.name))} for run, record in planned}
    (own,) = cranes
    served, crane_s = search.of(own)
    own_rates = search.rates(machine_of_crane(own))
    rates = {machine.name: search.rates(machine) for machine in machines}
    given = {"machine": own.machine or own.name, "jib_m": own.jib_length_m, "falls": own.falls}
    standing_h = float(search.work.standing_s.sum()) / 3600.0
    members_found = [
        _member(site, records, {**given, "base_m": own.base_m[:2]}, served, crane_s, own_rates),
        *(
            _member(
                path,
                records,
                {"machine": one.machine, "jib_m": one.jib_m, "falls": one.falls, "base_m": _base(one)},
                one.served,
                one.crane_s,
                rates[one.machine],
            )
            for path, one in zip(files, chosen, strict=True)
        ),
    ]
    return {
        "site": str(site),
        "folder": str(folder),
        "table": str(table),
        "map": str(picture),
        "tried": int(sum(len(one.bases_m) for one in found)),
        "machines": len(found),
        "parts": len(search.work.places_m),
        "standing_hours": round(standing_h, 4),
        "set_ups": members_found,
        "best": _best(members_found, "crane_hours", opened.config.costs.budget),
        "cheapest": _best(members_found, "cost", opened.config.costs.budget),
        "currency": opened.config.costs.currency,
        "costs": opened.config.costs.model_dump(mode="json"),
        "verified": runs["verified"],
        "seconds": progress.seconds,
    }


def _best(found: Sequence[dict[str, Any]], by: str, budget: float | None) -> str | None:
    """Return the site file of the plan with most parts and, of these, least of a figure.

    None if no plan is within the budget.
    """
    planned = [one for one in found if one["crane_hours"] is not None and (budget is None or one["cost"] <= budget)]
    best = min(planned, key=lambda one: (one["infeasible"], one[by]), default=None)
    return None if best is None else str(best["site"])


def _base(one: Tried) -> tuple[float, float]:
    assert one.crane is not None
    x, y, _ = one.crane.base_m
    return x, y


def _member(
    path: Path, records: dict[Path, dict[str, Any]], values: dict[str, Any], served: int, crane_s: float, rates: Rates
) -> dict[str, Any]:
    """Return what is known of a set-up: its estimate, and its plan."""
    record = records[path.resolve()]
    figures = record.get("figures") or {}
    return {
        "site": str(path),
        **values,
        "base_m": [float(value) for value in values["base_m"]],
        "parts_served": served,
        "estimated_hours": round(crane_s / 3600.0, 4),
        "estimated_cost": round(rates.total(crane_s / 3600.0), 2),
        "status": record["status"],
        "infeasible": record.get("infeasible"),
        "crane_hours": figures.get("crane_hours"),
        "cost": None if (hours := figures.get("crane_hours")) is None else round(rates.total(hours), 2),
        "critical_lifts": figures.get("critical_lifts"),
        "log": record["log"] if figures else None,
        "error": record.get("error"),
    }


def _written(opened: Opened, one: Tried) -> Path:
    """Write the site file of a set-up next to the given one; one that is there already must be the same."""
    crane, (own,) = one.crane, opened.setup.cranes
    assert crane is not None
    x, y, _ = crane.base_m
    stem = opened.site.name.removesuffix(SITE_SUFFIX).removesuffix(".toml")
    path = opened.site.with_name(f"{stem}-{one.machine}-{one.jib_m:g}m-{one.falls}-falls{SITE_SUFFIX}")
    changed = CraneSetup(name=own.name, machine=one.machine, base_m=(x, y), jib_m=one.jib_m, falls=one.falls)
    wanted = opened.setup.model_copy(update={"cranes": (changed,)})
    text, _, _ = as_text(opened, opened.with_setup(wanted), wanted, path)
    if path.exists():
        if path.read_bytes() != text.encode():
            raise FileError(path, "exists already and may hold edits", hint="rename it, then optimise again")
        return path
    write_atomically(path, text.encode())
    return path


def _csv(found: Sequence[Tried], front: Sequence[Tried], parts: int, currency: str) -> str:
    """Return the table of all machines, each with its best place, and why it lost."""
    stream = io.StringIO()
    rows = csv.writer(stream, lineterminator="\n")
    rows.writerow(_COLUMNS)
    for one in sorted(found, key=lambda one: (-one.served, one.crane_s)):
        size = f"{one.load_moment_tm:.0f}"
        x, y = ("", "") if one.crane is None else (f"{value:g}" for value in _base(one))
        hours = "" if one.crane is None else f"{one.crane_s / 3600.0:.3f}"
        cost = "" if one.crane is None else f"{one.cost:.0f}"
        row = (one.machine, f"{one.jib_m:g}", one.falls, size, x, y, len(one.bases_m), parts, one.served, hours)
        rows.writerow((*row, cost, currency, why_lost(one, front)))
    return stream.getvalue()


def _heat(opened: Opened, one: Tried) -> HeatMap:
    most = int(one.all_served.max())
    full = one.all_served == most
    areas = opened.config.areas
    return HeatMap(
        title=f"{one.machine}, jib {one.jib_m:g} m, {one.falls} falls: crane hours by the place of the mast",
        places_m=one.bases_m[full],
        hours=one.all_crane_s[full] / 3600.0,
        others_m=one.bases_m[~full],
        building=tuple(opened.trial.hulls),
        yards=tuple(areas.yard or ()),
        accesses=tuple(areas.access or ()),
        best_m=_base(one),
        given_m=cranes_of(opened.config)[0].base_m[:2],
    )
