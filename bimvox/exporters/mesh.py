"""Coloured bodies as GLB and PLY, for viewers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.grid.voxel_grid import Part, VoxelGrid, outer_faces
from bimvox.rendering.pictures.site import part_colours


@dataclass(frozen=True, slots=True, eq=False)
class ColouredBody:
    """One body to write.

    Attributes:
        name: Unique among the bodies of a file.
        mesh: Its triangles, metres, z up.
        rgb: Its colour, sRGB, 0..255.
        properties: Plain values about it.
    """

    name: str
    mesh: TriangleMesh
    rgb: tuple[int, int, int]
    properties: Mapping[str, Any] = field(default_factory=dict)


def to_glb(bodies: Sequence[ColouredBody], properties: Mapping[str, Any]) -> bytes:
    """Return binary glTF 2.0: a node for every body, by its name, in metres, y up.

    ``properties``: plain values about the scene, as its ``extras``. At least one body; each has triangles.
    """
    import trimesh
    from trimesh.visual.material import PBRMaterial

    materials = {
        rgb: PBRMaterial(
            name="{:02x}{:02x}{:02x}".format(*rgb),
            baseColorFactor=linear_rgba(rgb),
            metallicFactor=0.0,
            roughnessFactor=0.9,
        )
        for rgb in sorted({body.rgb for body in bodies})
    }
    scene = trimesh.Scene(metadata=dict(properties))
    for body in bodies:
        x, y, z = body.mesh.vertices_m.T
        mesh = trimesh.Trimesh(
            np.column_stack([x, z, -y]),
            body.mesh.faces,
            process=False,
            validate=False,
            visual=trimesh.visual.TextureVisuals(material=materials[body.rgb]),
            metadata=dict(body.properties),
        )
        scene.add_geometry(mesh, node_name=body.name, geom_name=body.name)
    return bytes(scene.export(file_type="glb", include_normals=False))


def to_ply(bodies: Sequence[ColouredBody], comments: Sequence[str] = ()) -> bytes:
    """Return one binary PLY mesh in metres, z up: every face has its body's colour and index (``body``).

    ``comments``: lines for the header, before the names of the bodies. At least one body; each has triangles.
    """
    import trimesh

    counts = [len(body.mesh.vertices_m) for body in bodies]
    starts = np.cumsum([0, *counts[:-1]])
    faces = [body.mesh.faces + start for body, start in zip(bodies, starts, strict=True)]
    numbers = np.repeat(np.arange(len(bodies), dtype=np.int32), [len(some) for some in faces])
    colours = np.array([(*body.rgb, 255) for body in bodies], np.uint8)
    mesh = trimesh.Trimesh(
        np.concatenate([body.mesh.vertices_m for body in bodies]),
        np.concatenate(faces),
        face_colors=colours[numbers],
        face_attributes={"body": numbers},
        process=False,
        validate=False,
    )
    data = trimesh.exchange.ply.export_ply(mesh, vertex_normal=False)
    lines = [*comments, *(f"body {n} {body.name}" for n, body in enumerate(bodies))]
    head, rest = data.split(b"\n", 2)[:2], data.split(b"\n", 2)[2]
    return b"\n".join([*head, *(b"comment " + _one_line(line) for line in lines), rest])


def linear_rgba(rgb: tuple[int, int, int]) -> NDArray[np.float64]:
    """Return an sRGB colour as glTF needs it: linear, 0..1, opaque (IEC 61966-2-1)."""
    share = np.array(rgb) / 255.0
    linear = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    return np.append(linear, 1.0)


def _one_line(text: str) -> bytes:
    """Return a text as one ASCII line, as PLY headers need it."""
    return " ".join(text.split()).encode("ascii", "backslashreplace")


# The outer faces of a grid's parts as PLY and GLB; its cells are in ``vti``.


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
