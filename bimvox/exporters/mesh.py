"""Coloured bodies as GLB and PLY, for viewers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh


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

    Args:
        bodies: At least one, each with triangles.
        properties: Plain values about the scene, as its ``extras``.
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

    Args:
        bodies: At least one, each with triangles.
        comments: Lines for the header, before the names of the bodies.
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
