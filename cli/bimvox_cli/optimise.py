"""``bimvox optimise``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bimvox_cli.fleet_options import BackendName, Fresh, Jobs
from bimvox_cli.options import Json, MachineChoice, Quiet, SiteFile, Verbose
from bimvox_cli.output import fields, open_output, rows, spent

if TYPE_CHECKING:
    from rich.console import Console


def optimise(
    site: SiteFile,
    crane: MachineChoice = None,
    members: Annotated[
        int, typer.Option("--plans", min=1, max=100, metavar="N", help="How many of the best set-ups are planned.")
    ] = 6,
    out: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FOLDER",
            help="Folder of logs, tables and the map. Default: SITE-set-ups in the current folder.",
        ),
    ] = None,
    backend: BackendName = "loky",
    jobs: Jobs = None,
    fresh: Fresh = False,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Look for a better crane and a better place for it.

    Every machine is tried at every place where its mast can stand. The set-ups that no other beats in hours and cost
    are planned and proven in full, and so is the given one. Their site files are written next to it. Rates: `[costs]`.
    """
    from bimvox_pipeline.optimise.optimise import optimise as run

    with open_output(as_json=json, quiet=quiet, verbose=verbose) as output:
        document = run(
            site, out, crane=crane, members=members, backend=backend, jobs=jobs, fresh=fresh, progress=output.progress
        )
    raise typer.Exit(output.result(document, _show))


def _show(console: Console, document: Mapping[str, Any]) -> None:
    rows(
        console,
        (
            "set-up",
            "jib m",
            "falls",
            "at",
            "parts",
            "estimate h",
            "infeasible",
            "crane h",
            "moving h",
            "critical",
            document["currency"],
        ),
        [
            (
                one["machine"] if n else f"given: {one['machine']}",
                one["jib_m"],
                one["falls"],
                "({:g}, {:g})".format(*one["base_m"]),
                one["parts_served"],
                one["estimated_hours"],
                one["infeasible"] if one["error"] is None else one["error"]["message"],
                one["crane_hours"],
                None if one["crane_hours"] is None else one["crane_hours"] - document["standing_hours"],
                one["critical_lifts"],
                None if one["cost"] is None else round(one["cost"]),
            )
            for n, one in enumerate(document["set_ups"])
        ],
        limit=None,
    )
    console.print()
    fields(
        console,
        [
            ("tried", f"{document['machines']:,} machines with jib and reeving, {document['tried']:,} set-ups"),
            ("fastest", document["best"]),
            ("cheapest", document["cheapest"]),
            ("site files", "\n".join(one["site"] for one in document["set_ups"][1:])),
            ("table", document["table"]),
            ("map", document["map"]),
            ("took", spent(document["seconds"])),
        ],
    )
