"""The rows of a Gantt chart with more lifts than a page has room for: a row for each storey and class, never more."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import groupby
from typing import Any

ROWS = 42
"""Number of rows that fit on a printed page."""


def rows_of(lifts: Sequence[dict[str, Any]]) -> list[tuple[str, list[dict[str, Any]]]]:
    """Return label and timed lifts of each row, by storey and class, if there are too many by storey, then in spans.

    Rows are in the order of their first lifts.
    """
    for key in (_storey_and_class, _storey):
        rows = list(_grouped(lifts, key))
        if len(rows) <= ROWS:
            return rows
    each = -(-len(rows) // ROWS)
    spans = [rows[first : first + each] for first in range(0, len(rows), each)]
    return [(_span(span), [lift for _, own in span for lift in own]) for span in spans]


def _grouped(
    lifts: Sequence[dict[str, Any]], key: Callable[[dict[str, Any]], str]
) -> Iterator[tuple[str, list[dict[str, Any]]]]:
    found: dict[str, list[dict[str, Any]]] = {}
    for lift in lifts:
        found.setdefault(key(lift), []).append(lift)
    yield from found.items()


def _storey(lift: dict[str, Any]) -> str:
    return str(lift["storey"] or "no storey")


def _storey_and_class(lift: dict[str, Any]) -> str:
    return f"{_storey(lift)}, {str(lift['ifc_class']).removeprefix('Ifc').lower() or 'parts'}"


def _span(rows: Sequence[tuple[str, list[dict[str, Any]]]]) -> str:
    return rows[0][0] if len(rows) == 1 else f"{rows[0][0]} to {rows[-1][0]}"


def days_of(lifts: Sequence[dict[str, Any]]) -> list[tuple[str, float, int]]:
    """Return local date, begin of the first lift on the plan's clock and number of lifts of each day; none undated."""
    dated = sorted((lift for lift in lifts if lift.get("begins_at")), key=lambda lift: float(lift["begins_s"]))
    return [
        (day, own[0]["begins_s"], len(own))
        for day, own in ((day, list(group)) for day, group in groupby(dated, lambda lift: str(lift["begins_at"])[:10]))
    ]
