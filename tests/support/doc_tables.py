"""The tables of the documents, and how far a figure may be from the one that is measured again."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")), *sorted((ROOT / "docs" / "data").glob("*.txt"))]

_NUMBER = re.compile(r"\d[\d,]*(?:\.\d+)?")
_SPREAD = re.compile(r"^(-?[\d.]+)±([\d.]+)")
_RATE = re.compile(r"^([\d.]+)% \(([\d.]+)-([\d.]+)\)$")

Table = dict[str, dict[str, str]]
"""Cells by the row's first cell, then by the head of the column."""


def tables_of(text: str) -> Iterator[tuple[str, Table]]:
    """Yield the Markdown tables of a text, each with its first line."""
    for found in re.findall(r"(?:^\|.*\n?)+", text, re.M):
        head, _, *rows = (line for line in found.splitlines())
        table: Table = {}
        for row in rows:
            cells = cells_of(row)
            # A first column that repeats itself is told apart by the second one.
            key = cells[0] if cells[0] not in table else f"{cells[0]}, {cells[1]}"
            table[key] = dict(zip(cells_of(head), cells, strict=False))
        yield head, table


def cells_of(line: str) -> list[str]:
    """Return the cells of a line of a table."""
    return [cell.strip() for cell in line.strip().strip("|").split("|")]


def table_of(page: str, head: str) -> Table:
    """Return the one table of a page whose first line begins so."""
    (found,) = (table for line, table in tables_of((ROOT / page).read_text("utf-8")) if line.startswith(head))
    return found


def agree(documented: str, again: str, within: float) -> bool:
    """Return whether a cell that is computed again agrees with the documented one.

    Intervals must overlap: ``711±39``, and rates, ``77.6% (73.3-81.5)``. Of other cells the words must be the same, and
    numbers may differ by a share and by half of the last digit.
    """
    if one := _SPREAD.match(documented):
        other = _SPREAD.match(again)
        return other is not None and abs(float(one[1]) - float(other[1])) <= float(one[2]) + float(other[2])
    if one := _RATE.match(documented):
        other = _RATE.match(again)
        return other is not None and float(one[2]) <= float(other[3]) and float(other[2]) <= float(one[3])
    numbers = [_NUMBER.findall(cell) for cell in (documented, again)]
    if _NUMBER.sub("#", documented) != _NUMBER.sub("#", again) or len(numbers[0]) != len(numbers[1]):
        return False
    return all(_near(*pair, within) for pair in zip(*numbers, strict=True))


def _near(documented: str, again: str, within: float) -> bool:
    one, other = (float(number.replace(",", "")) for number in (documented, again))
    digits = len(documented.partition(".")[2])
    return abs(one - other) <= within * abs(one) + (10.0**-digits if within else 0.0) + 1e-12
