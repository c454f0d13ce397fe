"""Read glTF 2.0, binary and text: each node with a mesh is a body. The standard fixes metres and y up."""

from __future__ import annotations

import base64
import binascii
import json
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.mesh.contents import REPEATED_MOST, MeshContents, RawBody, damaged
from bimvox.bim.mesh.stl_obj_off import single_rounding
from bimvox.errors import MeshError, cut, shown
from bimvox.files import read_input, resolved

_MAGIC, _JSON, _BIN = b"glTF", b"JSON", b"BIN\0"
_COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}


class _GltfData:
    """A glTF file: its JSON, and arrays from its buffers.

    Args:
        path: The file; external buffers are only read from its folder and below.
        data: Its bytes, GLB or JSON.

    Raises:
        MeshError: If it is not glTF 2.0, or truncated.
    """

    def __init__(self, path: Path, data: bytes) -> None:
        self.path = path
        self._binary: bytes | None = None
        self._buffers: dict[int, bytes] = {}
        self._lists: dict[str, list[dict[str, Any]]] = {}
        self.external: list[bytes] = []
        """Contents of the external buffers."""
        self.json = self._parsed(self._glb(data) if data.startswith(_MAGIC) else data)
        version = str(self._of(self.json, "asset", dict).get("version", ""))
        if not version.startswith("2"):
            raise MeshError(path, f"is glTF {cut(version) or 'without version'}, not 2.0", hint="export it as glTF 2.0")

    def items(self, key: str) -> list[dict[str, Any]]:
        """Return one of the file's lists of objects; empty if the file does not have it."""
        if key not in self._lists:
            found = self.json.get(key, [])
            if not isinstance(found, list) or not all(isinstance(item, dict) for item in found):
                raise damaged(self.path, f"{key} is not a list of objects")
            self._lists[key] = found
        return self._lists[key]

    def item(self, key: str, index: Any) -> dict[str, Any]:
        """Return one object of a list."""
        items = self.items(key)
        if not isinstance(index, int) or isinstance(index, bool) or not 0 <= index < len(items):
            raise damaged(self.path, f"{key}[{shown(index)}] is referenced, but there are only {len(items)}")
        return items[index]

    def array(self, index: Any, kind: str) -> NDArray[np.float64] | NDArray[np.int64]:
        """Return the numbers of an accessor.

        Args:
            index: Of the accessor.
            kind: ``VEC3`` gives (n, 3) float64, ``SCALAR`` (n,) int64.
        """
        accessor = self.item("accessors", index)
        where = f"accessors[{index}]"
        stored = _COMPONENTS.get(accessor.get("componentType", 0))
        if accessor.get("type") != kind or stored is None:
            raise damaged(self.path, f"{where} is not a {kind} of a known type")
        count, width = self._count(accessor, "count", where), _WIDTHS[kind]
        if "bufferView" in accessor:
            values = self._view(
                accessor["bufferView"], self._count(accessor, "byteOffset", where), count, width, stored
            )
        elif "sparse" in accessor and count <= len(self._view_bytes(accessor["sparse"], where)):
            values = np.zeros((count, width), dtype=stored)
        else:
            raise damaged(self.path, f"{where}: its numbers are not in the file")
        if "sparse" in accessor:
            values = self._with_sparse(values, accessor["sparse"], where)
        if kind == "SCALAR":
            return values.reshape(-1).astype(np.int64)
        wide: NDArray[np.float64] = values.astype(np.float64)
        if accessor.get("normalized") and stored != "<f4":
            wide = np.maximum(wide / np.iinfo(stored).max, -1.0)
        return wide

    def _with_sparse(self, values: NDArray[Any], sparse: Any, where: str) -> NDArray[Any]:
        """Return the values with those of a sparse accessor in place."""
        where += ".sparse"
        places, news = (self._of(self._object(sparse, where), key, dict) for key in ("indices", "values"))
        count = self._count(sparse, "count", where)
        stored = _COMPONENTS.get(places.get("componentType", 0))
        if stored not in ("<u1", "<u2", "<u4"):
            raise damaged(self.path, f"{where}: its indices have an unknown type")
        offsets = [self._count(part, "byteOffset", where) for part in (places, news)]
        at = self._view(places.get("bufferView"), offsets[0], count, 1, stored).reshape(-1)
        if count and int(at.max()) >= len(values):
            raise damaged(self.path, f"{where}: an index is out of range")
        replaced = values.copy()
        replaced[at] = self._view(news.get("bufferView"), offsets[1], count, values.shape[1], values.dtype.str)
        return replaced

    def _view_bytes(self, sparse: Any, where: str) -> bytes:
        """Return the buffer that a sparse accessor reads: its size limits how many zeros are allocated."""
        values = self._of(self._object(sparse, where), "values", dict)
        view = self.item("bufferViews", values.get("bufferView"))
        return self._buffer(view.get("buffer"))

    def _view(self, index: Any, offset: int, count: int, width: int, stored: str) -> NDArray[Any]:
        """Return (count, width) numbers of a buffer view, without a copy."""
        view, where = self.item("bufferViews", index), f"bufferViews[{index}]"
        content = self._buffer(view.get("buffer"))
        start, length = self._count(view, "byteOffset", where), self._count(view, "byteLength", where)
        row = width * np.dtype(stored).itemsize
        stride = self._count(view, "byteStride", where) or row
        needed = offset + (count - 1) * stride + row if count else 0
        if start + length > len(content) or needed > length or stride < row:
            raise damaged(self.path, f"{where} reaches beyond its buffer, or is used beyond its end")
        if not count:
            return np.zeros((0, width), dtype=stored)
        return np.ndarray((count, width), stored, content, start + offset, (stride, np.dtype(stored).itemsize))

    def _buffer(self, index: Any) -> bytes:
        """Return a buffer: the binary chunk, a data URI, or an external file."""
        buffer = self.item("buffers", index)
        if index not in self._buffers:
            uri, where = buffer.get("uri"), f"buffers[{index}]"
            if uri is None:
                if index != 0 or self._binary is None:
                    raise damaged(self.path, f"{where} has no data")
                content = self._binary
            elif isinstance(uri, str) and uri.startswith("data:"):
                content = self._inline(uri, where)
            else:
                content = self._external(str(uri), where)
            needed = self._count(buffer, "byteLength", where)
            if len(content) < needed:
                raise damaged(self.path, f"{where} should have {needed:,} bytes but has {len(content):,}")
            self._buffers[index] = content
        return self._buffers[index]

    def _inline(self, uri: str, where: str) -> bytes:
        kind, _, coded = uri.partition(",")
        if not kind.endswith(";base64"):
            raise damaged(self.path, f"{where}: its data URI is not base64")
        try:
            return base64.b64decode(coded)
        except (binascii.Error, ValueError) as error:
            raise damaged(self.path, f"{where}: its data URI cannot be read ({error})") from error

    def _external(self, uri: str, where: str) -> bytes:
        """Return the contents of an external buffer, which must be in this file's folder or below."""
        folder = resolved(self.path).parent
        place = resolved(folder / unquote(uri), partial(self._unreadable, where=where, uri=uri))
        if not place.is_relative_to(folder):
            raise MeshError(
                self.path, f"{where}: {uri[:200]!r} is not in the file's folder", hint="put all its files in one folder"
            )
        self.external.append(read_input(place, partial(self._unreadable, where=where, uri=uri)))
        return self.external[-1]

    def _unreadable(self, _place: Path, message: str, *, hint: str, where: str, uri: str) -> MeshError:
        """Return the error about the file of a buffer."""
        why = " is missing" if message.endswith("no such file") else f": {message}"
        return MeshError(self.path, f"{where}: its file {uri[:200]!r}{why}", hint=f"{hint}, or export a GLB")

    def _glb(self, data: bytes) -> bytes:
        """Return the JSON chunk of a GLB; store the binary one."""
        chunks: dict[bytes, bytes] = {}
        version, length = (int.from_bytes(data[at : at + 4], "little") for at in (4, 8))
        if version != 2:
            raise MeshError(self.path, f"is binary glTF {version}, not 2", hint="export it as glTF 2.0")
        if length > len(data):
            raise damaged(self.path, f"is truncated: {len(data):,} of {length:,} bytes")
        at = 12
        while at + 8 <= length:
            size, kind = int.from_bytes(data[at : at + 4], "little"), data[at + 4 : at + 8]
            if at + 8 + size > length:
                raise damaged(self.path, "a chunk reaches beyond the end of the file")
            chunks.setdefault(kind, data[at + 8 : at + 8 + size])
            at += 8 + size
        self._binary = chunks.get(_BIN)
        if _JSON not in chunks:
            raise damaged(self.path, "has no JSON chunk")
        return chunks[_JSON]

    def _parsed(self, text: bytes) -> dict[str, Any]:
        try:
            found = json.loads(text.decode("utf-8-sig"))
        except (ValueError, RecursionError) as error:
            raise damaged(self.path, f"its JSON cannot be read ({error})") from error
        return self._object(found, "the JSON")

    def _object(self, value: Any, where: str) -> dict[str, Any]:
        if not isinstance(value, dict):
            raise damaged(self.path, f"{where} is not an object")
        return value

    def _of(self, value: dict[str, Any], key: str, kind: type) -> Any:
        result = value.get(key, kind())
        if not isinstance(result, kind):
            raise damaged(self.path, f"{key} has the wrong type")
        return result

    def _count(self, value: dict[str, Any], key: str, where: str) -> int:
        """Return an integer of at least 0; 0 if it is left out."""
        result = value.get(key, 0)
        if not isinstance(result, int) or isinstance(result, bool) or not 0 <= result < 2**48:
            raise damaged(self.path, f"{where}.{key} is not a count: a whole number from 0 up")
        return result


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
    return _Reader(_GltfData(path, data)).contents()


class _Reader:
    def __init__(self, file: _GltfData) -> None:
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
