"""The Gantt chart, which fits a page: one bar per lift, its phases in three shades that differ in greyscale too.

Of more lifts than a page has room for, a row is a storey and a class, with the lifts of each day. The page of a log has
a chart of its own (``page/web/gantt.mjs``), of buttons at any zoom; both show the times, phases and critical lifts of
the same records (``page/lifts.py``), and neither computes them.
"""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from itertools import groupby
from typing import Any

from bimvox.rendering.report.html import element, picture, text, ticks
from bimvox.rendering.report.record import CARRYING
from bimvox.rendering.report.words import named
from bimvox.rendering.words import escape
from bimvox.units import clock

LIFTS_A_CHART = 45
"""Number of lifts with a row each that fit on a printed page."""

_WIDTH, _LEFT, _RIGHT, _TOP, _ROW = 1040.0, 232.0, 12.0, 26.0, 13.0
_DATE_WIDTH, _DAY_WIDTH = 96.0, 58.0
_STEPS_S = (10.0, 30.0, 60.0, 120.0, 300.0, 600.0, 900.0, 1800.0, 3600.0, 7200.0, 14400.0, 28800.0, 86400.0, 604800.0)


def gantt_chart(lifts: Sequence[dict[str, Any]]) -> str:
    """Return the chart of the timed lifts, as SVG: a row for each, or for each storey and class; empty without any."""
    timed = [lift for lift in lifts if lift["begins_s"] is not None]
    if not timed:
        return ""
    return _chart(timed) if len(timed) <= LIFTS_A_CHART else _grouped_chart(timed)


def _grouped_chart(lifts: Sequence[dict[str, Any]]) -> str:
    rows, days = _rows_of(lifts), _days_of(lifts)
    top = _TOP + (_ROW if days else 0.0)
    height = top + _ROW * len(rows) + 6.0
    low, high = min(lift["begins_s"] for lift in lifts), max(lift["ends_s"] for lift in lifts)
    scale = (_WIDTH - _LEFT - _RIGHT) / max(high - low, 1e-9)
    parts = _days(days, low, scale, height) if days else _axis(lifts, height)[2]
    for n, (label, own) in enumerate(rows):
        y = top + n * _ROW
        first, last = min(lift["begins_s"] for lift in own), max(lift["ends_s"] for lift in own)
        mark = "▲ " if any(lift["critical"] for lift in own) else ""
        words = f"{mark}{label}: {len(own)}"
        bars = [text(words[:40], _LEFT - 8.0, y + 9.5, text_anchor="end", class_="label critical" if mark else "label")]
        bars.append(_bar_between(first, last, "empty", low, scale, y))
        bars += [_bar_between(*span, "carrying", low, scale, y) for span in _touching(own, 1.0 / scale)]
        title = element("title", escape(f"{label}: {len(own)} lifts, {clock(first)} to {clock(last)}"))
        parts.append(element("g", title, *bars, data_lifts=len(own)))
    return picture(_WIDTH, height, f"Gantt chart of {len(lifts)} lifts by storey and class", parts, "gantt")


def _bar_between(start: float, end: float, class_: str, low: float, scale: float, y: float) -> str:
    inset = {"carrying": 2.0, "empty": 5.5}[class_]
    width = max((end - start) * scale, 0.4)
    return element(
        "rect",
        x=_LEFT + (start - low) * scale,
        y=y + inset,
        width=width,
        height=_ROW - 1.0 - 2.0 * inset,
        class_=class_,
    )


def _touching(lifts: Sequence[dict[str, Any]], gap_s: float) -> list[tuple[float, float]]:
    """Return the times of lifts as spans, those joined that are less than ``gap_s`` apart."""
    joined: list[tuple[float, float]] = []
    for lift in sorted(lifts, key=lambda one: float(one["begins_s"])):
        if joined and lift["begins_s"] - joined[-1][1] <= gap_s:
            joined[-1] = (joined[-1][0], max(joined[-1][1], lift["ends_s"]))
        else:
            joined.append((lift["begins_s"], lift["ends_s"]))
    return joined


def _days(days: Sequence[tuple[str, float, int]], low: float, scale: float, height: float) -> list[str]:
    """Return a line where each day begins, with its date and its number of lifts where there is room."""
    parts = [text("lifts a day", _LEFT - 8.0, _TOP + 4.0, text_anchor="end", class_="tick")]
    last_x = -_WIDTH
    for day, begins_s, count in days:
        x = _LEFT + (begins_s - low) * scale
        parts.append(element("line", x1=x, x2=x, y1=_TOP - 5.0, y2=height - 4.0, class_="grid"))
        if x - last_x >= _DAY_WIDTH:
            at = datetime.fromisoformat(day)
            parts.append(text(f"{at:%a} {at.day} {at:%b}", x + 2.0, _TOP - 9.0, class_="tick"))
            parts.append(text(f"{count}", x + 2.0, _TOP + 4.0, class_="tick"))
            last_x = x
    return parts


def crane_chart(lifts: Sequence[dict[str, Any]], cranes: Sequence[str]) -> str:
    """Return all lifts of several cranes, one row per named crane, as SVG; empty if no lift has a time."""
    timed = [lift for lift in lifts if lift["begins_s"] is not None]
    if not timed:
        return ""
    height = _TOP + 1.5 * _ROW * len(cranes) + 6.0
    low, scale, parts = _axis(timed, height)
    for number, name in enumerate(cranes):
        y = _TOP + 1.5 * number * _ROW
        parts.append(text(name[:36], _LEFT - 8.0, y + 9.5, text_anchor="end", class_="label"))
        for lift in timed:
            if lift["crane"] == number:
                parts += _rectangles(lift["phases"], low, scale, y)
    return picture(_WIDTH, height, f"Gantt chart of {len(cranes)} cranes", parts, "gantt")


def _axis(lifts: Sequence[dict[str, Any]], height: float) -> tuple[float, float, list[str]]:
    """Return the start of the lifts' time axis in seconds, units per second, and the axis."""
    low, high = min(lift["begins_s"] for lift in lifts), max(lift["ends_s"] for lift in lifts)
    scale = (_WIDTH - _LEFT - _RIGHT) / max(high - low, 1e-9)
    parts: list[str] = []
    if lifts[0].get("begins_at"):
        return low, scale, _dated(lifts, low, scale, height)
    for at in ticks(low, high, 9, _STEPS_S):
        x = _LEFT + (at - low) * scale
        parts.append(element("line", x1=x, x2=x, y1=_TOP - 5.0, y2=height - 4.0, class_="grid"))
        parts.append(text(clock(at), x, _TOP - 9.0, text_anchor="middle", class_="tick"))
    return low, scale, parts


def _dated(lifts: Sequence[dict[str, Any]], low: float, scale: float, height: float) -> list[str]:
    """Return an axis with the local times at which lifts start; nights and breaks have no width."""
    parts: list[str] = []
    last_x, day = -_WIDTH, ""
    for lift in sorted(lifts, key=lambda one: float(one["begins_s"])):
        at, x = datetime.fromisoformat(lift["begins_at"]), _LEFT + (lift["begins_s"] - low) * scale
        if x - last_x < _DATE_WIDTH:
            continue
        words = f"{at:%H:%M}" if day == f"{at.date()}" else f"{at:%a} {at.day} {at:%b %H:%M}"
        last_x, day = x, f"{at.date()}"
        parts.append(element("line", x1=x, x2=x, y1=_TOP - 5.0, y2=height - 4.0, class_="grid"))
        parts.append(text(words, x, _TOP - 9.0, text_anchor="middle", class_="tick"))
    return parts


def _chart(lifts: Sequence[dict[str, Any]]) -> str:
    height = _TOP + _ROW * len(lifts) + 6.0
    low, scale, parts = _axis(lifts, height)
    parts += [_bar(lift, low, scale, _TOP + row * _ROW) for row, lift in enumerate(lifts)]
    first, last = lifts[0]["number"], lifts[-1]["number"]
    return picture(_WIDTH, height, f"Gantt chart of lifts {first} to {last}", parts, "gantt")


def _bar(lift: dict[str, Any], low: float, scale: float, y: float) -> str:
    mark = "▲ " if lift["critical"] else ""
    label = f"{mark}{lift['number']}  {named(lift)}"
    label = label if len(label) <= 36 else label[:35] + "…"
    spans = lift["phases"] or [["traverse", lift["begins_s"], lift["ends_s"]]]
    parts = [text(label, _LEFT - 8.0, y + 9.5, text_anchor="end", class_="label critical" if mark else "label")]
    parts += _rectangles(spans, low, scale, y)
    words = f"Lift {lift['number']}, {named(lift)}: {clock(lift['begins_s'])} to {clock(lift['ends_s'])}"
    title = element("title", escape(words))
    return element("g", title, *parts, data_order=lift["order"])


def _rectangles(spans: Sequence[Sequence[Any]], low: float, scale: float, y: float) -> list[str]:
    parts = []
    for name, start, end in _joined(spans):
        inset = {"carrying": 1.0, "handling": 2.5, "empty": 4.5}[name]
        x, width, height = _LEFT + (start - low) * scale, max((end - start) * scale, 0.4), _ROW - 1.0 - 2.0 * inset
        parts.append(element("rect", x=x, y=y + inset, width=width, height=height, class_=name))
    return parts


def _joined(spans: Sequence[Sequence[Any]]) -> list[tuple[str, float, float]]:
    """Return the phases with consecutive ones of one kind joined, without waits."""
    joined: list[tuple[str, float, float]] = []
    for name, start, end in spans:
        if name == "wait":
            continue
        kind = "carrying" if name in CARRYING else "empty" if name in ("approach", "leave") else "handling"
        if joined and joined[-1][0] == kind and joined[-1][2] == start:
            joined[-1] = (kind, joined[-1][1], end)
        else:
            joined.append((kind, start, end))
    return joined


# The rows of a Gantt chart with more lifts than a page has room for: a row for each storey and class, never more.

ROWS = 42
"""Number of rows that fit on a printed page."""


def _rows_of(lifts: Sequence[dict[str, Any]]) -> list[tuple[str, list[dict[str, Any]]]]:
    """Return label and timed lifts of each row, by storey and class, if there are too many by storey, then in spans.

    Rows are in the order of their first lifts.
    """

    def storey(lift: dict[str, Any]) -> str:
        return str(lift["storey"] or "no storey")

    def storey_and_class(lift: dict[str, Any]) -> str:
        return f"{storey(lift)}, {str(lift['ifc_class']).removeprefix('Ifc').lower() or 'parts'}"

    for key in (storey_and_class, storey):
        found: dict[str, list[dict[str, Any]]] = {}
        for lift in lifts:
            found.setdefault(key(lift), []).append(lift)
        rows = list(found.items())
        if len(rows) <= ROWS:
            return rows
    each = -(-len(rows) // ROWS)
    spans = [rows[first : first + each] for first in range(0, len(rows), each)]
    return [
        (span[0][0] if len(span) == 1 else f"{span[0][0]} to {span[-1][0]}", [lift for _, own in span for lift in own])
        for span in spans
    ]


def _days_of(lifts: Sequence[dict[str, Any]]) -> list[tuple[str, float, int]]:
    """Return local date, begin of the first lift on the plan's clock and number of lifts of each day; none undated."""
    dated = sorted((lift for lift in lifts if lift.get("begins_at")), key=lambda lift: float(lift["begins_s"]))
    return [
        (day, own[0]["begins_s"], len(own))
        for day, own in ((day, list(group)) for day, group in groupby(dated, lambda lift: str(lift["begins_at"])[:10]))
    ]
