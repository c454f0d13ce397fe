"""The table of a grid's parts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from bimvox_cli.output import ROWS_SHOWN, rows

if TYPE_CHECKING:
    from rich.console import Console

_WIDE = 140
"""Width in characters from which all columns fit."""

_Parts = Sequence[Mapping[str, Any]]


def show_parts(console: Console, parts: _Parts) -> None:
    """Print every part if they are few, otherwise a line per class and role, the most numerous first; then totals."""
    if len(parts) <= ROWS_SHOWN:
        _each(console, parts)
    else:
        _by_class(console, parts)
    if any(part["mass_source"] == "default" for part in parts):
        console.print(
            "mass from default: the model has no weight and no known material; the usual density of its kind is "
            "assumed, 2,400 kg/m3 if that is not known",
            style="dim",
        )


def _each(console: Console, parts: _Parts) -> None:
    wide = console.width >= _WIDE
    columns = {
        "class": [part["ifc_class"] for part in parts],
        "name": [part["name"] for part in parts],
        # The ids of a mesh are its names.
        **({"id": [part["id"] for part in parts]} if any(part["id"] != part["name"] for part in parts) else {}),
        "role": [part["role"] for part in parts],
        **({"material": [part["material"] for part in parts]} if wide and any(p["material"] for p in parts) else {}),
        "kg": [_short(part["mass_kg"]) for part in parts],
        "mass from": [part["mass_source"] for part in parts],
        "cells": [part["cells"] for part in parts],
        "m3": [round(part["solid_volume_m3"], 3) for part in parts],
        "% full": [round(100 * part["fill_fraction"]) for part in parts],
        **({"filled by": [part["fill"] for part in parts]} if wide else {}),
        **({"boxes": [part["boxes"] for part in parts]} if wide else {}),
        **({"shared": [part["shared_cells"] for part in parts]} if wide else {}),
    }
    sums = {"class": "total", **_sums(parts)}
    body = [list(row) for row in zip(*columns.values(), strict=True)]
    footer = [[sums.get(heading) for heading in columns]] if len(parts) > 1 else []
    rows(console, list(columns), body + footer, limit=None)


def _by_class(console: Console, parts: _Parts) -> None:
    groups: dict[tuple[str, str], list[Mapping[str, Any]]] = {}
    for part in parts:
        groups.setdefault((part["ifc_class"], part["role"]), []).append(part)
    headings = ("class", "role", "parts", "kg", "mass from", "cells", "m3", "boxes")
    body = []
    for (ifc_class, role), members in sorted(groups.items(), key=lambda item: -len(item[1])):
        sums = _sums(members) | {"class": ifc_class, "role": role, "parts": len(members)}
        sources = Counter(part["mass_source"] for part in members).most_common()
        sums["mass from"] = ", ".join(
            f"{source} {count:,}" if len(sources) > 1 else source for source, count in sources
        )
        body.append([sums[heading] for heading in headings])
    shown = body[:ROWS_SHOWN]
    total = _sums(parts) | {"class": "total", "parts": len(parts)}
    rows(console, headings, [*shown, [total.get(heading) for heading in headings]], limit=None)
    if len(body) > len(shown):
        console.print(f"... and {len(body) - len(shown):,} more classes (--json lists all parts)", style="dim")


def _sums(parts: _Parts) -> dict[str, Any]:
    return {
        "kg": _short(sum(part["mass_kg"] for part in parts)),
        "cells": sum(part["cells"] for part in parts),
        "m3": round(sum(part["solid_volume_m3"] for part in parts), 3),
        "boxes": sum(part["boxes"] for part in parts),
    }


def _short(kg: float) -> float:
    """Return a mass with sensible digits."""
    return round(kg) if kg >= 10 else round(kg, 2)
