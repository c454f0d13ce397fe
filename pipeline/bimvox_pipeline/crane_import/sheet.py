"""What the readers of data sheets return: tables in metres and kilograms, and what was said beside them."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from math import floor

LOADS_KG = {
    "t": 1000.0,
    "kg": 1.0,
    "lb": 0.45359237,
    "klb": 453.59237,
    "kN": 1000.0 / 9.80665,
    "short_ton": 907.18474,
}
"""Units of loads; ``klb``: thousands of pounds."""
LENGTHS_M = {"m": 1.0, "ft": 0.3048}
"""Units of lengths."""


def kilograms(value: float, unit: str) -> float:
    """Return a load in kilograms, rounded down to a whole one."""
    return float(floor(value * LOADS_KG[unit] + 1e-6))


def metres(value: float, unit: str) -> float:
    """Return a length in metres, rounded down to a millimetre: a listed radius is never longer than the sheet's."""
    return floor(value * LENGTHS_M[unit] * 1000.0 + 1e-6) / 1000.0


@dataclass(slots=True)
class SheetTable:
    """One table of a data sheet.

    Attributes:
        line: Line of the source where it begins, from 1; 0 if the source has no lines.
        lengths_m: Lengths of its columns.
        rows: (radius, capacities) for each row; 0 for a blank.
        lines: Line of each row.
        counterweight_kg: Counterweight; None if it does not say.
        outriggers: Base of outriggers; None if it does not say.
        sector: Sector; None if it does not say.
        falls: Reeving; None if it does not say.
    """

    line: int
    lengths_m: tuple[float, ...]
    rows: list[tuple[float, tuple[float, ...]]] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)
    counterweight_kg: float | None = None
    outriggers: str | None = None
    sector: str | None = None
    falls: int | None = None

    @property
    def name(self) -> str:
        """What it is about, in words."""
        words = [] if self.counterweight_kg is None else [f"counterweight {self.counterweight_kg / 1000:g} t"]
        words += [f"outriggers {self.outriggers}"] if self.outriggers else []
        words += [f"sector {self.sector}"] if self.sector else []
        words += [f"{self.falls} falls"] if self.falls else []
        where = f"table of line {self.line}" if self.line else "table"
        return f"{where} ({', '.join(words)})" if words else where

    def column(self, number: int) -> list[tuple[float, float, int]]:
        """Return (radius, capacity, line) of a column, without blanks."""
        pairs = zip(self.rows, self.lines, strict=True)
        return [(radius, kg[number], line) for (radius, kg), line in pairs if kg[number] > 0.0]


@dataclass(slots=True)
class Sheet:
    """What a source says.

    Attributes:
        tables: Its tables.
        facts: Keys of a machine file that it states, with their values.
        notes: What it says besides, and what was left out, in words.
    """

    tables: list[SheetTable] = field(default_factory=list)
    facts: dict[str, object] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


_SLIP = 0.8
"""A capacity below this share of the mean of its neighbours looks like a slip of the pen (professional judgement)."""
_HEAVY_KG, _LIGHT_KG = 3_500_000.0, 300.0
"""Largest capacity of any crane, and least of one that is worth a chart: otherwise the unit is wrong."""


def wrong_in(table: SheetTable) -> list[str]:
    """Return what makes a table unusable, each with its line: capacities that grow with the radius, and gaps."""
    wrong = []
    for number, length in enumerate(table.lengths_m):
        column = table.column(number)
        if not column:
            wrong.append(f"{table.name}: the column of {length:g} m is blank")
            continue
        for (near, more, _), (far, less, line) in pairwise(column):
            if less > more:
                wrong.append(
                    f"line {line}: with {length:g} m the capacity grows from {more / 1000:g} t at {near:g} m to "
                    f"{less / 1000:g} t at {far:g} m"
                )
        radii = {radius for radius, _, _ in column}
        for (radius, _), line in zip(table.rows, table.lines, strict=True):
            if column[0][0] < radius < column[-1][0] and radius not in radii:
                wrong.append(f"line {line}: with {length:g} m there is a blank at {radius:g} m, between two capacities")
    for (before, _), (after, _), line in zip(table.rows, table.rows[1:], table.lines[1:], strict=False):
        if after <= before:
            wrong.append(f"line {line}: radius {after:g} m follows {before:g} m; radii must ascend")
    return wrong


def doubtful_in(table: SheetTable) -> list[str]:
    """Return what a person should look at: slips of the pen, and loads that speak of a wrong unit."""
    found = []
    for number, length in enumerate(table.lengths_m):
        column = table.column(number)
        for (near, more, _), (radius, mass, line), (far, less, _) in zip(column, column[1:], column[2:], strict=False):
            # Between two radii of constant moment the capacity is the hyperbola through both.
            expected = less + (more - less) * (1 / radius - 1 / far) / (1 / near - 1 / far)
            if mass < _SLIP * expected:
                found.append(
                    f"line {line}: {mass / 1000:g} t at {radius:g} m with {length:g} m is far below its neighbours "
                    f"({more / 1000:g} t and {less / 1000:g} t)"
                )
    most = max((mass for _, kg in table.rows for mass in kg), default=0.0)
    if not _LIGHT_KG <= most <= _HEAVY_KG:
        found.append(f"{table.name}: its largest capacity is {most / 1000:g} t: is the unit of loads right?")
    return found
