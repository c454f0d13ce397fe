"""``bimvox optimise``: a better place and machine for the crane of a site, or of several, planned and proven."""

from __future__ import annotations

import csv
import hashlib
import io
from collections.abc import Mapping, Sequence
from dataclasses import astuple, replace
from functools import partial
from pathlib import Path
from typing import Any

from bimvox.crane.machine import Machine
from bimvox.crane.tower_crane import TowerCrane
from bimvox.errors import FileError
from bimvox.exporters.text import table as csv_table
from bimvox.files import (
    check_folder,
    default_output,
    read_input,
    require_input,
    seen_from,
    write_atomically,
    write_together,
)
from bimvox.library.optimise import with_set_up
from bimvox.library.set_up_search.choose import Searched, search_set_ups
from bimvox.library.set_up_search.moving import given_in_set_ups
from bimvox.library.set_up_search.pairs import names_of_two
from bimvox.library.set_up_search.search import Search
from bimvox.library.set_up_search.set_up import Effort, Tried, front_of, proven_front, why_beaten, why_lost
from bimvox.progress import Progress, SilentProgress
from bimvox.rendering.report.drawing_file import drawing_file
from bimvox.rendering.report.heat_map import HeatMap, heat_map
from bimvox.rendering.report.many_sites import COLUMNS, many_sites_page
from bimvox.rendering.report.page import Figure
from bimvox.rendering.report.set_ups import set_ups_page
from bimvox.rendering.report.site_drawing import drawing_of_site
from bimvox.site.catalogue import machines_for, name_of
from bimvox.site.config.calendar import Rates
from bimvox.site.config.site_config import Polygon, SiteConfig
from bimvox.site.crane_guess import machine_of_crane
from bimvox.site.machine import cranes_of
from bimvox_pipeline.fleet.command import fleet
from bimvox_pipeline.fleet.runs import FAILED, Run, Wish, asked, digest_of, log_file, runs_of
from bimvox_pipeline.fleet.schedule import Execution, locked, records_of
from bimvox_pipeline.studio.opened import SITE_SUFFIX, Opened, open_site
from bimvox_pipeline.studio.saving import as_text
from bimvox_pipeline.studio.setup import CraneSetup, Setup, read_setup, setup_of

_NUDGE_M = 1e-3
_STAMP = b"# bimvox optimise wrote the lines above, and may overwrite them while they are as they were: "
_DIGITS = 16
_COLUMNS = (
    "machine", "jib_m", "falls", "load_moment_tm", "x_m", "y_m", "set_ups", "second", "yard", "truckload_kg", "places",
    "parts", "parts_served", "estimated_hours", "estimated_cost", "estimated_utilisation", "currency", "why_lost",
)  # fmt: skip


def _base_of(one: Tried) -> tuple[float, float]:
    """Return where the mast of a set-up's first crane stands."""
    assert one.crane is not None
    x, y, _ = one.crane.base_m
    return x, y


def wanted_of(opened: Opened, one: Tried) -> tuple[SiteConfig, Setup]:
    """Return the values of a site file with another set-up, and that set-up as the studio has it."""
    if one.moving is None and not opened.config.moves:
        wanted = set_up(opened, one)
        return opened.with_setup(wanted), wanted
    config, own = with_set_up(opened, one), opened.setup_document
    made = setup_of(config, cranes_of(config), opened.means, own["part_kinds"])
    truckload_kg = config.rules.truckload_kg
    if truckload_kg != opened.config.rules.truckload_kg:
        made["truckload_kg"] = truckload_kg
    return config, read_setup(made)


def set_up(opened: Opened, one: Tried) -> Setup:
    """Return the set-up of a site whose crane stays with other cranes, and another yard and truckload if it has one."""
    (own,), config = opened.setup.cranes, opened.config
    if one.second is None:
        machine = name_of(config, one.machine)
        cranes = [CraneSetup(name=own.name, machine=machine, base_m=_base_of(one), jib_m=one.jib_m, falls=one.falls)]
    else:
        first, second = names_of_two(own.name)
        cranes = [
            _one_of_two(config, one, first, own.height_m),
            _one_of_two(config, one.second, second, own.height_m),
        ]
    more: dict[str, Any] = {}
    if one.yard is not None:
        more["yard"] = (one.yard.polygon,)
        if one.yard.truckload_kg != opened.config.rules.truckload_kg:
            more["truckload_kg"] = one.yard.truckload_kg
    access = with_set_up(opened, one).areas.access
    if access != opened.config.areas.access:
        more["access"] = access or ()
    return opened.setup.model_copy(update={"cranes": tuple(cranes), **more})


def _one_of_two(config: SiteConfig, one: Tried, name: str, given_m: float | None) -> CraneSetup:
    """Return a crane with its height: one of two may be raised to pass above the other.

    The height of the given crane would count as not set, and another machine would get a height of its own.
    """
    assert one.crane is not None
    height_m = one.crane.jib_height_m if one.crane.luffing is None else None
    if height_m is not None and height_m == given_m:
        height_m += _NUDGE_M
    return CraneSetup(
        name=name,
        machine=name_of(config, one.machine),
        base_m=_base_of(one),
        height_m=height_m,
        jib_m=one.jib_m,
        falls=one.falls,
    )


def _written(opened: Opened, one: Tried) -> Path:
    """Write the site file of a set-up next to the given one; one that somebody has edited since is not overwritten.

    Raises:
        FileError: If there is one that was edited.
    """
    stem = opened.site.name.removesuffix(SITE_SUFFIX).removesuffix(".toml")
    which = "-least-used" if one.is_least_used else ""
    if one.yard is not None:
        which += "" if one.yard.number is None else f"-yard-{one.yard.number + 1}"
        which += f"-{one.yard.truckload_kg:g}kg"
    which += f"-place-{one.place}" if one.place else ""
    if one.second is not None:
        which += f"-and-{_rig(one.second)}"
    path = opened.site.with_name(f"{stem}-{_rig(one)}{which}{SITE_SUFFIX}")
    config, wanted = wanted_of(opened, one)
    text, _, _ = as_text(opened, config, wanted, path)
    data = _stamped(text.encode())
    before = read_input(path, may_be_empty=True) if path.exists() else None
    if before == data:
        return path
    if before is not None and _stamped(before) != before:
        raise FileError(path, "exists already and may hold edits", hint="rename it, then optimise again")
    write_atomically(path, data)
    return path


def _stamped(data: bytes) -> bytes:
    """Return a site file with its stamp in the last line: while that is true, nobody has edited the file."""
    lines = [line for line in data.splitlines(keepends=True) if not line.startswith(_STAMP)]
    body = b"".join(lines)
    return body + _STAMP + hashlib.sha256(body).hexdigest()[:_DIGITS].encode() + b"\n"


def _rig(one: Tried) -> str:
    if one.moving is not None:
        return f"{one.machine}-{len(one.moving.cranes)}-set-ups"
    return f"{one.machine}-{one.jib_m:g}m-{one.falls}-falls"


def _table_of(found: Sequence[Tried], front: Sequence[Tried], parts: int, currency: str) -> str:
    """Return the table of all set-ups, each machine with its best places, and why each lost."""
    stream = io.StringIO()
    rows = csv.DictWriter(stream, _COLUMNS, lineterminator="\n")
    rows.writeheader()
    for one in sorted(found, key=lambda one: (-one.served, one.crane_s)):
        values: dict[str, Any] = {
            "machine": one.machine,
            "jib_m": f"{one.jib_m:g}",
            "falls": one.falls,
            "load_moment_tm": f"{one.load_moment_tm:.0f}",
            "yard": "given" if one.yard is None or one.yard.number is None else one.yard.number + 1,
            "truckload_kg": "" if one.yard is None else f"{one.yard.truckload_kg:g}",
            "places": len(one.bases_m),
            "parts": parts,
            "parts_served": one.served,
            "currency": currency,
            "why_lost": why_lost(one, front),
        }
        if one.crane is not None:
            x, y = _base_of(one)
            values |= {"x_m": f"{x:g}", "y_m": f"{y:g}", "estimated_hours": f"{one.crane_s / 3600.0:.3f}"}
            values |= {"estimated_cost": f"{one.cost:.0f}", "estimated_utilisation": f"{one.highest:.2f}"}
        if one.second is not None:
            values["second"] = "{} at ({:g}, {:g})".format(one.second.words, *_base_of(one.second))
        if one.moving is not None:
            values["set_ups"] = len(one.moving.cranes)
        rows.writerow(values)
    return stream.getvalue()


PAGE = "set-ups.html"
"""The page of a site's set-ups in its folder."""
_TABLE = "set-ups.csv"
_MAP = "crane-hours.svg"
_SVG = "image/svg+xml"


def optimise(
    site: Path,
    out: Path | None = None,
    *,
    crane: str | None = None,
    effort: Effort | None = None,
    execution: Execution | None = None,
    progress: Progress,
) -> dict[str, Any]:
    """Try every machine at every place, plan the best set-ups in full, and return the document of ``--json``.

    Other yards are tried too, if the yard may move. The site files of the set-ups are written next to the given one,
    which is planned too. A call that was killed is continued.

    Args:
        site: The site file, of one crane.
        out: Folder of logs, tables and the map; default: the site's name with ``-set-ups``, in the current folder.
        crane: A kind of crane, a machine of the catalogue, or the file of a machine next to the site file; default: all
            machines, and those whose files the site file names.
        effort: How many set-ups are planned in full, and how many other yards are tried; no yards if trucks or parts
            have their places.
        execution: How they are planned; default: in processes on this machine.
        progress: Receives the stages.

    Raises:
        InputError: If the site has several cranes or none, no machine serves any part, or the machine is not known.
        FileError: If a site file of that name exists with other content.
    """
    effort = effort or Effort()
    opened = open_site(require_input(site))
    config, machines = machines_for(opened.config, crane)
    opened = replace(opened, config=config)
    folder = check_folder(out or default_output(site, "-set-ups"))
    searched = search_set_ups(opened, str(site), machines, effort, folder, progress)
    search = searched.search
    plans = _Plans(opened, search, folder, execution or Execution(), progress)
    chosen, planned = searched.planned(plans.of, effort)
    found = [*searched.found, *(one for one in chosen if one not in searched.found)]
    front = front_of(found)
    budget, currency = opened.config.costs.budget, opened.config.costs.currency
    progress.stage("table")
    baseline = plans.given
    best = proven_front(planned, budget)
    losers = [{**one, "why_lost": why_beaten(one, best, budget)} for one in planned if one not in best]
    table, picture, page = folder / _TABLE, folder / _MAP, folder / PAGE
    rows = _table_of(found, front, len(search.work.places_m), currency)
    map_svg = heat_map(_heat(opened, _shown(searched.lattice)))
    document = {
        "tried": searched.tried,
        "machines": len(searched.rigs),
        "trials": searched.trials,
        "parts": len(search.work.places_m),
        "standing_hours": round(plans.standing_h, 4),
        "least_moving_hours": round(search.least_moving_s(found) / 3600.0, 4),
        "least_cost": round(_least_cost(searched, machines), 2),
        "baseline": baseline,
        "front": best,
        "losers": losers,
        "currency": currency,
        "costs": opened.config.costs.model_dump(mode="json"),
        "verified": plans.verified,
    }
    drawn = [(opened.config, "The given set-up")]
    drawn += [
        (wanted_of(opened, one)[0], one.words) for one, figures in zip(chosen, planned, strict=True) if figures in best
    ]
    drawings = [
        Figure(drawing_file(drawing_of_site(config, opened.building), words), _SVG, words) for config, words in drawn
    ]
    heat = Figure(map_svg, _SVG, "Estimated crane hours by the place of the mast")
    listed = list(csv.DictReader(io.StringIO(rows)))
    whole = set_ups_page({"site": site.name, **_as_linked(document, folder)}, listed, drawings, heat)
    write_together({table: rows.encode(), picture: map_svg, page: whole}, inputs=[site])
    progress.finish()
    files_written = {"folder": str(folder), "table": str(table), "map": str(picture), "page": str(page)}
    return {"site": str(site), **files_written, **document, "seconds": progress.seconds}


def _shown(lattice: Sequence[Tried]) -> Tried:
    """Return the machine whose places the map shows: of those of the front from one place the fastest."""
    able = front_of(lattice) or [one for one in lattice if one.crane is not None]
    return min(able, key=lambda one: (-one.served, one.crane_s))


def _least_cost(searched: Searched, machines: Sequence[Machine]) -> float:
    most = max(one.served for one in searched.found if one.second is None)
    moving = {one.machine for one in searched.found if one.moving is not None and one.served == most}
    return searched.search.least_cost(machines, most, moving)


def _as_linked(document: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """Return a document whose files are named as they are seen from a folder."""

    def linked(one: dict[str, Any]) -> dict[str, Any]:
        log = None if one["log"] is None else Path(one["log"]).name
        return {**one, "site": seen_from(folder.resolve(), Path(one["site"]).resolve()).as_posix(), "log": log}

    several = {key: [linked(one) for one in document[key]] for key in ("front", "losers")}
    return {**document, **several, "baseline": linked(document["baseline"])}


class _Plans:
    """The plans of a site's set-ups, as documents; those of earlier calls are kept.

    Attributes:
        standing_h: How long the crane stands.
        given: The given set-up, once any was planned.
        verified: Whether every plan is.
    """

    def __init__(self, opened: Opened, search: Search, folder: Path, execution: Execution, progress: Progress) -> None:
        self._opened, self._search, self._folder = opened, search, folder
        self._execution, self._progress = execution, progress
        self.standing_h = float(search.work.standing_s.sum()) / 3600.0
        self.given: dict[str, Any] = {}
        self.verified = False

    def of(self, chosen: Sequence[Tried]) -> list[dict[str, Any]]:
        """Return the plans of set-ups, in their order."""
        site, search = self._opened.site, self._search
        files = [_written(self._opened, one) for one in chosen]
        wishes = [Wish(path) for path in (site, *files)]
        execution = replace(self._execution, fresh=self._execution.fresh and not self.given)
        runs = fleet(wishes, self._folder, execution=execution, progress=self._progress)
        by_site = {
            run.wish.site: {**record, "log": str(log_file(self._folder, run.name))}
            for run, record in zip(runs_of(wishes), runs["runs"], strict=True)
        }
        self.verified = runs["verified"]
        given = _given(self._opened, search)
        own_rates = search.rates(machine_of_crane(cranes_of(self._opened.config)[0]))
        self.given = _planned(site, by_site, given, own_rates, self.standing_h)
        return [
            _planned(path, by_site, _found(one), search.rates_of(one), self.standing_h)
            for path, one in zip(files, chosen, strict=True)
        ]


def _given(opened: Opened, search: Search) -> dict[str, Any]:
    crane, *others = cranes = cranes_of(opened.config)
    served, crane_s, moves_s = given_in_set_ups(opened) if others else (*search.of(crane), 0.0)
    return {
        "machine": crane.machine or crane.name,
        "jib_m": crane.jib_length_m,
        "falls": crane.falls,
        "base_m": [float(value) for value in crane.base_m[:2]],
        "set_ups": _set_ups(cranes, ()) if others else None,
        "second": None,
        "yard": None,
        "truckload_kg": None,
        "parts_served": served,
        "crane_s": crane_s,
        "moves_s": moves_s,
    }


def _found(one: Tried) -> dict[str, Any]:
    return {
        **_stands(one),
        "set_ups": None if one.moving is None else _set_ups(one.moving.cranes, one.moving.yard),
        "second": None if one.second is None else _stands(one.second),
        "yard": None if one.yard is None or one.yard.number is None else [list(corner) for corner in one.yard.polygon],
        "truckload_kg": None if one.yard is None else one.yard.truckload_kg,
        "parts_served": one.served,
        "crane_s": one.crane_s,
        "moves_s": one.moves_s,
    }


def _set_ups(cranes: Sequence[TowerCrane], yards: Sequence[Polygon]) -> list[dict[str, Any]]:
    """Return where a crane that moves stands, one place after the other, with which boom, and the yard there.

    ``yards``: one for each set-up, or the site file's.
    """
    own = yards if len(yards) == len(cranes) else [None] * len(cranes)
    return [
        {"base_m": [float(value) for value in one.base_m[:2]], "boom_m": one.jib_own_m, "yard": yard}
        for one, yard in zip(cranes, own, strict=True)
    ]


def _stands(one: Tried) -> dict[str, Any]:
    base_m = [float(value) for value in _base_of(one)]
    return {"machine": one.machine, "jib_m": one.jib_m, "falls": one.falls, "base_m": base_m}


def _planned(
    path: Path,
    by_site: Mapping[Path, dict[str, Any]],
    values: dict[str, Any],
    rates: Rates,
    standing_h: float,
) -> dict[str, Any]:
    """Return what is known of a set-up: its estimate, and its plan."""
    record = by_site[path.resolve()]
    figures = record.get("figures") or {}
    estimated_h, moves_h = values.pop("crane_s") / 3600.0, values.pop("moves_s") / 3600.0
    hours, refused = figures.get("crane_hours"), record.get("infeasible")
    return {
        "site": str(path),
        **values,
        "estimated_hours": round(estimated_h, 4),
        "estimated_cost": round(rates.total(estimated_h + moves_h), 2),
        "status": record["status"],
        "refused": refused,
        "hours": hours,
        "move_hours": figures.get("move_hours", 0.0) if figures else None,
        "hook_hours": figures.get("hook_hours"),
        "lorries": (figures.get("unloading") or {}).get("lorries"),
        # Of two cranes, one stands while the other moves; for a refused part, none stands.
        "moving_hours": None if hours is None or refused or values["second"] else round(hours - standing_h, 6),
        "hire_days": figures.get("hire_days"),
        "cost": (figures.get("cost") or {}).get("total"),
        "critical_lifts": figures.get("critical_lifts"),
        "highest_utilisation": figures.get("highest_utilisation"),
        "log": record["log"] if figures else None,
        "error": record.get("error"),
    }


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
        best_m=_base_of(one),
        given_m=cranes_of(opened.config)[0].base_m[:2],
    )


# Several sites: each site's search as a run of a fleet, one table and one page of all.

_OPTIMISED = "optimised"
_SITES_TABLE, _SITES_PAGE = "sites.csv", "sites.html"


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
        listed, page = folder / _SITES_TABLE, folder / _SITES_PAGE
        cells = ([row[name] for name in COLUMNS] for row in rows)
        write_together({listed: csv_table(COLUMNS, cells).encode(), page: many_sites_page(rows)})
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
    best = {
        words: min(front, key=lambda one: float(one[key]))
        for words, key in (("fastest", "hours"), ("cheapest", "cost"))
        if front
    }
    for what, one in {"given": given, **best}.items():
        row |= {f"{what}_{key}": one[key] for key in ("machine", "refused", "hours", "cost")}
    return row | {"page": f"{record['run']}/{PAGE}"}
