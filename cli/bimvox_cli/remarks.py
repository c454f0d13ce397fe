"""Verdict and remarks on the terminal: what is proven, and what a person should look at all the same."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bimvox.errors import listed
from bimvox.records.proof import number_in_words
from bimvox_cli.output import Column, table

if TYPE_CHECKING:
    from rich.console import Console
    from rich.text import Text


Remarks = Annotated[
    bool,
    typer.Option("--remarks", help="The same as --table remarks: every remark, with its part, and every note."),
]

_MOST_KINDS = 6
_Remarks = Sequence[Mapping[str, Any]]
NOTE, SERIOUS = "note", "serious"


def verdict(said: str, document: Mapping[str, Any], *, others: int = 0) -> Text:
    """Return the verdict with the number of remarks next to it: green only if it is proven and there are none.

    Args:
        said: The verdict in words.
        document: The JSON document, with ``verified`` and ``remarks``; notes do not count.
        others: How many parts are set by other means than the crane: with any, it is not green.
    """
    remarks = document["remarks"]
    matter = [remark["severity"] for remark in remarks if remark["severity"] != NOTE]
    counts = {"remarks": len(matter), "serious": matter.count(SERIOUS), "notes": len(remarks) - len(matter)}
    return coloured(said, proven=document["verified"], clean=not others, **counts)


def coloured(said: str, *, proven: bool, remarks: int, serious: int, notes: int = 0, clean: bool = True) -> Text:
    """Return a verdict with the number of remarks next to it, in the colour of both."""
    from rich.text import Text

    colour = "red" if not proven else "green" if clean and not remarks else "yellow"
    return Text(f"{said}, {number_in_words(remarks, serious, notes)}", style=colour)


def show_remarks(console: Console, remarks: _Remarks, numbers: Mapping[str, int] | None = None) -> None:
    """Print every remark with its part, and with its number if these are known, notes included."""
    matter = sum(remark["severity"] != NOTE for remark in remarks)
    columns: dict[str, Column] = {
        **({} if numbers is None else {"lift": lambda one: numbers.get(one["component"])}),
        "severity": "severity",
        "part": lambda one: one["name"] or "-",
        "remark": "text",
    }
    table(console, columns, remarks, title=f"remarks: {matter:,}", limit=None)


def not_covered(lines: Sequence[Mapping[str, Any]]) -> str | None:
    """Return how many lines a person ticks, with the topics of the first ones; None without any."""
    topics = listed((line["topic"].lower() for line in lines), _MOST_KINDS)
    return f"{len(lines):,} lines to be ticked by a person (bimvox report): {topics}" if lines else None


# The cranes of a plan, for people: which machine each is, and what the site changes in it.


def crane_fields(
    cranes: Sequence[Mapping[str, Any]], set_ups: Sequence[Mapping[str, Any]] = ()
) -> list[tuple[str, object]]:
    """Return names and values about the cranes of a document: machine, jib, falls and overrides.

    ``set_ups``: those of one crane that moves; the cranes are the crane in each of them.
    """
    found: list[tuple[str, object]] = []
    for number, (crane, place) in enumerate(zip(cranes, set_ups, strict=False), start=1):
        lifts = f"lifts {place['first']} to {place['last']}" if place["lifts"] > 1 else f"lift {place['first']}"
        what = lifts if place["lifts"] else "serves no lift: the crane does not go there"
        found.append((f"set-up {number}", f"{crane['name']}, jib {crane['jib_length_m']:.4g} m: {what}"))
    if set_ups:
        cranes = [{**cranes[0], "name": cranes[0]["machine"]}]
    for number, crane in enumerate(cranes, start=1):
        heading = "crane" if len(cranes) == 1 else f"crane {number}"
        own = "" if crane["name"] == crane["machine"] else f"{crane['name']}: "
        found.append((heading, f"{own}{crane['machine']}, jib {crane['jib_length_m']:.4g} m, {crane['falls']} falls"))
        changed = [f"{one['key']}: {one['site']} instead of {one['catalogue']}" for one in crane["overrides"]]
        found.append((f"{heading}, override", "\n".join(changed)))
    return found
