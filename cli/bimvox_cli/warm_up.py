"""``bimvox warm-up``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bimvox_cli.options import Json, Quiet, Verbose
from bimvox_cli.output import fields, open_output

if TYPE_CHECKING:
    from rich.console import Console


def warm_up(
    processes: Annotated[
        int | None,
        typer.Option("--processes", min=1, metavar="N", help="Processes that compile. Default: one a processor."),
    ] = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Compile beforehand what the first commands would compile."""
    from bimvox_pipeline.warm_up import warm_up as run

    with open_output(as_json=json, quiet=quiet, verbose=verbose) as output:
        document = run(processes=processes, progress=output.progress)
    raise typer.Exit(output.result(document, _show))


def _show(console: Console, document: Mapping[str, Any]) -> None:
    done = f"{document['compiled']} of {document['kernels']} compiled" if document["compiled"] else "all there already"
    fields(console, [("kernels", done), ("folder", document["folder"]), ("took", f"{document['seconds']:.1f} s")])
