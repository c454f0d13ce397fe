"""``bimvox voxelize``."""

from __future__ import annotations

import shlex
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bimvox_cli.options import (
    Assemblies,
    Model,
    Processes,
    Select,
    Unit,
    Up,
    VoxelSize,
    command,
    read_options,
    to_file,
)
from bimvox_cli.output import Output, fields, rows, spent
from bimvox_cli.part_table import show_parts

if TYPE_CHECKING:
    from rich.console import Console


@command
def voxelize(
    output: Output,
    model: Model,
    out: Annotated[Path | None, to_file("GRID", "Grid file. Default: MODEL.zarr.zip in the current folder.")] = None,
    voxel_size: VoxelSize = None,
    select: Select = None,
    unit: Unit = None,
    up: Up = None,
    assemblies: Assemblies = "whole",
    threads: Annotated[
        int, typer.Option(min=1, metavar="N", envvar="BIMVOX_THREADS", help="Threads; the grid does not depend on it.")
    ] = 1,
    processes: Processes = None,
) -> int:
    """Turn a building model into a labelled voxel grid."""
    from bimvox_pipeline.voxelize import voxelize as run
    from bimvox_pipeline.warm_up import helped

    with helped("voxelize"):
        document = run(
            model,
            out,
            options=read_options(select, unit, up, assemblies, processes),
            voxel_size_m=voxel_size,
            threads=threads,
            progress=output.progress,
        )
    code = output.result(document, _show)
    nothing = "next: select the parts to lift with --select: no component was found in this model"
    given = {
        "--select": select,
        "--unit": unit,
        "--up": up,
        "--assemblies": None if assemblies == "whole" else assemblies,
    }
    options = [word for option, value in given.items() if value is not None for word in (option, value)]
    # `init` needs the same options about the model.
    init = shlex.join(["bimvox", "init", str(model), *options])
    output.next_step(f"next: {init}" if document["components"] else nothing)
    return code


def _show(console: Console, document: Mapping[str, Any]) -> None:
    shape = document["shape"]
    cells = shape[0] * shape[1] * shape[2]
    parts, others = document["components"], document["others"]
    show_parts(console, [*parts, *others])
    skipped = Counter((item["ifc_class"], item["reason"]) for item in document["skipped"]).most_common()
    if skipped:
        console.print()
    rows(console, ("class", "products", "reason"), [(c, n, r) for (c, r), n in skipped], title="left out")
    console.print()
    fields(
        console,
        [
            ("grid", document["grid"]),
            ("cells", f"{shape[0]} x {shape[1]} x {shape[2]} = {cells:,} of {document['voxel_size_m']:g} m"),
            ("labels", ", ".join(f"{label} {count:,}" for label, count in document["counts"].items())),
            ("parts", f"{len(parts):,} components (lifted unless the site file pins them), others: {len(others):,}"),
            ("took", spent(document["seconds"])),
        ],
    )
