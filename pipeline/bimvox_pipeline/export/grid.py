"""``bimvox export`` of a grid: VTK ImageData of its cells, PLY and GLB of its parts' faces."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bimvox.errors import InputError
from bimvox_pipeline.artifacts import check_output, default_output, write_atomically
from bimvox_pipeline.progress import Progress

if TYPE_CHECKING:
    from bimvox.export.mesh import ColouredBody
    from bimvox.grid.voxel_grid import VoxelGrid

FORMATS = ("vti", "ply", "glb")
DEFAULT = "vti"
_THREADS = 2


def export_grid(source: Path, *, to: str, out: Path | None, progress: Progress) -> dict[str, Any]:
    """Write a grid in another form.

    Args:
        source: The grid file.
        to: ``vti`` (cells, for ParaView), ``ply`` or ``glb`` (the outer faces of every part, for viewers).
        out: Where to; default: the grid's name with another suffix, in the current folder.
        progress: Told of the stages.

    Returns:
        The document of ``bimvox export --json``.

    Raises:
        InputError: If the grid or the output cannot be used; nothing is written then.
    """
    from bimvox.export.vti import write_vti
    from bimvox.grid.storage import read_grid

    target = out or default_output(source, f".{to}")
    check_output(target, inputs=[source])
    progress.stage("read")
    with source.open("rb") as stream:
        grid = read_grid(stream, source.name)
    document: dict[str, Any] = {
        "out": str(target),
        "format": to,
        "messages": 0,
        "lifts": 0,
        "cells": math.prod(grid.shape),
        "parts": len(grid.parts),
    }
    if to == "vti":
        progress.stage("write")
        write_atomically(target, lambda stream: write_vti(grid, stream, threads=_THREADS), inputs=[source])
    else:
        progress.stage("faces")
        bodies = _bodies(grid)
        if not bodies:
            raise InputError(f"{source}: all cells are air, there are no faces", hint="--to vti writes the cells")
        document["triangles"] = sum(len(body.mesh.faces) for body in bodies)
        progress.stage("write")
        write_atomically(target, _surface(grid, bodies, to), inputs=[source])
    progress.finish()
    return {**document, "seconds": progress.seconds}


def _bodies(grid: VoxelGrid) -> list[ColouredBody]:
    """Return the faces of every part that meets a cell, in its colour."""
    from bimvox.bim.building import TriangleMesh
    from bimvox.export.mesh import ColouredBody
    from bimvox.grid.faces import outer_faces
    from bimvox.rendering.scene.grid import part_colours

    colours = part_colours(grid)
    bodies = []
    for faces in outer_faces(grid):
        part = grid.parts[faces.part]
        if not len(faces.quads):
            continue
        red, green, blue = (int(n) for n in colours[faces.part])
        properties = {
            "global_id": part.global_id,
            "ifc_class": part.ifc_class,
            "name": part.name,
            "role": part.role,
            "storey": part.storey,
            "material": part.material,
            "cells": part.cells,
            "solid_volume_m3": part.solid_volume_m3,
            "mass_kg": part.mass_kg,
        }
        mesh = TriangleMesh(grid.frame.corner_of(faces.corners), faces.triangles)
        known = {key: value for key, value in properties.items() if value is not None}
        bodies.append(ColouredBody(part.id, mesh, (red, green, blue), known))
    return bodies


def _surface(grid: VoxelGrid, bodies: list[ColouredBody], to: str) -> bytes:
    """Return the bodies as a file that says where they stand in the source's coordinates."""
    from bimvox.export.mesh import to_glb, to_ply

    about = {
        "unit": "m",
        "voxel_size_m": grid.frame.voxel_size_m,
        "source": dict(grid.source),
        "source_origin_m": list(grid.origin_m),
        "georeference": dict(grid.georeference),
    }
    if to == "glb":
        return to_glb(bodies, about)
    x, y, z = grid.origin_m
    comments = [
        f"bimvox, cells of {grid.frame.voxel_size_m:g} m of {grid.source.get('name', 'a grid')}, metres, z up",
        f"source coordinates: add {x!r} {y!r} {z!r}",
        *(f"georeference {key} {value}" for key, value in sorted(grid.georeference.items())),
    ]
    return to_ply(bodies, comments)
