"""The remarks: what a person should look at in a plan, next to what is proven."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from bimvox.records.remark import Severity
from bimvox.rendering.plain import escape
from bimvox.rendering.report.html import number, paragraph, row, section, table, tag
from bimvox.rendering.report.words import named
from bimvox.rendering.words import counted

_HEADINGS = {
    Severity.SERIOUS: ("⚠\ufe0e Serious", "Decide about these before the plan is carried out."),
    Severity.MINOR: ("! Minor", "Unusual, or below what the field asks for."),
    Severity.NOTE: ("Notes", "What was assumed."),
}


def remarks(record: dict[str, Any]) -> str:
    """Return the remarks, the gravest first, each with its lift and part; within a severity by kind."""
    found, lead = record["remarks"], "A proof compares the plan with the model and the site file, not with practice."
    if not found:
        return section("Remarks: none", paragraph(f"{lead} No rule of plausibility found anything."), id="remarks")
    lifts = {lift["id"]: lift for lift in record["lifts"]}
    groups = [(severity, [one for one in found if one["severity"] == severity.value]) for severity in Severity]
    counts = ", ".join(_counted(severity, len(group)) for severity, group in groups if group)
    tables = (_group(severity, group, lifts) for severity, group in groups if group)
    return section(
        f"Remarks: {counts}",
        paragraph(f"{lead} Each remark is for a person to look at.", "faint"),
        *tables,
        id="remarks",
    )


def _counted(severity: Severity, count: int) -> str:
    return counted(count, "note") if severity is Severity.NOTE else f"{count:,} {severity.value}"


def _group(severity: Severity, group: Sequence[dict[str, Any]], lifts: dict[str, dict[str, Any]]) -> str:
    title, words = _HEADINGS[severity]
    kinds = list(dict.fromkeys(one["kind"] for one in group))

    def place(one: dict[str, Any]) -> tuple[int, int]:
        lift = lifts.get(one["component"])
        return kinds.index(one["kind"]), -1 if lift is None else lift["order"]

    rows = [_row(one, lifts.get(one["component"])) for one in sorted(group, key=place)]
    heading = tag("h3", f"{title}: {len(group):,}", severity.value)
    columns = ("Lift", "Part", "About", "Remark")
    return heading + paragraph(words, "faint") + table(columns, rows, class_="words remarks", id_=f"{severity}-remarks")


def _row(remark: dict[str, Any], lift: dict[str, Any] | None) -> str:
    if lift is None:
        part = escape(remark["name"] or remark["component"] or "the whole plan")
        first = number(None, "")
    else:
        part = f"<b>{escape(named(lift))}</b> {tag('code', escape(lift['global_id']))}"
        first = number(lift["order"], str(lift["number"]), "order")
    kind = escape(remark["kind"].replace("_", " "))
    words = re.sub(r"(?<=\d) m2\b", " m²", remark["text"])
    return row([first, part, kind, escape(words)], data_severity=remark["severity"], data_kind=remark["kind"])
