"""``bimvox optimise``."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bimvox_cli.fleet_options import BackendName, Fresh, Jobs
from bimvox_cli.options import MachineChoice, command, to_file
from bimvox_cli.output import Column, Output, cells_of, fields, rounded, rows, spent, table

if TYPE_CHECKING:
    from rich.console import Console


_FOLDER = "set-ups"
_GOALS = {"cost": "cheapest", "hours": "fastest", "highest_utilisation": "least used"}


@command
def optimise(
    output: Output,
    sites: Annotated[
        list[Path], typer.Argument(metavar="SITE...", help="Site files (TOML), as `bimvox init` writes them.")
    ],
    crane: MachineChoice = None,
    members: Annotated[
        int,
        typer.Option(
            "--plans",
            min=1,
            max=100,
            metavar="N",
            help="How many of the best set-ups are planned, and another for each that refuses parts; from 4 on, then "
            "half as many around the cheapest.",
        ),
    ] = 6,
    trials: Annotated[
        int, typer.Option("--trials", min=0, max=100_000, metavar="N", help="How many other yards are tried.")
    ] = 48,
    budget: Annotated[
        float | None, typer.Option("--budget", min=0.0, metavar="SECONDS", help="Try other yards no longer than this.")
    ] = None,
    most_cranes: Annotated[
        int, typer.Option("--cranes", min=1, max=2, metavar="N", help="How many cranes a set-up has at most.")
    ] = 2,
    out: Annotated[
        Path | None,
        to_file(
            "FOLDER",
            "Folder of logs, tables and the map. Default: SITE-set-ups in the current folder. For several sites: "
            "one folder each in it. Default: set-ups.",
        ),
    ] = None,
    backend: BackendName = "loky",
    jobs: Jobs = None,
    fresh: Fresh = False,
) -> int:
    """Look for a better crane, place and yard.

    Every machine is tried at every place where its mast can stand, with other yards, unless trucks or parts have their
    places, and with a second crane. A mobile crane is tried in several set-ups, if it sets more parts so. The set-ups
    that no other beats in hours, cost and highest utilisation are planned and proven in full, the cheapest first, and
    so is the given one: cost is crew, hire and lorries (`[costs]`). Their site files are written next to it. Several
    sites are searched in parallel: one table and one page of all.
    """
    from bimvox_pipeline.fleet.schedule import Execution
    from bimvox_pipeline.optimise import optimise as optimise_one
    from bimvox_pipeline.optimise import optimise_all

    from bimvox.library.set_up_search.set_up import Effort

    several = len(sites) > 1
    act = partial(optimise_all, sites, out or Path(_FOLDER)) if several else partial(optimise_one, sites[0], out)
    return output.result(
        act(
            crane=crane,
            effort=Effort(members, trials, budget, most_cranes),
            execution=Execution(backend, jobs, fresh=fresh),
            progress=output.progress,
        ),
        _show_all if several else _show,
    )


def _show(console: Console, document: Mapping[str, Any]) -> None:
    from bimvox.rendering.report.set_ups import best_of

    given = document["baseline"] | {"is_given": True}
    columns = {document["currency"] if name == "cost" else name: of for name, of in _SET_UPS.items()}
    table(console, columns, [given, *document["front"], *document["losers"]], limit=None)
    console.print()
    best = {key: best_of(document["front"], document["baseline"], key) for key in _GOALS}
    fields(
        console,
        [
            (
                "tried",
                f"{document['machines']:,} machines with jib and reeving, {document['tried']:,} set-ups, "
                f"{document['trials']:,} other yards",
            ),
            *((words, one and one["site"]) for words, one in zip(_GOALS.values(), best.values(), strict=True)),
            ("page", document["page"]),
            ("table", document["table"]),
            ("map", document["map"]),
            ("took", spent(document["seconds"])),
        ],
    )


def _show_all(console: Console, document: Mapping[str, Any]) -> None:
    heads = ("site", "parts", "given h", "fastest h", "machine", "given cost", "cheapest cost", "machine", "why not")
    columns = (
        *("name", "parts", "given_hours", "fastest_hours", "fastest_machine"),
        *(rounded("given_cost"), rounded("cheapest_cost"), "cheapest_machine", "error"),
    )
    rows(console, heads, [cells_of(columns, one) for one in document["sites"]], limit=None)
    console.print()
    kept = f", {document['kept']:,} of them kept" if document["kept"] else ""
    fields(
        console,
        [
            ("sites", f"{len(document['sites']):,}{kept}"),
            ("page", document["page"]),
            ("table", document["table"]),
            ("took", spent(document["seconds"])),
        ],
    )


def _machines(one: Mapping[str, Any]) -> str:
    given = "given: " if one.get("is_given") else ""
    more = f", {len(one['set_ups'])} set-ups" if one["set_ups"] else ""
    return f"{given}{one['machine']}{more}" + (f" + {one['second']['machine']}" if one["second"] else "")


def _places(one: Mapping[str, Any]) -> str:
    return ", ".join("({:g}, {:g})".format(*each["base_m"]) for each in one["set_ups"] or (one, one["second"]) if each)


def _yard(one: Mapping[str, Any]) -> str:
    if any(each["yard"] for each in one["set_ups"] or ()):
        return "one each"
    place = "given" if one["yard"] is None else "({:g}, {:g})".format(*one["yard"][0])
    return place + (f", {one['truckload_kg'] / 1000.0:g} t" if one["truckload_kg"] else "")


_SET_UPS: dict[str, Column] = {
    "set-up": _machines,
    "jib m": "jib_m",
    "falls": "falls",
    "at": _places,
    "yard, truckload": _yard,
    "refused": "refused",
    "crane hours": "hours",
    "moving h": "moving_hours",
    "between set-ups h": lambda one: one["move_hours"] or None,
    "hire days": "hire_days",
    "critical": "critical_lifts",
    "highest %": rounded("highest_utilisation", per=0.01),
    "cost": rounded("cost"),
    "why not": lambda one: one["error"]["message"] if one["error"] else one.get("why_lost"),
}
