"""The Gantt chart, which fits a page: one bar per lift, its phases in three shades that differ in greyscale too.

Of more lifts than a page has room for, a row is a storey and a class, with the lifts of each day. The page of a log has
a chart of its own (``page/web/gantt.mjs``), of buttons at any zoom; both show the times, phases and critical lifts of
the same records (``page/lifts.py``), and neither computes them.
"""

from __future__ import annotations

from collections.abc import Sequence
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
    if len(timed) > LIFTS_A_CHART:
        return _grouped_chart(timed)
    chart = _Chart(timed, _TOP + _ROW * len(timed) + 6.0)
    chart.add_axis(timed)
    for row, lift in enumerate(timed):
        y, mark = _TOP + row * _ROW, "▲ " if lift["critical"] else ""
        label = f"{mark}{lift['number']}  {named(lift)}"
        spans = lift["phases"] or [["traverse", lift["begins_s"], lift["ends_s"]]]
        bars = [
            _label(label if len(label) <= 36 else label[:35] + "…", y, critical=bool(mark)),
            *chart.phases(spans, y),
        ]
        words = f"Lift {lift['number']}, {named(lift)}: {_from_to(lift, lift)}"
        chart.parts.append(element("g", element("title", escape(words)), *bars, data_order=lift["order"]))
    return chart.svg(f"Gantt chart of lifts {timed[0]['number']} to {timed[-1]['number']}")


def crane_chart(lifts: Sequence[dict[str, Any]], cranes: Sequence[str]) -> str:
    """Return all lifts of several cranes, one row per named crane, as SVG; empty if no lift has a time."""
    timed = [lift for lift in lifts if lift["begins_s"] is not None]
    if not timed:
        return ""
    chart = _Chart(timed, _TOP + 1.5 * _ROW * len(cranes) + 6.0)
    chart.add_axis(timed)
    for number, name in enumerate(cranes):
        y = _TOP + 1.5 * number * _ROW
        chart.parts.append(_label(name[:36], y))
        for lift in timed:
            if lift["crane"] == number:
                chart.parts += chart.phases(lift["phases"], y)
    return chart.svg(f"Gantt chart of {len(cranes)} cranes")


def _grouped_chart(lifts: Sequence[dict[str, Any]]) -> str:
    rows, days = _rows_of(lifts), _days_of(lifts)
    top = _TOP + (_ROW if days else 0.0)
    chart = _Chart(lifts, top + _ROW * len(rows) + 6.0)
    if days:
        chart.add_days(days)
    else:
        chart.add_axis(lifts)
    for n, (label, own) in enumerate(rows):
        y = top + n * _ROW
        first, last = min(lift["begins_s"] for lift in own), max(lift["ends_s"] for lift in own)
        mark = "▲ " if any(lift["critical"] for lift in own) else ""
        bars = [_label(f"{mark}{label}: {len(own)}"[:40], y, critical=bool(mark))]
        bars.append(chart.bar("empty", first, last, y, 5.5))
        bars += [chart.bar("carrying", *span, y, 2.0) for span in _touching(own, 1.0 / chart.scale)]
        ends = max(own, key=lambda lift: float(lift["ends_s"]))
        title = element("title", escape(f"{label}: {len(own)} lifts, {_from_to(own[0], ends)}"))
        chart.parts.append(element("g", title, *bars, data_lifts=len(own)))
    return chart.svg(f"Gantt chart of {len(lifts)} lifts by storey and class")


def _from_to(first: dict[str, Any], last: dict[str, Any]) -> str:
    """Return when the first of some lifts begins and the last ends."""
    begins = first.get("begins_in_words") or clock(first["begins_s"])
    return f"{begins} to {last.get('ends_in_words') or clock(last['ends_s'])}"


def _label(words: str, y: float, *, critical: bool = False) -> str:
    """Return the name of a row."""
    return text(words, _LEFT - 8.0, y + 9.5, text_anchor="end", class_="label critical" if critical else "label")


class _Chart:
    """A chart of timed lifts, as high as its rows: the scale of its time, and what is drawn."""

    def __init__(self, lifts: Sequence[dict[str, Any]], height: float) -> None:
        self.low = float(min(lift["begins_s"] for lift in lifts))
        self.high = float(max(lift["ends_s"] for lift in lifts))
        self.scale: float = (_WIDTH - _LEFT - _RIGHT) / max(self.high - self.low, 1e-9)
        self.height, self.parts = height, list[str]()

    def x(self, at_s: float) -> float:
        return _LEFT + (at_s - self.low) * self.scale

    def bar(self, kind: str, start_s: float, end_s: float, y: float, inset: float) -> str:
        width, height = max((end_s - start_s) * self.scale, 0.4), _ROW - 1.0 - 2.0 * inset
        return element("rect", x=self.x(start_s), y=y + inset, width=width, height=height, class_=kind)

    def phases(self, spans: Sequence[Sequence[Any]], y: float) -> list[str]:
        """Return the bars of a lift's phases, in three heights."""
        insets = {"carrying": 1.0, "handling": 2.5, "empty": 4.5}
        return [self.bar(kind, start, end, y, insets[kind]) for kind, start, end in _joined(spans)]

    def add_axis(self, lifts: Sequence[dict[str, Any]]) -> None:
        """Draw the times at which lifts start, whose nights and breaks have no width; round ones of an extract."""
        if not lifts[0].get("begins_in_words"):
            for at_s in ticks(self.low, self.high, 9, _STEPS_S):
                self._rule(self.x(at_s), clock(at_s))
            return
        last_x, day = -_WIDTH, ""
        for lift in sorted(lifts, key=lambda one: float(one["begins_s"])):
            (own, at), x = lift["begins_in_words"].rsplit(" ", 1), self.x(lift["begins_s"])
            if x - last_x >= _DATE_WIDTH:
                self._rule(x, at if own == day else f"{_short(own)} {at}")
                last_x, day = x, own

    def add_days(self, days: Sequence[tuple[str, float, int]]) -> None:
        """Draw a line where each day begins, with its date and its number of lifts where there is room."""
        self.parts.append(text("lifts a day", _LEFT - 8.0, _TOP + 4.0, text_anchor="end", class_="tick"))
        last_x = -_WIDTH
        for day, begins_s, count in days:
            x = self.x(begins_s)
            self._rule(x)
            if x - last_x >= _DAY_WIDTH:
                last_x = x
                self.parts.append(text(_short(day), x + 2.0, _TOP - 9.0, class_="tick"))
                self.parts.append(text(f"{count}", x + 2.0, _TOP + 4.0, class_="tick"))

    def _rule(self, x: float, words: str = "") -> None:
        self.parts.append(element("line", x1=x, x2=x, y1=_TOP - 5.0, y2=self.height - 4.0, class_="grid"))
        if words:
            self.parts.append(text(words, x, _TOP - 9.0, text_anchor="middle", class_="tick"))

    def svg(self, title: str) -> str:
        return picture(_WIDTH, self.height, title, self.parts, "gantt")


def _touching(lifts: Sequence[dict[str, Any]], gap_s: float) -> list[tuple[float, float]]:
    """Return the times of lifts as spans, those joined that are less than ``gap_s`` apart."""
    joined: list[tuple[float, float]] = []
    for lift in sorted(lifts, key=lambda one: float(one["begins_s"])):
        if joined and lift["begins_s"] - joined[-1][1] <= gap_s:
            joined[-1] = (joined[-1][0], max(joined[-1][1], lift["ends_s"]))
        else:
            joined.append((lift["begins_s"], lift["ends_s"]))
    return joined


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
    """Return each day, begin of its first lift on the plan's clock, and its number of lifts; none of an extract."""
    known = sorted((lift for lift in lifts if lift.get("begins_in_words")), key=lambda lift: float(lift["begins_s"]))
    groups = groupby(known, lambda lift: str(lift["begins_in_words"]).rsplit(" ", 1)[0])
    return [(day, own[0]["begins_s"], len(own)) for day, own in ((day, list(group)) for day, group in groups)]


def _short(day: str) -> str:
    """Return a day as an axis has room for it: ``Fri 13 Mar`` of ``Fri 13 March 2026``; ``day 4`` stays."""
    parts = day.split(" ")
    return " ".join((*parts[:2], parts[2][:3])) if len(parts) == 4 else day
