"""The table of a grid's parts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from bimvox.errors import cut
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


# The table of what the parts are and how each gets to its place, by type.

_WAYS = {
    "crane": "crane",
    "by_hand": "by hand",
    "in_situ": "cast",
    "built": "built",
    "out": "out",
    "pinned": "stands",
}
"""How people call the ways of ``means``."""
_NOT_IN_PLAN = ("out", "pinned")
_UNKNOWN = "unknown"
_NAME, _OTHERS, _WHY = 48, 53, 30
"""Characters of a name, of the columns but the last one with it, and of the least that is shown of a reason."""


def show_kinds(console: Console, kinds: Sequence[Mapping[str, Any]], *, most: int = ROWS_SHOWN) -> None:
    """Print the types of a model, the doubtful ones first; those beyond the first rows are counted."""
    if not kinds:
        return
    unsure = sum(row["count"] for row in kinds if row["doubtful"])
    title = f"what the parts are: {len(kinds):,} type{'s' * (len(kinds) != 1)}"
    if unsure:
        what = " or ".join(one for one in ("kind", "way") if any(one in row["assumed"] for row in kinds))
        title += f", the {what} of {unsure:,} part{'s' * (unsure != 1)} is an assumption: look at these first"
    materials: dict[tuple[str, str], set[str]] = {}
    for row in kinds:
        materials.setdefault((row["ifc_class"], row["type"]), set()).add(row["material"])
    console.print()
    rows(
        console,
        ("parts", "what", "kind", "way", "t each", "known by", "why"),
        [
            (
                row["count"],
                _name(row, several=len(materials[row["ifc_class"], row["type"]]) > 1),
                _kind(row),
                _WAYS[row["means"]],
                _tonnes(row["mass_kg"]),
                _known_by(row),
                cut(row["kind_from"], max(_WHY, console.width - _NAME - _OTHERS)),
            )
            for row in kinds[:most]
        ],
        title=title,
        limit=None,
    )
    rest = kinds[most:]
    if rest:
        parts = sum(row["count"] for row in rest)
        console.print(
            f"... and {len(rest):,} more types with {parts:,} parts (bimvox inspect --csv FILE lists all)",
            style="dim",
        )


def _name(row: Mapping[str, Any], *, several: bool) -> str:
    """Return class and type of a row, with the material if the type has several."""
    name = ", ".join(filter(None, (row["ifc_class"].removeprefix("Ifc"), row["type"])))
    if several and row["material"]:
        return f"{cut(name, _NAME - 20)}, {cut(row['material'], 18)}"
    return cut(name, _NAME)


def _known_by(row: Mapping[str, Any]) -> str | None:
    if row["doubtful"]:
        return "ASSUMED" if "kind" in row["assumed"] else "WAY ASSUMED"
    return None if row["means"] in _NOT_IN_PLAN else str(row["confidence"])


def _kind(row: Mapping[str, Any]) -> str | None:
    if row["kind"] != "other":
        return str(row["kind"])
    return None if row["means"] in _NOT_IN_PLAN else _UNKNOWN


def _tonnes(mass_kg: Sequence[float] | None) -> str | None:
    """Return the lightest and the heaviest mass in tonnes, with sensible digits; one number if they are the same."""
    if mass_kg is None:
        return None
    said = [f"{kg / 1000.0:.1f}" if kg >= 950.0 else f"{kg / 1000.0:.2f}" if kg >= 9.5 else "0.01" for kg in mass_kg]
    return said[0] if said[0] == said[1] else " to ".join(said)
