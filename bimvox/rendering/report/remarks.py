"""The remarks: what a person should look at in a plan, next to what is proven."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from bimvox.records.proof import Severity
from bimvox.rendering.plain import escape
from bimvox.rendering.report.html import number, paragraph, row, section, table, tag
from bimvox.rendering.report.labels import shortened
from bimvox.rendering.report.words import in_ranges, named
from bimvox.rendering.words import counted

_NAMED = 2
"""How many parts with the same remark are named."""
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

    equal: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for one in sorted(group, key=place):
        equal.setdefault((one["kind"], one["text"]), []).append(one)
    rows = [_row(those, [lifts.get(one["component"]) for one in those]) for those in equal.values()]
    heading = tag("h3", f"{title}: {len(group):,}", severity.value)
    columns = ("Lift", "Part", "About", "Remark")
    return heading + paragraph(words, "faint") + table(columns, rows, class_="words remarks", id_=f"{severity}-remarks")


def _row(equal: Sequence[dict[str, Any]], lifts: Sequence[dict[str, Any] | None]) -> str:
    """Return the row of remarks with the same words, with the parts that they are about."""
    remark, lift = equal[0], lifts[0]
    if len(equal) > 1:
        first, part = number(None, ""), _parts(equal, lifts)
    elif lift is None:
        first, part = number(None, ""), escape(_name(remark))
    else:
        part = f"<b>{escape(named(lift))}</b> {tag('code', escape(lift['global_id']))}"
        first = number(lift["order"], str(lift["number"]), "order")
    kind = escape(remark["kind"].replace("_", " "))
    words = re.sub(r"(?<=\d) m2\b", " m²", remark["text"])
    return row([first, part, kind, escape(words)], data_severity=remark["severity"], data_kind=remark["kind"])


def _parts(equal: Sequence[dict[str, Any]], lifts: Sequence[dict[str, Any] | None]) -> str:
    """Return how many parts have the same remark, the names of the first ones, and the lifts of the others."""
    names = [
        _name(remark) if lift is None else f"{named(lift)} (lift {lift['number']})"
        for remark, lift in zip(equal, lifts, strict=True)
    ]
    shown, rest = names[:_NAMED], lifts[_NAMED:]
    numbers = in_ranges(lift["number"] for lift in rest if lift is not None)
    more = f" and {len(rest)} more" + (f" ({numbers})" if numbers else "") if rest else ""
    count = number(len(equal), counted(len(equal), "part"), "parts")
    return f"<b>{count}</b>: {escape(', '.join(map(shortened, shown)) + more)}"


def _name(remark: dict[str, Any]) -> str:
    return str(remark["name"] or remark["component"] or "the whole plan")
