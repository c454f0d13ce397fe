"""``bimvox cranes``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bimvox_cli.options import MachineChoice, command
from bimvox_cli.output import Output, rows

if TYPE_CHECKING:
    from rich.console import Console


@command
def cranes(
    output: Output,
    site: Annotated[
        Path | None,
        typer.Argument(metavar="[SITE]", help="Site file on which the machines are compared. Without it, lists them."),
    ] = None,
    crane: MachineChoice = None,
) -> int:
    """Compare the machines of the catalogue on a site, or list them."""
    from bimvox_pipeline.cranes import cranes as run

    return output.answer(run(site, crane=crane, progress=output.progress), _show)


def _show(console: Console, document: Mapping[str, Any]) -> None:
    """Print one table: a row for each machine."""
    machines = document["machines"]
    if document["site"] is None:
        headings = ("machine", "kind", "tm", "jibs m", "falls", "t", "t at jib's end", "about")
        values = [
            (
                one["machine"],
                one["kind"],
                round(one["load_moment_tm"]),
                _listed(one["jib_lengths_m"]),
                _listed(one["falls"]),
                one["largest_capacity_kg"] / 1000.0,
                one["capacity_at_jib_end_kg"] / 1000.0,
                one["about"],
            )
            for one in machines
        ]
        rows(console, headings, values, limit=None)
        return
    headings_of_site = (
        "machine",
        "tm",
        "jib m",
        "falls",
        "serves",
        "parts",
        "highest %",
        "largest radius m",
        "hours",
        "cost",
        "why not",
    )
    own = document["own"]
    on_site = [_row(own, "the site's: ")] if own else []
    rows(console, headings_of_site, [*on_site, *(_row(one) for one in machines)], limit=None)


def _row(one: Mapping[str, Any], prefix: str = "") -> tuple[object, ...]:
    return (
        prefix + one["machine"],
        round(one["load_moment_tm"]),
        one["jib_length_m"],
        one["falls"],
        one["serves"],
        f"{one['parts_served']} of {one['parts']}",
        round(100.0 * one["highest_utilisation"]),
        round(one["largest_radius_m"], 1),
        one["estimated_hours"],
        round(one["estimated_cost"]),
        one["reason"],
    )


def _listed(values: Sequence[float]) -> str:
    return ", ".join(f"{value:g}" for value in values)
