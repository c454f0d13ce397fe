"""The section of the report that compares the plan with the programme of its site."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from bimvox.rendering.plain import escape
from bimvox.rendering.report.html import number, paragraph, row, section, table
from bimvox.rendering.words import counted


def programme(record: dict[str, Any]) -> str:
    """Return the tasks of the programme with its dates and those of the plan; empty without a programme."""
    tasks = (record["totals"]["calendar"] or {}).get("programme")
    if not tasks:
        return ""
    late = sum((task["late_working_days"] or 0) > 0 for task in tasks)
    rows = [
        row(
            [
                escape(task["task"]),
                number(len(task["lifts"]), str(len(task["lifts"])), "parts"),
                *(escape(_at(task[key])) for key in ("wished_start", "wished_end", "starts", "ends")),
                number(days, _words(days), "late_working_days") if days is not None else "–",
            ],
            "bad" if (days or 0) > 0 else "",
        )
        for task in tasks
        for days in (task["late_working_days"],)
    ]
    head = ("Task", "Parts", "Programme\nstarts", "Programme\nends", "Plan\nstarts", "Plan\nends", "Working days")
    return section(
        f"Programme: {counted(late, 'task')} of {len(tasks):,} later than it wants",
        paragraph("A task ends with the last of its parts; working days are those between both ends.", "faint"),
        table(head, rows, class_="words", id_="programme"),
        id="against-programme",
    )


def _at(text: str | None) -> str:
    return f"{datetime.fromisoformat(text):%a %d %b %Y %H:%M}" if text else "–"


def _words(days: int) -> str:
    return "as wanted" if not days else f"{abs(days):,} {'late' if days > 0 else 'early'}"
