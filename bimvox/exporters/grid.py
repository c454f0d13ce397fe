"""The outer faces of a grid's parts as PLY and GLB; its cells are in ``vti``."""

from __future__ import annotations

from collections.abc import Sequence

from bimvox.bim.building import TriangleMesh
from bimvox.exporters.mesh import ColouredBody, to_glb, to_ply
from bimvox.grid.voxel_grid import Part, VoxelGrid, outer_faces
from bimvox.rendering.scene.grid import part_colours


def part_bodies(grid: VoxelGrid) -> list[ColouredBody]:
    """Return the outer faces of every part that meets a cell, in its colour, in the grid's metres."""
    colours = part_colours(grid)
    bodies = []
    for faces in outer_faces(grid):
        if not len(faces.quads):
            continue
        part = grid.parts[faces.part]
        red, green, blue = (int(n) for n in colours[faces.part])
        mesh = TriangleMesh(grid.frame.corner_of(faces.corners), faces.triangles)
        bodies.append(ColouredBody(part.id, mesh, (red, green, blue), _properties(part)))
    return bodies


def surface_bytes(grid: VoxelGrid, bodies: Sequence[ColouredBody], format_name: str) -> bytes:
    """Return the bodies as ``ply`` or ``glb``, with the offset to the source's coordinates in the header."""
    if format_name == "glb":
        about = {
            "unit": "m",
            "voxel_size_m": grid.frame.voxel_size_m,
            "source": dict(grid.source),
            "source_origin_m": list(grid.origin_m),
            "georeference": dict(grid.georeference),
        }
        return to_glb(bodies, about)
    x, y, z = grid.origin_m
    comments = [
        f"bimvox, cells of {grid.frame.voxel_size_m:g} m of {grid.source.get('name', 'a grid')}, metres, z up",
        f"source coordinates: add {x!r} {y!r} {z!r}",
        *(f"georeference {key} {value}" for key, value in sorted(grid.georeference.items())),
    ]
    return to_ply(bodies, comments)


def _properties(part: Part) -> dict[str, str | float]:
    values = {
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
    return {key: value for key, value in values.items() if value is not None}
