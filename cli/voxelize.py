"""``bimvox voxelize``."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cli.options import Assemblies, Json, Model, Quiet, Select, Unit, VoxelSize
from cli.output import ROWS_SHOWN, fields, open_output, rows, spent

if TYPE_CHECKING:
    from rich.console import Console


def voxelize(
    model: Model,
    out: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="GRID", help="Grid file; MODEL.zarr.zip here if not given.")
    ] = None,
    voxel_size: VoxelSize = None,
    select: Select = None,
    unit: Unit = None,
    assemblies: Assemblies = "whole",
    threads: Annotated[
        int, typer.Option(min=1, metavar="N", envvar="BIMVOX_THREADS", help="Threads; any number gives the same grid.")
    ] = 1,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Turn a building model into a labelled voxel grid."""
    from pipeline.voxelize import voxelize as run

    with open_output(as_json=json, quiet=quiet) as output:
        document = run(
            model,
            out,
            voxel_size_m=voxel_size,
            select=select,
            unit=unit,
            assemblies=assemblies,
            threads=threads,
            progress=output.progress,
        )
    code = output.result(document, _show)
    nothing = "next: say what to lift with --select: nothing in this model is a component"
    output.next_step(f"next: bimvox init {model}" if document["components"] else nothing)
    raise typer.Exit(code)


def _show(console: Console, document: Mapping[str, Any]) -> None:
    shape = document["shape"]
    cells = shape[0] * shape[1] * shape[2]
    parts, others = document["components"], document["others"]
    _show_parts(console, [*parts, *others])
    skipped = Counter((item["ifc_class"], item["reason"]) for item in document["skipped"])
    if skipped:
        console.print()
    rows(console, ("class", "products", "reason"), [(c, n, r) for (c, r), n in skipped.items()], title="left out")
    console.print()
    fields(
        console,
        [
            ("grid", document["grid"]),
            ("cells", f"{shape[0]} x {shape[1]} x {shape[2]} = {cells:,} of {document['voxel_size_m']:g} m"),
            ("labels", ", ".join(f"{label} {count:,}" for label, count in document["counts"].items())),
            ("parts", f"{len(parts):,} to lift, {len(others):,} others"),
            ("took", spent(document["seconds"])),
        ],
    )


def _show_parts(console: Console, parts: list[Mapping[str, Any]]) -> None:
    """Print every part where they are few, else a line for each class and role, the most numerous first."""
    if len(parts) <= ROWS_SHOWN:
        keys = ("ifc_class", "name", "global_id", "role", "cells", "solid_volume_m3")
        rows(console, ("class", "name", "id", "role", "cells", "m3"), [[part[key] for key in keys] for part in parts])
        return
    groups: dict[tuple[str, str], list[Mapping[str, Any]]] = {}
    for part in parts:
        groups.setdefault((part["ifc_class"], part["role"]), []).append(part)
    rows(
        console,
        ("class", "role", "parts", "cells", "m3"),
        [
            (
                *group,
                len(members),
                sum(part["cells"] for part in members),
                sum(part["solid_volume_m3"] for part in members),
            )
            for group, members in sorted(groups.items(), key=lambda item: -len(item[1]))
        ],
    )
