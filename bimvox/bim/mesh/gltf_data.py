"""The container of glTF 2.0: JSON, buffers and the numbers in them (glTF 2.0 specification, section 3.6)."""

from __future__ import annotations

import base64
import binascii
import json
from functools import partial
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.mesh.contents import damaged
from bimvox.errors import MeshError, cut, shown
from bimvox.files import read_input, resolved

_MAGIC, _JSON, _BIN = b"glTF", b"JSON", b"BIN\0"
_COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}


class GltfData:
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
        found = value.get(key, kind())
        if not isinstance(found, kind):
            raise damaged(self.path, f"{key} has the wrong type")
        return found

    def _count(self, value: dict[str, Any], key: str, where: str) -> int:
        """Return an integer of at least 0; 0 if it is left out."""
        found = value.get(key, 0)
        if not isinstance(found, int) or isinstance(found, bool) or not 0 <= found < 2**48:
            raise damaged(self.path, f"{where}.{key} is not a count: a whole number from 0 up")
        return found
