"""``bimvox init``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import date, datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bimvox.rendering.words import counted
from bimvox_cli import complete
from bimvox_cli.options import Assemblies, Model, Select, Unit, Up, VoxelSize, command, read_options, to_file
from bimvox_cli.output import Output, facts, in_lines
from bimvox_cli.part_table import show_kinds

if TYPE_CHECKING:
    from rich.console import Console

_KINDS = 12
"""Types of parts that are printed without being asked for."""


@command
def init(
    output: Output,
    model: Model,
    out: Annotated[
        Path | None,
        to_file(
            "SITE.toml",
            "Site file; its drawing has the same name with .svg. Default: MODEL.site.toml in the current folder.",
        ),
    ] = None,
    select: Select = None,
    unit: Unit = None,
    up: Up = None,
    voxel_size: VoxelSize = None,
    assemblies: Assemblies = "whole",
    crane: Annotated[
        str | None,
        typer.Option(
            "--crane",
            envvar="BIMVOX_CRANE",
            metavar="NAME",
            autocompletion=complete.cranes,
            help="Crane to propose: a kind (hammerhead, luffing, mobile), a machine of `bimvox cranes`, or a machine "
            "file next to the site file. Default: the smallest hammerhead that serves. fictitious: also machines that "
            "do not exist.",
        ),
    ] = None,
    kind_file: Annotated[
        Path | None,
        typer.Option(
            "--kinds",
            metavar="FILE.csv",
            help="What the parts are: a table that `bimvox inspect --csv` wrote, corrected, next to the site file.",
        ),
    ] = None,
    start: Annotated[
        datetime | None,
        typer.Option(
            "--start",
            formats=["%Y-%m-%d"],
            metavar="YYYY-MM-DD",
            help="First day of work. Default: that of the model's schedule, otherwise the first Monday after the model "
            "was written.",
        ),
    ] = None,
    full: Annotated[
        bool, typer.Option("--full", help="Write every key with its default. Otherwise only those that differ.")
    ] = False,
    force: Annotated[bool, typer.Option("--force", "-f", help="Replace an existing site file.")] = False,
) -> int:
    """Write and draw a site file with guesses for crane and yard."""
    from bimvox_pipeline.site import init as run
    from bimvox_pipeline.warm_up import helped

    with helped("init"):
        document = run(
            model,
            out,
            options=read_options(select, unit, up, assemblies),
            voxel_size_m=voxel_size,
            crane=crane,
            kind_file=kind_file,
            start=None if start is None else start.date(),
            full=full,
            force=force,
            progress=output.progress,
        )
    code = output.result(document, partial(_show, verbose=output.verbose))
    output.next_step(
        f"next: look at {document['drawing']}, read {document['site']}, then bimvox plan {document['site']}"
    )
    return code


def _show(console: Console, document: Mapping[str, Any], *, verbose: bool) -> None:
    """Print what was guessed, a line each, and what the parts are; if verbose, all of it."""
    if verbose:
        said = ("notes", "kinds")  # the notes were printed as they came
        facts(console, {key: value for key, value in document.items() if key not in said})
        show_kinds(console, document["kinds"])
        return
    in_lines(
        console,
        [
            ("site", f"{document['site']}, drawn in {document['drawing']}"),
            ("parts", f"{counted(document['components'], 'part')} in the plan; {document['structure']:,} stand before"),
            ("ground", f"{document['ground_m']:.4g} m: {document['ground_why']}"),
            ("start", _start(document)),
            ("crane", _crane(document)),
            ("not lifted", _not_lifted(document["cannot_lift"])),
            ("more", "-v: other cranes, and all types of parts"),
        ],
    )
    show_kinds(console, document["kinds"], most=_KINDS)


def _start(document: Mapping[str, Any]) -> str:
    """Return the first day of work, and where it comes from."""
    if document["start"] is None:
        return "no date in the model: times are day 1 07:00; --start YYYY-MM-DD sets one"
    return f"{date.fromisoformat(document['start']):%a %d %b %Y}: {document['start_why']}"


def _crane(document: Mapping[str, Any]) -> str:
    """Return the crane, and why the next smaller one does not serve."""
    smaller = document["smaller_cranes"]
    why = f"; the smaller {smaller[-1]['machine']} {smaller[-1]['reason']}" if smaller else ""
    return f"{document['crane']}{why}"


def _not_lifted(parts: Sequence[Mapping[str, Any]]) -> str | None:
    """Return how many parts the crane cannot lift, and why the first of them."""
    return f"{counted(len(parts), 'part')}, first {parts[0]['name']}: {parts[0]['reason']}" if parts else None
