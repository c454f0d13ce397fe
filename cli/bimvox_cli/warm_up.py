"""``bimvox warm-up``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bimvox_cli.options import command
from bimvox_cli.output import Output, fields

if TYPE_CHECKING:
    from rich.console import Console


@command
def warm_up(
    output: Output,
    processes: Annotated[
        int | None,
        typer.Option("--processes", min=1, metavar="N", help="Processes that compile. Default: one a processor."),
    ] = None,
) -> int:
    """Compile beforehand what the first commands would compile."""
    from bimvox_pipeline.warm_up import warm_up as run

    return output.result(run(processes=processes, progress=output.progress), _show)


def _show(console: Console, document: Mapping[str, Any]) -> None:
    done = f"{document['compiled']} of {document['kernels']} compiled" if document["compiled"] else "all there already"
    fields(console, [("kernels", done), ("folder", document["folder"]), ("took", f"{document['seconds']:.1f} s")])
