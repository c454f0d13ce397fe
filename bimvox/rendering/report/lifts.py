"""The table of lifts."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any

from bimvox.records.proof import Severity
from bimvox.rendering.report.html import number, row, table, tag, value
from bimvox.rendering.report.risks import letter_of
from bimvox.rendering.report.words import fixed, named, span, tonnes
from bimvox.rendering.words import PHASES, escape
from bimvox.site.means import HOW
from bimvox.units import clock

_WORDS = {
    "Lift": "its number in the order of all parts, those that the crane does not lift too",
    "Category": "B basic, I intermediate, C complex, as proposed",
    "Load, radius, capacity, use": "those of the governing sample, the one of the whole lift at which load and rigging "
    "take the largest share of the capacity",
    "Wind": "highest gust at jib height in which the part may be lifted, and how far the load swings out in it",
}
_HEADINGS = {
    "kept": "tag lines hold the part in its final heading from the yard on",
    "with jib": "the part turns with the jib; the crew turns it back by the stated angle",
}


def lift_table(lifts: Iterable[dict[str, Any]], remarks: Iterable[dict[str, Any]], *, proof_made: bool) -> str:
    """Return the table of lifts.

    ``proof_made``: whether the log was proven for this report.
    """
    caption = "Every lift, critical ones first, then in order"
    about: dict[str | None, list[dict[str, Any]]] = {}
    for remark in remarks:
        about.setdefault(remark["component"], []).append(remark)
    rows = []
    for lift in lifts:
        classes = ["critical"] * lift["critical"] + ["bad"] * (lift["status"] == "infeasible")
        cells = [cell(lift) for cell in _COLUMNS.values()]
        cells.append(_status(lift, about.get(lift["id"], []), proof_made))
        rows.append(row(cells, " ".join(classes), data_order=str(lift["order"])))
    return table((*_COLUMNS, "Status\nremarks"), rows, class_="lifts", caption=caption, id_="lifts")


def short_lift_table(lifts: Iterable[dict[str, Any]]) -> str:
    """Return a table of a few lifts, a line each: what is lifted, when, and what the crane carries there."""
    head = ("Lift", "Part", "Part t", "On hook t", "Radius m", "Gross capacity t", "Use %", "Wind up to m/s", "Begins")
    rows = [row(_in_a_line(lift), "critical", data_order=str(lift["order"])) for lift in lifts]
    return table(head, rows, class_="lifts", caption="Critical lifts", id_="critical")


def _in_a_line(lift: dict[str, Any]) -> list[str]:
    governs = lift["governs"]
    return [
        number(lift["order"], str(lift["number"]), "order"),
        f"<b>{escape(named(lift))}</b>",
        value(lift, "mass_kg", tonnes),
        value(governs, "load_kg", tonnes),
        value(governs, "radius_m", 2),
        value(governs, "capacity_kg", tonnes),
        _use(lift, governs),
        value(lift["lifting"], "permitted_wind_m_s", 1),
        _begins(lift),
    ]


def words_of_lifts(lifts: Iterable[dict[str, Any]]) -> str:
    """Return what the words in the table of lifts mean, those that occur in it."""
    said = {lift["heading"].partition(",")[0] for lift in lifts if lift["heading"]}
    words = _WORDS | {f"Heading {name}": meaning for name, meaning in _HEADINGS.items() if name in said}
    return ". ".join(f"{name}: {meaning}" for name, meaning in words.items()) + "."


def critical_first(lifts: Sequence[dict[str, Any]], critical: Sequence[int]) -> list[dict[str, Any]]:
    """Return all lifts, the critical orders first, then the others, each in its order."""
    by_order = {lift["order"]: lift for lift in lifts}
    chosen = set(critical)
    return [by_order[order] for order in critical] + [lift for lift in lifts if lift["order"] not in chosen]


def _part(lift: dict[str, Any]) -> str:
    crane = f", crane {lift['crane'] + 1}" if "crane" in lift else ""  # on a site with several
    return f"<b>{escape(named(lift))}</b>{crane}<br>{tag('code', escape(lift['global_id']))}"


def _hook(at: dict[str, Any] | None, which: str) -> str:
    if at is None:
        return number(None, "")
    axes = zip("xyz", at["hook_m"], strict=True)
    point = ", ".join(number(value, fixed(value, 2), f"{which}_{axis}_m") for axis, value in axes)
    radius = number(at["radius_m"], f"r {fixed(at['radius_m'], 2)}", f"{which}_radius_m")
    slew = number(at["slew_rad"], f"{fixed(math.degrees(at['slew_rad']) % 360.0, 1)}°", f"{which}_slew_rad")
    return f"{point}<br>{radius}, {slew}"


def _load(lift: dict[str, Any]) -> str:
    mass, governs = value(lift, "mass_kg", tonnes), lift["governs"]
    return f"{mass}<br>{value(governs, 'load_kg', tonnes)}" if governs else mass


def _governed(cell: Callable[[dict[str, Any], dict[str, Any]], str]) -> Callable[[dict[str, Any]], str]:
    """Return a cell that is a function of a lift and its governing sample, empty without one."""
    return lambda lift: cell(lift, lift["governs"]) if lift["governs"] else number(None, "")


def _wind(lift: dict[str, Any], _: dict[str, Any]) -> str:
    """Return the wind in which a part may be lifted, how far it swings in it, and what it hangs on."""
    speed, swing = lift["lifting"]["permitted_wind_m_s"], lift["lifting"]["gust_swing_m"]
    hangs = ", ".join(filter(None, (f"rig {lift['rig']}" if lift["rig"] else "", lift["heading"])))
    swings = "" if swing is None else "swings " + number(swing, f"{swing:.1f} m", "gust_swing_m")
    wind = number(speed, f"{speed:.1f} m/s", "permitted_wind_m_s")
    return "<br>".join(filter(None, (wind, swings, escape(hangs))))


def _capacity(_: dict[str, Any], governs: dict[str, Any]) -> str:
    radius, carries = value(governs, "radius_m", 2), value(governs, "capacity_kg", tonnes)
    return "<br>".join(filter(None, (radius, carries, escape(governs["sector"]))))


def _use(lift: dict[str, Any], governs: dict[str, Any]) -> str:
    used, mark = governs["utilisation"], "▲ " if lift["critical"] else ""
    return number(used, f"{mark}{fixed(used * 100, 1)}", "utilisation") if used is not None else f"{mark}beyond"


def _moment(lift: dict[str, Any], governs: dict[str, Any]) -> str:
    phase = escape(PHASES.get(governs["phase"], governs["phase"])) if governs.get("phase") else ""
    words = lift.get("governs_in_words") or clock(governs["time_s"])
    return f"{number(governs['time_s'], words, 'governing_time_s')}<br>{phase}"


def _times(lift: dict[str, Any]) -> str:
    if lift["begins_s"] is None:
        return number(None, "")
    length_s = lift["ends_s"] - lift["begins_s"]
    return f"{_begins(lift)}<br>{number(length_s, span(length_s), 'length_s')}"


def _begins(lift: dict[str, Any]) -> str:
    if lift["begins_s"] is None:
        return number(None, "")
    return number(lift["begins_s"], lift.get("begins_in_words") or clock(lift["begins_s"]), "begins_s")


_COLUMNS: dict[str, Callable[[dict[str, Any]], str]] = {
    "Lift\ncategory": lambda lift: (
        f"{number(lift['order'], str(lift['number']), 'order')}<br>{letter_of(lift['category'])}"
    ),
    "Part\nGlobalId": _part,
    "Pick point, hook\nx, y, z m; radius, slew": lambda lift: _hook(lift["pick"], "pick"),
    "Set point, hook\nx, y, z m; radius, slew": lambda lift: _hook(lift["set"], "set"),
    "Load\u00a0t\n+\u00a0rigging": _load,
    "Wind\u00a0up\u00a0to\nrig,\u00a0heading": _governed(_wind),
    "Radius\u00a0m\ngross capacity\u00a0t": _governed(_capacity),
    "Use\n%": _governed(_use),
    "Governing\nphase": _governed(_moment),
    "Begins\nlasts": _times,
}
"""Headings of the columns before the status, and their cells."""


def _status(lift: dict[str, Any], remarks: Sequence[dict[str, Any]], proof_made: bool) -> str:
    """Return status and proof, and the number of remarks about the part; notes are left out."""
    serious = sum(remark["severity"] == Severity.SERIOUS for remark in remarks)
    minor = sum(remark["severity"] == Severity.MINOR for remark in remarks)
    first, second = f"<b>✕ {escape(lift['status'])}</b>", list[str]()
    if lift["status"] in HOW:
        first = HOW[lift["status"]]
    elif lift["status"] == "planned":
        proof, *second = _proof(lift, proof_made, clean=not serious + minor)
        first = f"{escape(lift['status'])}, {proof}"
    if serious:
        second.append(f"⚠\ufe0e {serious} serious" + (f", {minor} minor" if minor else ""))
    elif minor:
        second.append(f"! {minor} minor")
    return "<br>".join(filter(None, (first, ", ".join(second))))


def _proof(lift: dict[str, Any], proof_made: bool, *, clean: bool) -> tuple[str, ...]:
    if lift["proven"] is None:
        return ("not in this log" if proof_made else "NOT PROVEN",)
    if not lift["proven"]:
        return ("✕ PROOF FAILED",)
    if not lift["current"]:
        return ("proven against", "earlier obstructions")
    return ("✓ proven" if clean else "proven",)
