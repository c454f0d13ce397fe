"""``bimvox export``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bimvox.exporters.formats import formats_in_words
from bimvox_cli import complete
from bimvox_cli.options import command, to_file
from bimvox_cli.output import Output, facts

if TYPE_CHECKING:
    from rich.console import Console


@command
def export(
    output: Output,
    source: Annotated[
        Path, typer.Argument(metavar="LOG|GRID", help="A log of `bimvox plan`, or a grid of `bimvox voxelize`.")
    ],
    to: Annotated[
        str | None,
        typer.Option(
            "--to",
            envvar="BIMVOX_TO",
            metavar="FORMAT",
            autocompletion=complete.formats,
            help=formats_in_words(),
            show_default=False,
        ),
    ] = None,
    lift: Annotated[
        list[str] | None,
        typer.Option(
            "--lift",
            metavar="ID",
            autocompletion=complete.lifts,
            help="Only this lift (number from 1, or the part's name, id or GlobalId); may be given several times.",
        ),
    ] = None,
    out: Annotated[Path | None, to_file("OUT", "Output file or folder.")] = None,
    recover: Annotated[
        bool,
        typer.Option("--recover", help="Save the readable part of a truncated or damaged log, and prove it again."),
    ] = False,
    model: Annotated[
        Path | None,
        typer.Option("--model", metavar="IFC", help="For ifc: the model of the plan."),
    ] = None,
    start: Annotated[
        str | None,
        typer.Option(
            "--start",
            metavar="DATETIME",
            help="Start of work, local time, in the hours of the site file's [calendar]. Default: its start.",
        ),
    ] = None,
    done: Annotated[
        Path | None,
        typer.Option(
            "--done",
            metavar="FILE",
            help="What has been carried out: CSV (part,begins,ends), or MS Project XML or XER with actual dates.",
        ),
    ] = None,
    baseline: Annotated[
        Path | None,
        typer.Option("--baseline", metavar="LOG", help="The plan with the planned dates. Default: the log itself."),
    ] = None,
) -> int:
    """Write a log, some of its lifts, or a grid in another format."""
    from bimvox_pipeline.export import export as run
    from bimvox_pipeline.export import parsed_start

    from bimvox.library.export import When

    document = run(
        source,
        to=to,
        lifts=tuple(lift or ()),
        out=out,
        recover=recover,
        model=model,
        when=When(parsed_start(start), done, baseline),
        progress=output.progress,
    )
    return output.result(document, _show)


def _show(console: Console, document: Mapping[str, Any]) -> None:
    """Print the facts; messages are those of a format that has any."""
    facts(console, {key: value for key, value in document.items() if key != "messages" or value})
