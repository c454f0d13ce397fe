"""``bimvox export``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cli.options import Json, Quiet
from cli.output import facts, open_output


def export(
    source: Annotated[Path, typer.Argument(metavar="LOG", help="A log, as `bimvox plan` writes it.")],
    to: Annotated[
        str,
        typer.Option(
            "--to",
            envvar="BIMVOX_TO",
            metavar="FORMAT",
            help="mcap, csv (samples, and a table of lifts) or json.",
        ),
    ] = "mcap",
    lift: Annotated[
        list[str] | None,
        typer.Option(
            "--lift",
            metavar="ID",
            help="Only this lift (component id, GlobalId or order number); may be given several times.",
        ),
    ] = None,
    out: Annotated[Path | None, typer.Option("--output", "-o", metavar="OUT", help="Where to write it.")] = None,
    recover: Annotated[bool, typer.Option("--recover", help="Save what a cut-off log still holds.")] = False,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Write a log, or some of its lifts, in another format."""
    from pipeline.export import export as run

    with open_output(as_json=json, quiet=quiet) as output:
        document = run(source, to=to, lifts=tuple(lift or ()), out=out, recover=recover, progress=output.progress)
    raise typer.Exit(output.result(document, facts))
