"""The table of what the parts are and how each gets to its place, by type."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from bimvox.errors import cut
from bimvox_cli.output import ROWS_SHOWN, rows

if TYPE_CHECKING:
    from rich.console import Console

WAYS = {
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


def show_kinds(console: Console, kinds: Sequence[Mapping[str, Any]]) -> None:
    """Print the types of a model, the doubtful ones first; those beyond the first rows are counted."""
    if not kinds:
        return
    unsure = sum(row["count"] for row in kinds if row["doubtful"])
    title = f"what the parts are: {len(kinds):,} type{'s' * (len(kinds) != 1)}"
    if unsure:
        title += f", the kind of {unsure:,} part{'s' * (unsure != 1)} is an assumption: look at these first"
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
                WAYS[row["means"]],
                _tonnes(row["mass_kg"]),
                "ASSUMED" if row["doubtful"] else None if row["means"] in _NOT_IN_PLAN else row["confidence"],
                cut(row["kind_from"], max(_WHY, console.width - _NAME - _OTHERS)),
            )
            for row in kinds[:ROWS_SHOWN]
        ],
        title=title,
        limit=None,
    )
    rest = kinds[ROWS_SHOWN:]
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
