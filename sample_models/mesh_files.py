"""Writers of STL and GLB; deterministic."""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

_ARRAY_BUFFER, _ELEMENT_BUFFER = 34962, 34963
_FLOAT, _UINT = 5126, 5125


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """One named body.

    Attributes:
        name: Its name.
        mesh: Name of its mesh; bodies with the same mesh have the same geometry and differ only by ``at_m``.
        vertices_m: (V, 3) float64, z up, relative to ``at_m``.
        faces: (F, 3) int32, counter-clockwise seen from outside.
        at_m: Its position.
    """

    name: str
    mesh: str
    vertices_m: NDArray[np.float64]
    faces: NDArray[np.int32]
    at_m: tuple[float, float, float] = (0.0, 0.0, 0.0)


def stl_text(bodies: Sequence[Body]) -> bytes:
    """Return an ASCII STL with one named solid per body; metres, z up."""
    lines = []
    for body in bodies:
        # A tenth of a millimetre; adding 0.0 turns -0.0 into 0.0.
        corners = np.round(body.vertices_m + np.array(body.at_m), 4)[body.faces] + 0.0
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals = np.round(normals / np.linalg.norm(normals, axis=1, keepdims=True), 4) + 0.0
        lines.append(f"solid {body.name}")
        for normal, triangle in zip(normals.tolist(), corners.tolist(), strict=True):
            lines.append(f"facet normal {_triple(normal)}\nouter loop")
            lines += [f"vertex {_triple(corner)}" for corner in triangle]
            lines.append("endloop\nendfacet")
        lines.append(f"endsolid {body.name}")
    return ("\n".join(lines) + "\n").encode("ascii")


def glb_bytes(bodies: Sequence[Body]) -> bytes:
    """Return a binary glTF 2.0 with one named node per body; metres, y up as in the standard.

    z up becomes y up by a quarter turn about x: (x, y, z) -> (x, z, -y).
    """
    buffer = bytearray()
    views: list[dict[str, Any]] = []
    accessors: list[dict[str, Any]] = []
    meshes: list[dict[str, Any]] = []
    index: dict[str, int] = {}
    nodes = []
    for body in bodies:
        if body.mesh not in index:
            index[body.mesh] = len(meshes)
            position = _accessor(buffer, views, accessors, _y_up(body.vertices_m).astype("<f4"), _ARRAY_BUFFER)
            corners = _accessor(buffer, views, accessors, body.faces.astype("<u4").reshape(-1), _ELEMENT_BUFFER)
            primitive = {"attributes": {"POSITION": position}, "indices": corners}
            meshes.append({"name": body.mesh, "primitives": [primitive]})
        node: dict[str, Any] = {"name": body.name, "mesh": index[body.mesh]}
        if any(body.at_m):
            node["translation"] = _y_up(np.array([body.at_m]))[0].tolist()
        nodes.append(node)
    document = {
        "asset": {"version": "2.0", "generator": "bimvox sample_models"},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(nodes)))}],
        "nodes": nodes,
        "meshes": meshes,
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(buffer)}],
    }
    text = json.dumps(document, separators=(",", ":")).encode("ascii")
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
    chunks += struct.pack("<II", len(buffer), 0x004E4942) + bytes(buffer)
    return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks


def _accessor(
    buffer: bytearray, views: list[dict[str, Any]], accessors: list[dict[str, Any]], array: NDArray[Any], target: int
) -> int:
    """Append an array of 4-byte numbers to the buffer and return the index of its accessor."""
    raw = array.tobytes()
    views.append({"buffer": 0, "byteOffset": len(buffer), "byteLength": len(raw), "target": target})
    buffer.extend(raw)
    accessor: dict[str, Any] = {"bufferView": len(views) - 1, "count": len(array)}
    if target == _ARRAY_BUFFER:
        accessor |= {"componentType": _FLOAT, "type": "VEC3"}
        accessor |= {"min": array.min(axis=0).tolist(), "max": array.max(axis=0).tolist()}
    else:
        accessor |= {"componentType": _UINT, "type": "SCALAR"}
    accessors.append(accessor)
    return len(accessors) - 1


def _y_up(points_m: NDArray[np.float64]) -> NDArray[np.float64]:
    turned: NDArray[np.float64] = np.stack([points_m[:, 0], points_m[:, 2], -points_m[:, 1]], axis=1) + 0.0
    return turned


def _triple(values: Sequence[float]) -> str:
    return " ".join(f"{value:.4f}" for value in values)
