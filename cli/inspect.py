"""``bimvox inspect``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cli.options import Json, Quiet
from cli.output import facts, open_output

if TYPE_CHECKING:
    from rich.console import Console

_PART_COLUMNS = ("ifc_class", "name", "global_id", "role", "cells", "solid_volume_m3", "mass_kg")


def inspect(
    file: Annotated[
        Path,
        typer.Argument(metavar="FILE", help="An IFC file, a mesh, a grid, a site file, a log, obstructions, a policy."),
    ],
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Say what a file is and what it holds."""
    from pipeline.inspect import inspect as run

    with open_output(as_json=json, quiet=quiet) as output:
        document = run(file, progress=output.progress)
    raise typer.Exit(output.answer(document, _show))


def _show(console: Console, document: Mapping[str, Any]) -> None:
    """Print the document, of the long table of parts the columns that fit a terminal."""
    parts = [{key: part[key] for key in _PART_COLUMNS} for part in document.get("parts", ())]
    facts(console, {**document, "parts": parts} if parts else document)
