"""The page of many plans: one row a run, in the look of the report; deterministic."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any
from urllib.parse import quote

from bimvox.rendering.report.html import number, paragraph, row, section, table, tag, terms
from bimvox.rendering.report.page import printable
from bimvox.rendering.report.words import fixed, span
from bimvox.rendering.verdict import Light
from bimvox.rendering.words import counted, escape

_COLUMNS = (
    "Run", "Status", "Crane time", "Loaded", "Critical\nlifts", "Parts", "Planned", "Infeasible", "Remarks", "Files",
)  # fmt: skip
Row = Mapping[str, Any]
"""A run as the summary table has it: its columns by name."""


def many_plans_page(rows: Sequence[Row], files: Mapping[str, Mapping[str, str]]) -> bytes:
    """Return the page, UTF-8; it makes no network requests and runs no scripts.

    Args:
        rows: The runs, in the order of the table.
        files: By run, the names of its files in the page's folder by what they are.
    """
    title = counted(len(rows), "plan")
    lead = "One row a run, in the order of summary.csv, which has more columns."
    heading = tag("div", f"<h1>{title}</h1>{paragraph(lead, 'faint')}")
    chips = "".join(tag("p", escape(words), f"chip {light}") for words, light in _verdict(rows))
    runs = table(_COLUMNS, [_row(one, files.get(one["run"], {})) for one in rows], class_="lifts", caption="Runs")
    body = [
        tag("header", heading + tag("div", chips, "verdict")),
        tag("section", terms(_totals(rows)), "totals"),
        section("Runs", tag("div", runs, "wide"), id="runs"),
    ]
    return printable(f"{title}: summary", "".join(body), {"runs": list(rows), "files": dict(files)})


def _verdict(rows: Sequence[Row]) -> list[tuple[str, Light]]:
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


def _totals(rows: Sequence[Row]) -> list[tuple[str, str]]:
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


def _row(one: Row, files: Mapping[str, str]) -> str:
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


def _status(one: Row) -> str:
    """Return the status in words, with the site and its obstructions; the reason if there is no plan."""
    asked = [one["site"], *([one["obstructions"]] if one["obstructions"] else [])]
    asked += [] if one["seed"] is None else [f"seed {one['seed']}"]
    words = {"planned": "planned", "partly": "planned in part", "failed": "failed"}[one["status"]]
    proven = ", NOT PROVEN" if one["verified"] is False else ", proven" if one["verified"] else ""
    reason = f": {escape(one['error'])}" if one["error"] else ""
    return f"<b>{words}{proven}</b>{reason}<br>{tag('span', escape(', '.join(asked)), 'faint')}"


def _remarks(one: Row) -> str:
    serious = one["serious_remarks"]
    more = f" ({tag('span', f'{serious:,} serious', 'reserved')})" if serious else ""
    return _whole(one["remarks"], "remarks") + more


def _hours(value: float | None, key: str) -> str:
    return number(value, span(3600.0 * (value or 0.0)), key)


def _whole(value: int | None, key: str) -> str:
    return number(value, f"{value or 0:,}", key)


def _sum(rows: Sequence[Row], key: str) -> float:
    return sum(one[key] or 0 for one in rows)


def _failed(rows: Sequence[Row]) -> int:
    return sum(one["status"] == "failed" for one in rows)
