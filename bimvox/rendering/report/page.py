"""The lift plan record as one printable HTML file; deterministic."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from importlib.resources import files
from typing import Any

from bimvox.crane.tower_crane import TowerCrane
from bimvox.records.proof import Severity
from bimvox.rendering.page.page import source_hash
from bimvox.rendering.report import sections
from bimvox.rendering.report.drawings import drawings, yard_drawings
from bimvox.rendering.report.html import number, paragraph, row, section, table, tag
from bimvox.rendering.report.machine import machine
from bimvox.rendering.report.props import props, props_list
from bimvox.rendering.report.rigging import rig_drawings, rigging
from bimvox.rendering.report.risks import risks
from bimvox.rendering.report.sheet import shortened
from bimvox.rendering.report.statement import statement, title_block
from bimvox.rendering.report.support import support, survey
from bimvox.rendering.report.words import fixed, named, ranges
from bimvox.rendering.words import counted, escape


@dataclass(frozen=True, slots=True)
class Figure:
    """A picture in the report.

    Attributes:
        data: The file.
        media_type: ``image/png`` or ``image/svg+xml``.
        alt: Its description, also used as its caption.
        orders: Orders of the lifts that it shows.
    """

    data: bytes
    media_type: str
    alt: str
    orders: tuple[int, ...] = ()

    def html(self) -> str:
        """Return it as a self-contained element."""
        source = f"data:{self.media_type};base64,{base64.b64encode(self.data).decode()}"
        return (
            f'<figure><img src="{source}" alt="{escape(self.alt)}"><figcaption>{escape(self.alt)}</figcaption></figure>'
        )


@dataclass(frozen=True, slots=True)
class Figures:
    """The pictures of a report.

    Attributes:
        overview: The finished building, or None.
        blocked: Blockers of infeasible parts.
        plots: Figures about all lifts.
    """

    overview: Figure | None = None
    blocked: tuple[Figure, ...] = ()
    plots: tuple[Figure, ...] = ()


def report_page(record: dict[str, Any], cranes: Sequence[TowerCrane], figures: Figures | None = None) -> bytes:
    """Return the report, UTF-8.

    It makes no network requests and runs no scripts; its content security policy forbids both. Content of the model or
    the log is only text. It contains the record as JSON (``<script type="application/json">``, which is data).
    """
    figures = figures or Figures()
    plots = "".join(plot.html() for plot in figures.plots)
    own = [
        sections.heading(record),
        title_block(record),
        tag("div", figures.overview.html(), "overview") if figures.overview else "",
        _remarks(record),
        sections.infeasible(record, [(figure.orders, figure.html()) for figure in figures.blocked]),
        sections.not_covered(record),
        sections.not_lifted(record),
        sections.critical(record),
        sections.gantt(record),
        machine(record, cranes),
        drawings(record),
        rigging(record),
        statement(record),
        props(record),
        risks(record),
        support(record),
        sections.proof(record),
    ]
    annexes = [
        sections.lifts(record),
        rig_drawings(record),
        props_list(record),
        sections.deliveries(record),
        yard_drawings(record),
        survey(record),
        crews(record),
        programme(record),
        _assumptions(record),
        section("Figures", tag("div", plots, "plots")) if plots else "",
        sections.checks(record),
        sections.inputs(record),
        sections.notes(record),
    ]
    body = _in_two(own, [annex for annex in annexes if annex])
    return printable(f"{record['site']['name']}: lift plan record", body, record, footer_of(record))


REPORT, ANNEXES = "report", "annexes"
"""The two parts of a report, which are printed as a file each: what is read and signed, and its lists."""


def _in_two(own: Sequence[str], annexes: Sequence[str]) -> str:
    """Return the body of a report: what is read and signed, with a list of its annexes, then these with letters."""
    named = [annex.replace("<h2>", f"<h2>Annex {letters(n)}: ", 1) for n, annex in enumerate(annexes)]
    titles = [found[1] for annex in named if (found := re.search(r"<h2>(.*?)</h2>", annex))]
    about = paragraph("Lists for those who need them; as PDF, a file of their own.", "faint")
    listed = section("Annexes", about, tag("p", " · ".join(titles)), id="list-of-annexes")
    return tag("div", "".join([*own, listed]), id=REPORT) + tag("div", "".join(named), id=ANNEXES)


def only(page: bytes, part: str) -> bytes:
    """Return a report of which only one part is printed: ``report`` or ``annexes``."""
    return page.replace(b"<body>", f'<body class="only-{part}">'.encode(), 1)


def letters(number: int) -> str:
    """Return A, B, ..., Z, AA for 0, 1, ..., 25, 26."""
    return ("" if number < 26 else letters(number // 26 - 1)) + chr(ord("A") + number % 26)


def footer_of(record: dict[str, Any]) -> str:
    """Return what stands at the foot of every printed page: project, number, revision, plan."""
    project = record["project"]
    name = project["name"] or record["site"]["name"]
    revision = f"revision {project['issue']}" if project["issue"] else ""
    plan = f"plan {record['log']['sha256'][:16]}"
    return " · ".join(filter(None, (name, project["number"], revision, plan)))


def printable(title: str, body: str, record: dict[str, Any], footer: str = "", paper: str = "") -> bytes:
    """Return a page in the look of the report around a body that is already escaped; it contains the record as JSON.

    ``footer``: plain text at the foot of every printed page; ``paper``: size and margins of the paper, as CSS; A4
    landscape if empty.
    """
    style = (files(__package__) / "report.css").read_text(encoding="utf-8")
    style += f"@page {{ {paper} }}\n" if paper else ""
    if footer:
        # Of a string in a style sheet, only letters, digits and spaces stay as they are: a file chooses the words.
        words = "".join(
            one if one.isascii() and (one.isalnum() or one == " ") else f"\\{ord(one):06x} " for one in footer
        )
        style += f'@page {{ @bottom-left {{ content: "{words}"; font: 8pt sans-serif; color: #5d5d66; }} }}\n'
    policy = f"default-src 'none'; style-src '{source_hash(style)}'; img-src data:; base-uri 'none'; form-action 'none'"
    # The data must not contain "<", because "</script" would end them.
    data = json.dumps(record, ensure_ascii=False, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta name="referrer" content="no-referrer">\n'
        f'<title>{escape(title)}</title>\n<link rel="icon" href="data:,">\n<style>{style}</style>\n</head>\n'
        f'<body>\n{body}\n<script type="application/json" id="record">{data}</script>\n</body>\n</html>\n'
    ).encode()


# The section of the report with the hours of the crews.

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


# The section of the report that compares the plan with the programme of its site.


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


# The remarks: what a person should look at in a plan, next to what is proven.

_NAMED = 2
"""How many parts with the same remark are named."""
_HEADINGS = {
    Severity.SERIOUS: ("⚠\ufe0e Serious", "Decide about these before the plan is carried out."),
    Severity.MINOR: ("! Minor", "Unusual, or below what the field asks for."),
    Severity.NOTE: ("Notes", "What was assumed."),
}


def _remarks(record: dict[str, Any]) -> str:
    """Return the remarks, the gravest first, each with its lift and part; within a severity by kind."""
    found, lead = record["remarks"], "A proof compares the plan with the model and the site file, not with practice."
    if not found:
        return section("Remarks: none", paragraph(f"{lead} No rule of plausibility found anything."), id="remarks")
    lifts = {lift["id"]: lift for lift in record["lifts"]}
    groups = [(severity, [one for one in found if one["severity"] == severity.value]) for severity in Severity]
    counts = ", ".join(_counted(severity, len(group)) for severity, group in groups if group)
    tables = (_group(severity, group, lifts) for severity, group in groups if group and severity is not Severity.NOTE)
    return section(
        f"Remarks: {counts}",
        paragraph(f"{lead} Each remark is for a person to look at.", "faint"),
        *tables,
        id="remarks",
    )


def _assumptions(record: dict[str, Any]) -> str:
    """Return the remarks that are notes: what was assumed; empty without any."""
    group = [one for one in record["remarks"] if one["severity"] == Severity.NOTE.value]
    lifts = {lift["id"]: lift for lift in record["lifts"]}
    return section("What was assumed", _group(Severity.NOTE, group, lifts), id="assumptions") if group else ""


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
    numbers = ", ".join(ranges(lift["number"] for lift in rest if lift is not None))
    more = f" and {len(rest)} more" + (f" ({numbers})" if numbers else "") if rest else ""
    count = number(len(equal), counted(len(equal), "part"), "parts")
    return f"<b>{count}</b>: {escape(', '.join(map(shortened, shown)) + more)}"


def _name(remark: dict[str, Any]) -> str:
    return str(remark["name"] or remark["component"] or "the whole plan")
