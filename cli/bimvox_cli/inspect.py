"""``bimvox inspect``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bimvox_cli.options import command
from bimvox_cli.output import Output, facts
from bimvox_cli.part_table import show_kinds, show_parts

if TYPE_CHECKING:
    from rich.console import Console


@command
def inspect(
    output: Output,
    file: Annotated[
        Path,
        typer.Argument(metavar="FILE", help="An IFC file, a mesh, a grid, a site file, a log, obstructions, a policy."),
    ],
    part: Annotated[
        str | None,
        typer.Option("--part", metavar="ID", help="For a grid: only this part (id or name), with its boxes."),
    ] = None,
    kind_file: Annotated[
        Path | None,
        typer.Option(
            "--csv",
            metavar="FILE",
            help="For a model or a site: write what its parts are, by type, as CSV. Correct it in a spreadsheet and "
            'name it in the site file: [model] kinds = "FILE".',
        ),
    ] = None,
) -> int:
    """Print what a file is and what it holds."""
    from bimvox_pipeline.inspect.inspect import inspect as run

    return output.answer(run(file, part=part, kind_file=kind_file, progress=output.progress), _show)


def _show(console: Console, document: Mapping[str, Any]) -> None:
    """Print the document; the parts of a grid as a separate table with totals."""
    if "part" in document:
        facts(console, document["part"])
        return
    facts(
        console, _each_crane({key: value for key, value in document.items() if key not in ("parts", "totals", "kinds")})
    )
    show_kinds(console, document.get("kinds", ()))
    if document.get("parts"):
        console.print()
        show_parts(console, document["parts"])


def _each_crane(document: Mapping[str, Any]) -> dict[str, Any]:
    """Return the document with one entry for each crane of a site instead of the list."""
    cranes = document.get("cranes")
    shown: dict[str, Any] = {}
    for key, value in document.items():
        if key == "crane" and cranes:
            shown |= {f"crane {number}": crane for number, crane in enumerate(cranes, start=1)}
        elif key != "cranes":
            shown[key] = value
    return shown
