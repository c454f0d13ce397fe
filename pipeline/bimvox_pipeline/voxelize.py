"""The stage from a building model to a grid file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from bimvox.bim.options import ReadOptions
from bimvox.errors import FileError, InputError
from bimvox.files import check_output, default_output, require_input, write_atomically
from bimvox.library.site import say_notes
from bimvox.progress import Progress

_MODEL_SUFFIXES = frozenset(
    {".ifc", ".ifczip", ".stl", ".obj", ".ply", ".off", ".glb", ".gltf", ".3mf", ".toml", ".json"}
)


def voxelize(
    model: Path,
    out: Path | None = None,
    *,
    options: ReadOptions | None = None,
    voxel_size_m: float | None = None,
    threads: int = 1,
    progress: Progress,
) -> dict[str, Any]:
    """Voxelize a building model, write the grid, and return the document of ``bimvox voxelize --json``.

    Args:
        model: IFC or mesh file.
        out: Grid file; ``<model>.zarr.zip`` in the current folder if None.
        options: How to read the model.
        voxel_size_m: Edge of a cell; a round size that keeps the model below 20 million cells if None.
        threads: Number of parts voxelized in parallel; it does not change the grid.
        progress: Receives stages and notes.

    Raises:
        InputError: If the model or an option cannot be used; nothing is written.
    """
    progress.stage("read")
    import numpy as np

    from bimvox.bim.read import read_building
    from bimvox.grid.layout import SUFFIX
    from bimvox.grid.storage import write_grid
    from bimvox.units import metres_per
    from bimvox.voxelization.building import voxelize_building
    from bimvox.voxelization.lattice import default_voxel_size_m
    from bimvox_pipeline.inspect.grid import describe_parts, describe_totals

    require_input(model)
    out = out or default_output(model, SUFFIX)
    check_output(out, inputs=[model])
    if out.suffix.lower() in _MODEL_SUFFIXES:
        raise FileError(out, "a grid cannot have this name", hint=f"end it in {SUFFIX}")
    options = options or ReadOptions()
    if options.unit is not None:
        metres_per(options.unit)
    if voxel_size_m is not None and not 0 < voxel_size_m < float("inf"):
        raise InputError(f"a cell of {voxel_size_m:g} m is impossible", hint="give an edge above 0, in metres")
    building = read_building(model, options, progress.report)
    say_notes(building, progress)
    if voxel_size_m is None:
        voxel_size_m = default_voxel_size_m(building.bounds_m)
        progress.note(f"cell size {voxel_size_m:g} m; --voxel-size sets another")
    progress.stage("voxelize")
    grid = voxelize_building(building, voxel_size_m, threads=threads, progress=progress.report)
    progress.stage("write")
    write_atomically(out, lambda stream: write_grid(grid, stream, threads=threads), inputs=[model])
    progress.finish()
    parts = describe_parts(grid)
    return {
        "grid": str(out),
        "shape": list(grid.shape),
        "voxel_size_m": grid.frame.voxel_size_m,
        "origin_m": list(grid.frame.origin_m),
        "counts": grid.counts(),
        "shared_cells": len(np.unique(grid.shared_cells, axis=0)),
        "components": [part for part in parts if part["role"] == "component"],
        "others": [part for part in parts if part["role"] != "component"],
        "totals": describe_totals(parts),
        "source": dict(grid.source),
        "skipped": [
            {"global_id": item.global_id, "ifc_class": item.ifc_class, "name": item.name, "reason": item.reason}
            for item in building.skipped
        ],
        "notes": list(building.notes),
        "seconds": progress.seconds,
    }
