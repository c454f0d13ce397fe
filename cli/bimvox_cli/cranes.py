"""``bimvox cranes``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bimvox_cli.options import MachineChoice, command
from bimvox_cli.output import Column, Output, rounded, table

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
    sources: Annotated[
        bool, typer.Option("--sources", help="With each real machine: where its figures come from, what is not known.")
    ] = False,
) -> int:
    """Compare the machines of the catalogue on a site, or list them."""
    from bimvox_pipeline.cranes import cranes as run

    return output.answer(run(site, crane=crane, progress=output.progress), partial(_show, with_sources=sources))


def _show(console: Console, document: Mapping[str, Any], *, with_sources: bool) -> None:
    """Print one table: a row for each machine."""
    machines = document["machines"]
    if document["site"] is None:
        table(console, _LISTED, machines, limit=None)
        for machine in machines if with_sources else ():
            _show_sources(console, machine)
        return
    own = document["own"]
    on_site = [own | {"machine": f"the site's: {own['machine']}"}] if own else []
    table(console, _ON_SITE, [*on_site, *machines], limit=None)


def _show_sources(console: Console, machine: Mapping[str, Any]) -> None:
    """Print where the figures of a real machine come from, and what it does not have."""
    for source in machine["sources"]:
        where = ", ".join(filter(None, (source["title"], source["publisher"], source["date"], source["address"])))
        console.print(f"{machine['machine']}: {source['states']}. {where}", markup=False, highlight=False)
    if machine["sources"]:
        console.print(f"  as of {machine['like']}: {', '.join(machine['assumed'])}", markup=False, highlight=False)
        console.print(f"  not found: {', '.join(machine['not_found'])}", markup=False, highlight=False)


def _listed(values: Sequence[float]) -> str:
    return ", ".join(f"{value:g}" for value in values)


_LISTED: dict[str, Column] = {
    "machine": "machine",
    "kind": "kind",
    "tm": rounded("load_moment_tm"),
    "jibs m": lambda one: _listed(one["jib_lengths_m"]),
    "falls": lambda one: _listed(one["falls"]),
    "t": lambda one: one["largest_capacity_kg"] / 1000.0,
    "t at jib's end": lambda one: one["capacity_at_jib_end_kg"] / 1000.0,
    "about": "about",
    "source": "source",
}
_ON_SITE: dict[str, Column] = {
    "machine": "machine",
    "tm": rounded("load_moment_tm"),
    "jib m": "jib_length_m",
    "falls": "falls",
    "serves": "serves",
    "parts": lambda one: f"{one['parts_served']} of {one['parts']}",
    "highest %": rounded("highest_utilisation", per=0.01),
    "largest radius m": rounded("largest_radius_m", 1),
    "hours": "estimated_hours",
    "cost": rounded("estimated_cost"),
    "why not": "reason",
}
