"""The section of the report with the hours of the crews."""

from __future__ import annotations

from typing import Any

from bimvox.rendering.plain import escape
from bimvox.rendering.report.html import number, paragraph, row, section, table
from bimvox.rendering.report.words import fixed

_HOURS = ("works_h", "man_hours", "idle_h", "idle_man_hours")


def crews(record: dict[str, Any]) -> str:
    """Return the hours of each crew whose size is known, and of all; empty if none is."""
    found = (record["totals"]["calendar"] or {}).get("crews")
    if not found:
        return ""
    rows = [
        row(
            [
                escape(crew["crew"]),
                number(crew["people"], f"{crew['people']:g}", "people"),
                *(number(crew[key], fixed(crew[key], 1), key) for key in _HOURS),
            ]
        )
        for crew in found
    ]
    if len(found) > 1:
        man, idle = (sum(crew[key] for crew in found) for key in ("man_hours", "idle_man_hours"))
        everyone = number(man, fixed(man, 1), "all_man_hours"), number(idle, fixed(idle, 1), "all_idle_man_hours")
        rows.append(row(["All crews", "", "", everyone[0], "", everyone[1]]))
    head = ("Crew", "People", "Hours\nat work", "Man-hours\nat work", "Hours\nidle", "Man-hours\nidle")
    return section(
        "Crews",
        paragraph("Idle: working time from a crew's first to its last work in which it has none.", "faint"),
        table(head, rows, id_="crews"),
    )
