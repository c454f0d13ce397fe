"""The page of many sites' set-ups: one row a site, what was given and what was found; deterministic."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any
from urllib.parse import quote

from bimvox.rendering.report.html import number, paragraph, row, section, table, tag, terms
from bimvox.rendering.report.page import printable
from bimvox.rendering.report.words import fixed, percent
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
    """Return the page, UTF-8; it makes no network requests and runs no scripts.

    Args:
        rows: The sites, in the order of the table.
    """
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
    found = []
    for words, what, key, digits in (("Crane hours", "fastest", "hours", 1), ("Cost", "cheapest", "cost", 0)):
        known = [one for one in rows if one[f"given_{key}"] and one[f"{what}_{key}"]]
        given, best = (sum(one[f"{which}_{key}"] for one in known) for which in ("given", what))
        if known and len({one["currency"] for one in known}) == 1:
            unit = f" {escape(known[0]['currency'])}" if key == "cost" else " h"
            said = f"{fixed(given, digits)} given, {number(best, fixed(best, digits), key)}{unit} {what}"
            found.append((words, f"{said}, {_change(given, best)}; {counted(len(known), 'site')}"))
    return found


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
