"""Read glTF 2.0, binary and text: each node with a mesh is a body. The standard fixes metres and y up."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.mesh.contents import REPEATED_MOST, MeshContents, RawBody, damaged
from bimvox.bim.mesh.gltf_data import GltfData
from bimvox.bim.mesh.stl import single_rounding
from bimvox.errors import MeshError

_POINTS, _TRIANGLES, _STRIP, _FAN = 0, 4, 5, 6
_HARMLESS = (
    *("KHR_materials_", "KHR_texture_", "EXT_texture_", "MSFT_texture_", "KHR_lights_", "EXT_lights_", "KHR_xmp"),
    *("KHR_mesh_quantization", "KHR_animation_", "EXT_mesh_features", "EXT_structural_metadata"),
)
"""Prefixes of extensions that do not change a shape, or that are read."""
_PACKED = {
    "KHR_draco_mesh_compression": "Draco",
    "EXT_meshopt_compression": "meshopt",
    "KHR_meshopt_compression": "meshopt",
}

_Shape = tuple[NDArray[np.float64], NDArray[np.int32]]


def read_gltf(path: Path, data: bytes) -> MeshContents:
    """Return the bodies of a glTF file: one per node with a mesh, named after the node, otherwise its mesh or number.

    Skins, morph targets and animations are ignored: a body is as it was modelled.

    Raises:
        MeshError: If it is damaged, or needs an unknown extension.
    """
    return _Reader(GltfData(path, data)).contents()


class _Reader:
    def __init__(self, file: GltfData) -> None:
        self._file = file
        self._shapes: dict[int, _Shape | None] = {}
        self._size = 0
        self._bodies: list[RawBody] = []
        self._left_out: list[tuple[str, str]] = []
        self._named = False

    def contents(self) -> MeshContents:
        required = self._file.json.get("extensionsRequired", [])
        for name in required if isinstance(required, list) else ():
            if not str(name).startswith(_HARMLESS):
                packing = _PACKED.get(str(name))
                what = f"is compressed with {packing}" if packing else "needs an extension"
                raise MeshError(self._file.path, f"{what} ({name}), which is not read", hint="export it without")
        seen: set[int] = set()
        todo = [(root, np.eye(4)) for root in reversed(self._roots())]
        while todo:
            index, parent_to_world = todo.pop()
            node = self._file.item("nodes", index)
            if index in seen:
                raise damaged(self._file.path, f"nodes[{index}] has two parents, or is its own parent")
            seen.add(index)
            to_world = parent_to_world @ self._placement(node, index)
            if "mesh" in node:
                self._place(index, node, to_world)
            todo += [(child, to_world) for child in reversed(_children(node))]
        if len(self._bodies) == 1 and not self._named:
            self._bodies = [replace(self._bodies[0], name="")]
        return MeshContents(
            tuple(self._bodies), "m", "y", left_out=tuple(self._left_out), external=tuple(self._file.external)
        )

    def _roots(self) -> list[Any]:
        """Return the root nodes of the default scene; all root nodes if the file has no scene."""
        if self._file.items("scenes"):
            roots = self._file.item("scenes", self._file.json.get("scene", 0)).get("nodes", [])
            return roots if isinstance(roots, list) else []
        nodes = self._file.items("nodes")
        children = {child for node in nodes for child in _children(node) if isinstance(child, int)}
        return [index for index in range(len(nodes)) if index not in children]

    def _placement(self, node: dict[str, Any], index: int) -> NDArray[np.float64]:
        """Return the (4, 4) node-to-parent transform."""
        placement = np.eye(4)
        try:
            if "matrix" in node:
                return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
            x, y, z, w = (float(part) for part in node.get("rotation", (0.0, 0.0, 0.0, 1.0)))
            turn = [
                [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
            ]
            scale = np.array(node.get("scale", (1.0, 1.0, 1.0)), dtype=np.float64).reshape(3)
            placement[:3, :3] = np.array(turn) * scale
            placement[:3, 3] = np.array(node.get("translation", (0.0, 0.0, 0.0)), dtype=np.float64).reshape(3)
        except (TypeError, ValueError, OverflowError):
            raise damaged(self._file.path, f"nodes[{index}]: its placement is damaged") from None
        return placement

    def _place(self, index: int, node: dict[str, Any], to_world: NDArray[np.float64]) -> None:
        """Add the body of a node."""
        if "EXT_mesh_gpu_instancing" in (node.get("extensions") or ()):
            raise MeshError(
                self._file.path,
                f"nodes[{index}] is repeated by EXT_mesh_gpu_instancing, which is not read",
                hint="export it without that extension",
            )
        mesh_index = node["mesh"]
        mesh = self._file.item("meshes", mesh_index)
        stated = str(node.get("name") or mesh.get("name") or "")
        name = stated or f"node-{index}"
        self._named |= bool(stated)
        if mesh_index not in self._shapes:
            self._shapes[mesh_index] = self._shape(mesh_index, mesh)
        shape = self._shapes[mesh_index]
        if shape is None:
            self._left_out.append((name, "points or lines"))
            return
        vertices, faces = shape
        self._size += max(len(vertices), len(faces))
        if self._size > REPEATED_MOST:
            raise MeshError(
                self._file.path, f"repeats its meshes into more than {REPEATED_MOST:,} triangles", hint="split it"
            )
        with np.errstate(invalid="ignore", over="ignore"):
            placed = vertices @ to_world[:3, :3].T + to_world[:3, 3] + 0.0
            if np.linalg.det(to_world[:3, :3]) < 0:
                faces = np.ascontiguousarray(faces[:, ::-1])
            growth = float(np.abs(to_world[:3, :3]).max())
        self._bodies.append(RawBody(name, placed, faces, single_rounding(vertices) * growth))

    def _shape(self, index: int, mesh: dict[str, Any]) -> _Shape | None:
        """Return the triangles of a mesh; None if it has only points and lines."""
        primitives = mesh.get("primitives", [])
        if not isinstance(primitives, list) or not all(isinstance(item, dict) for item in primitives):
            raise damaged(self._file.path, f"meshes[{index}]: its primitives are damaged")
        vertices: list[NDArray[np.float64]] = []
        faces: list[NDArray[np.int64]] = []
        for primitive in primitives:
            mode = primitive.get("mode", _TRIANGLES)
            attributes = primitive.get("attributes")
            if mode not in (_TRIANGLES, _STRIP, _FAN) or not isinstance(attributes, dict):
                continue
            accessor = self._file.item("accessors", attributes.get("POSITION"))
            packing = [_PACKED[name] for name in primitive.get("extensions") or () if name in _PACKED]
            if packing and "bufferView" not in accessor:
                raise MeshError(
                    self._file.path, f"is compressed with {packing[0]}, which is not read", hint="export it without"
                )
            positions = np.asarray(self._file.array(attributes["POSITION"], "VEC3"), dtype=np.float64)
            if "indices" in primitive:
                order = np.asarray(self._file.array(primitive["indices"], "SCALAR"), dtype=np.int64)
            else:
                order = np.arange(len(positions), dtype=np.int64)
            shift = sum(len(part) for part in vertices)
            order = np.where(order < len(positions), order, -1 - shift)
            vertices.append(positions)
            faces.append(_triangles(order, mode) + shift)
        if not faces:
            return None
        return np.concatenate(vertices), np.concatenate(faces).astype(np.int32)


def _children(node: dict[str, Any]) -> list[Any]:
    children = node.get("children")
    return children if isinstance(children, list) else []


def _triangles(order: NDArray[np.int64], mode: int) -> NDArray[np.int64]:
    """Return (F, 3) corners of a list, strip or fan; an incomplete triangle at the end is ignored."""
    if mode == _TRIANGLES:
        return order[: len(order) // 3 * 3].reshape(-1, 3)
    count = max(len(order) - 2, 0)
    if mode == _FAN:
        return np.stack([np.full(count, order[0] if count else 0), order[1 : 1 + count], order[2 : 2 + count]], axis=1)
    strip = np.stack([order[:count], order[1 : 1 + count], order[2 : 2 + count]], axis=1)
    strip[1::2] = strip[1::2, [1, 0, 2]]
    return strip
