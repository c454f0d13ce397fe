"""The page of many sites' set-ups: one row a site, what was given and what was found; deterministic."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any
from urllib.parse import quote

from bimvox.rendering.page.source import Light
from bimvox.rendering.report.html import number, paragraph, row, section, table, tag, terms
from bimvox.rendering.report.page import printable
from bimvox.rendering.report.words import fixed, percent, span
from bimvox.rendering.words import counted, escape

COLUMNS = (
    "name", "site", "status", "error", "verified", "parts", "currency",
    *(f"{what}_{key}" for what in ("given", "fastest", "cheapest") for key in ("machine", "refused", "hours", "cost")),
    "page",
)  # fmt: skip
"""Columns of the table of sites."""
_HEADS = (
    "Site", "Set-ups", "Parts", "Hours\ngiven", "Hours\nfastest", "change", "Cost\ngiven", "Cost\ncheapest", "change",
)  # fmt: skip
Row = Mapping[str, Any]
"""A site: its columns by name, None if unknown."""


def many_sites_page(rows: Sequence[Row]) -> bytes:
    """Return the page, UTF-8; it makes no network requests and runs no scripts."""
    failed = sum(one["status"] == "failed" for one in rows)
    verified = all(one["verified"] for one in rows)
    words = (
        "verified" if verified else f"✕ {counted(failed, 'site')} failed" if failed else "✕ not every plan is verified"
    )
    chip = tag("p", words, f"chip {'clean' if verified else 'refused'}")
    title = counted(len(rows), "site") + ": set-ups"
    heading = tag("div", tag("h1", title) + paragraph("One row a site, in the order of sites.csv.", "faint"))
    sites = table(_HEADS, [_row(one) for one in rows], class_="lifts", caption="Sites")
    body = [
        tag("header", heading + tag("div", chip, "verdict")),
        tag("section", terms(_totals(rows)), "totals"),
        section("Sites", tag("div", sites, "wide"), id="sites"),
    ]
    return printable(title, "".join(body), {"sites": list(rows)})


def _totals(rows: Sequence[Row]) -> list[tuple[str, str]]:
    """Return the sums of hours and cost over the sites whose given and best set-ups are both planned."""
    result = []
    for words, what, key, digits in (("Crane hours", "fastest", "hours", 1), ("Cost", "cheapest", "cost", 0)):
        known = [one for one in rows if one[f"given_{key}"] and one[f"{what}_{key}"]]
        given, best = (sum(one[f"{which}_{key}"] for one in known) for which in ("given", what))
        if known and len({one["currency"] for one in known}) == 1:
            unit = f" {escape(known[0]['currency'])}" if key == "cost" else " h"
            said = f"{fixed(given, digits)} given, {number(best, fixed(best, digits), key)}{unit} {what}"
            result.append((words, f"{said}, {_change(given, best)}; {counted(len(known), 'site')}"))
    return result


def _row(one: Row) -> str:
    name = escape(one["name"])
    cells = [
        name if one["page"] is None else tag("a", name, href=quote(one["page"])),
        _words(one),
        number(one["parts"], f"{one['parts'] or 0:,}", "parts"),
    ]
    for what, key, digits in (("fastest", "hours", 2), ("cheapest", "cost", 0)):
        given, best = one[f"given_{key}"], one[f"{what}_{key}"]
        cells += [number(value, fixed(value or 0.0, digits), key) for value in (given, best)]
        cells.append(_change(given, best) if given and best else "")
    return row(cells, "bad" if one["error"] else "")


def _words(one: Row) -> str:
    """Return the machines, each with what it refuses; the reason if there is none."""
    if one["error"]:
        return f"<b>failed</b>: {escape(one['error'])}"
    named = []
    for what in ("given", "fastest", "cheapest"):
        if one[f"{what}_machine"] is not None:
            refused = one[f"{what}_refused"]
            more = f", {counted(refused, 'part')} refused" if refused else ""
            named.append(f"{what} {escape(one[f'{what}_machine'])}{more}")
    return "<br>".join(named)


def _change(given: float, best: float) -> str:
    share = 1.0 - best / given
    return f"{percent(abs(share), 0)} {'less' if share >= 0.0 else 'more'}"


# The page of many plans: one row a run, in the look of the report; deterministic.

_COLUMNS = (
    "Run", "Status", "Crane time", "Loaded", "Critical\nlifts", "Parts", "Planned", "Infeasible", "Remarks", "Files",
)  # fmt: skip
_Plan = Mapping[str, Any]
"""A run as the summary table has it: its columns by name."""


def many_plans_page(rows: Sequence[_Plan], files: Mapping[str, Mapping[str, str]]) -> bytes:
    """Return the page, UTF-8; it makes no network requests and runs no scripts.

    ``files``: by run, the names of its files in the page's folder by what they are.
    """
    title = counted(len(rows), "plan")
    lead = "One row a run, in the order of summary.csv, which has more columns."
    heading = tag("div", f"<h1>{title}</h1>{paragraph(lead, 'faint')}")
    chips = "".join(tag("p", escape(words), f"chip {light}") for words, light in _verdict(rows))
    runs = table(
        _COLUMNS, [_row_of_plan(one, files.get(one["run"], {})) for one in rows], class_="lifts", caption="Runs"
    )
    body = [
        tag("header", heading + tag("div", chips, "verdict")),
        tag("section", terms(_totals_of_plans(rows)), "totals"),
        section("Runs", tag("div", runs, "wide"), id="runs"),
    ]
    return printable(f"{title}: summary", "".join(body), {"runs": list(rows), "files": dict(files)})


def _verdict(rows: Sequence[_Plan]) -> list[tuple[str, Light]]:
    """Return the words of the verdict and their colours: the proof, then the remarks."""
    failed, serious, remarks = _failed(rows), _sum(rows, "serious_remarks"), _sum(rows, "remarks")
    light = Light.SERIOUS if serious else Light.REMARKED if remarks else Light.CLEAN
    unproven = sum(one["verified"] is False for one in rows)
    if failed or unproven:
        words = [counted(failed, "run") + " failed"] * bool(failed) + [f"{unproven:,} NOT PROVEN"] * bool(unproven)
        proof = f"✕ {', '.join(words)}", Light.REFUSED
    else:
        proof = f"{'✓ ' * (not remarks)}every planned lift is proven", light
    said = counted(int(remarks), "remark") if remarks else "no remarks"
    said += f", {serious:,} serious" if serious else ""
    return [proof, (said, Light.PLAIN if failed and not remarks else light)]


def _totals_of_plans(rows: Sequence[_Plan]) -> list[tuple[str, str]]:
    whole, partly = (sum(one["status"] == status for one in rows) for status in ("planned", "partly"))
    hours, loaded, travel_m = (_sum(rows, key) for key in ("crane_hours", "loaded_hours", "hook_travel_m"))

    def count(key: str) -> str:
        return _whole(int(_sum(rows, key)), key)

    return [
        ("Runs", f"{whole:,} planned, {partly:,} in part, {_failed(rows):,} failed"),
        ("Parts", f"{count('planned')} of {count('lifts')} planned, {count('infeasible')} infeasible"),
        ("Crane time", f"{_hours(hours, 'crane_hours')}, {_hours(loaded, 'loaded_hours')} of it loaded"),
        ("Hook travel", number(travel_m, f"{fixed(travel_m / 1000, 2)} km", "hook_travel_m")),
        ("Critical lifts", count("critical_lifts")),
    ]


def _row_of_plan(one: _Plan, files: Mapping[str, str]) -> str:
    infeasible = one["infeasible"] or 0
    cells = [
        escape(one["run"]),
        _status(one),
        *(_hours(one[key], key) for key in ("crane_hours", "loaded_hours")),
        *(_whole(one[key], key) for key in ("critical_lifts", "lifts", "planned", "infeasible")),
        _remarks(one),
        " ".join(tag("a", escape(what), href=quote(name)) for what, name in files.items()),
    ]
    return row(cells, "bad" if one["error"] else "critical" if infeasible else "")


def _status(one: _Plan) -> str:
    """Return the status in words, with the site and its obstructions; the reason if there is no plan."""
    asked = [one["site"], *([one["obstructions"]] if one["obstructions"] else [])]
    asked += [] if one["seed"] is None else [f"seed {one['seed']}"]
    words = {"planned": "planned", "partly": "planned in part", "failed": "failed"}[one["status"]]
    proven = ", NOT PROVEN" if one["verified"] is False else ", proven" if one["verified"] else ""
    reason = f": {escape(one['error'])}" if one["error"] else ""
    return f"<b>{words}{proven}</b>{reason}<br>{tag('span', escape(', '.join(asked)), 'faint')}"


def _remarks(one: _Plan) -> str:
    serious = one["serious_remarks"]
    more = f" ({tag('span', f'{serious:,} serious', 'reserved')})" if serious else ""
    return _whole(one["remarks"], "remarks") + more


def _hours(value: float | None, key: str) -> str:
    return number(value, span(3600.0 * (value or 0.0)), key)


def _whole(value: int | None, key: str) -> str:
    return number(value, f"{value or 0:,}", key)


def _sum(rows: Sequence[_Plan], key: str) -> float:
    return sum(one[key] or 0 for one in rows)


def _failed(rows: Sequence[_Plan]) -> int:
    return sum(one["status"] == "failed" for one in rows)
