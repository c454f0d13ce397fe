"""What a person must do or look at, by consequence, in a few lines: alike matters are one line with a count."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from bimvox.errors import listed
from bimvox.records.proof import ASSUMED_KIND
from bimvox_cli.output import lines_of, rows, shortened
from bimvox_cli.remarks import NOTE, SERIOUS

if TYPE_CHECKING:
    from rich.console import Console

MOST_LINES = 25
"""Lines of an answer, the next command included."""
Matter = tuple[str, int | None, str, str]
"""How grave it is, how many are alike, what it is about, and the first of them. One about all parts has no count."""


_MATTER = ("look at", "count", "about", "first of them")


def remark_matters(remarks: Sequence[Mapping[str, Any]], numbers: Mapping[str, int] | None = None) -> list[Matter]:
    """Return the remarks by severity and kind, with one example each; of the notes, only what parts are taken as.

    ``numbers`` of the parts by id, if known: many parts have one name.
    """
    groups: dict[tuple[str, str], list[Mapping[str, Any]]] = {}
    for remark in remarks:
        if remark["severity"] != NOTE or remark["kind"] == ASSUMED_KIND:
            groups.setdefault((remark["severity"], remark["kind"]), []).append(remark)
    rank = {SERIOUS: 0, NOTE: 1}
    return [
        (
            *(
                ("assumed", None, "what parts are")
                if severity == NOTE
                else (severity, len(own), kind.replace("_", " "))
            ),
            f"{named(own[0], numbers or {})}{own[0]['text']}",
        )
        for (severity, kind), own in sorted(groups.items(), key=lambda item: rank.get(item[0][0], 2))
    ]


def named(one: Mapping[str, Any], numbers: Mapping[str, int]) -> str:
    """Return the part that something is about, as it begins a sentence; empty if it is about the whole plan."""
    if one["name"] is None:
        return ""
    number = numbers.get(one["component"])
    return f"{one['name']}: " if number is None else f"{number} {one['name']}: "


def show_matters(console: Console, matters: Sequence[Matter], *, most_lines: int) -> None:
    """Print the matters below a blank line, in at most so many lines; count the rest.

    Each has one line, unless all of them fit with their whole texts.
    """
    if not matters:
        return
    console.print()
    room = max(1, most_lines - 2)
    if lines_of(console, lambda: rows(console, _MATTER, matters, limit=None)) <= room + 1:
        rows(console, _MATTER, matters, limit=None)
        return
    shown = matters if len(matters) <= room else matters[: max(1, room - 1)]
    rows(console, _MATTER, shown, limit=None, cut=_MATTER[-1])
    if rest := matters[len(shown) :]:
        count, kinds = sum(one[1] or 1 for one in rest), listed((one[2] for one in rest), 6)
        console.print(shortened(f"... and {count:,} more ({kinds})", console.width), style="dim")
