"""Read PLY, text and binary of either byte order: vertices and polygons. It states neither unit nor up.

Reads ``vertex`` (``x y z``), ``face`` (``vertex_indices`` or ``vertex_index``) and ``tristrips``. Ignores colours,
normals, texture coordinates and other elements.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.mesh.contents import MeshContents, RawBody, body_of_polygons, damaged, numbers
from bimvox.bim.mesh.stl_obj_off import single_rounding
from bimvox.errors import MeshError

_HEADER_MOST = 1 << 20
_TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4"},
    **{"double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"},
    **{"int64": "i8", "uint64": "u8", "float16": "f2", "float32": "f4", "float64": "f8"},
}
_ORDER = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}
_CORNERS = ("vertex_indices", "vertex_index")

Columns = dict[str, Any]
"""By property: an (n,) array; for lists of equal length an (n, k) array, otherwise a list of arrays."""


@dataclass(frozen=True, slots=True)
class _PlyProperty:
    """A property: ``type`` of its value and, if it is a list, of its count, as numpy type strings."""

    name: str
    type: str
    count_type: str | None


@dataclass(frozen=True, slots=True)
class _PlyElement:
    """An element that a header declares."""

    name: str
    count: int
    properties: tuple[_PlyProperty, ...]

    @property
    def lists(self) -> int:
        """Number of properties that are lists."""
        return sum(item.count_type is not None for item in self.properties)


def read_ply(path: Path, data: bytes) -> MeshContents:
    """Return the contents of a PLY file: one unnamed triangle soup.

    Raises:
        MeshError: If it is truncated, or not PLY.
    """
    is_text, elements, start = ply_header(path, data)
    if not is_text:
        read, _ = _elements(path, data, start, elements, is_text=False)
    else:
        text = data[start:].decode("latin-1")
        body = numbers(path, text, "its body")
        try:
            read, end = _elements(path, body, 0, elements, is_text=True)
        except MeshError:
            end = -1
        if end != len(body):
            # Some exporters write more values into a line than the header declares: the rest is ignored.
            read, _ = _elements(path, _announced(path, text, elements), 0, elements, is_text=True)
    vertex = read.get("vertex", {})
    if any(axis not in vertex for axis in "xyz"):
        raise MeshError(path, "has no vertices with x, y and z", hint="export it as a triangle mesh")
    vertices = np.stack([np.asarray(vertex[axis], dtype=np.float64) for axis in "xyz"], axis=1)
    polygons = _polygons(read)
    if not len(polygons):
        return MeshContents((), left_out=(("", f"{len(vertices):,} points"),) if len(vertices) else ())
    soup = body_of_polygons("", vertices, polygons)
    of_x = next(item.type for element in elements if element.name == "vertex" for item in element.properties)
    rounding = single_rounding(vertices) if not is_text and of_x.endswith(("f4", "f2")) else 0.0
    return MeshContents((RawBody("", soup.vertices, soup.faces, rounding),))


def ply_header(path: Path, data: bytes) -> tuple[bool, list[_PlyElement], int]:
    """Return whether the body is text, the elements, and the offset of the body."""
    head, mark, _ = data[:_HEADER_MOST].partition(b"end_header")
    if not head.startswith(b"ply") or not mark:
        raise damaged(path, "is not a PLY file, or its header is incomplete")
    newline = data.find(b"\n", len(head))
    # Very old files end their lines with only a carriage return.
    start = 1 + (newline if newline >= 0 and b"\n" in head else data.find(b"\r", len(head)))
    order: str | None = None
    elements: list[_PlyElement] = []
    for line in head.decode("latin-1").replace("\r", "\n").split("\n")[1:]:
        words = line.split()
        try:
            if words[:1] == ["format"]:
                order = _ORDER[words[1]]
            elif words[:1] == ["element"]:
                elements.append(_PlyElement(words[1], int(words[2]), ()))
            elif words[:1] == ["property"]:
                last = elements[-1]
                types = [(order or "=") + _TYPES[word] for word in words[2 if words[1] == "list" else 1 : -1]]
                item = _PlyProperty(words[-1], types[-1], types[0] if words[1] == "list" else None)
                elements[-1] = _PlyElement(last.name, last.count, (*last.properties, item))
        except (KeyError, IndexError, ValueError):
            raise damaged(path, f"header: {line.strip()[:60]!r} is not understood") from None
    if order is None or start == 0 or any(element.count < 0 for element in elements):
        raise damaged(path, "its header states no format, or a count below zero")
    return order == "=", elements, start


def _elements(
    path: Path, body: Any, at: int, elements: list[_PlyElement], *, is_text: bool
) -> tuple[dict[str, Columns], int]:
    """Return the values of all elements, and where they end."""
    read: dict[str, Columns] = {}
    for element in elements:
        columns, at = _columns(path, body, at, element, is_text)
        read.setdefault(element.name, columns)
    return read, at


def _announced(path: Path, text: str, elements: list[_PlyElement]) -> NDArray[np.float64]:
    """Return the numbers of a text; of every line only those that the header declares."""
    lines = (line.split() for line in text.splitlines() if line.strip())
    kept: list[str] = []
    for element in elements:
        for row in range(element.count if element.properties else 0):
            words, used = next(lines, []), 0
            for item in element.properties:
                length = 1
                if item.count_type is not None:
                    length = 1 + (int(float(words[used])) if used < len(words) else 0)
                used += max(length, 1)
            if used > len(words):
                raise damaged(path, f"is truncated or damaged in row {row:,} of {element.count:,} of {element.name!r}")
            kept += words[:used]
    return numbers(path, " ".join(kept), "its body")


def _columns(path: Path, body: Any, at: int, element: _PlyElement, is_text: bool) -> tuple[Columns, int]:
    """Return the values of an element from ``body`` (bytes, or numbers of a text), and where the next one begins."""
    if not element.count or not element.properties:
        return {item.name: np.zeros(0) for item in element.properties}, at
    least = sum(_size(item.count_type or item.type, is_text) for item in element.properties)
    if element.count * least > len(body) - at:
        raise damaged(path, f"declares {element.count:,} of {element.name!r}, but the file is too short for them")
    even = _even(body, at, element, is_text)
    return even if even is not None else _uneven(path, body, at, element, is_text)


def _size(kind: str, is_text: bool) -> int:
    return 1 if is_text else np.dtype(kind).itemsize


def _value(body: Any, at: int, kind: str, is_text: bool) -> float:
    return float(body[at] if is_text else np.frombuffer(body, kind, 1, at)[0])


def _even(body: Any, at: int, element: _PlyElement, is_text: bool) -> tuple[Columns, int] | None:
    """Return an element read at once, and where it ends; None if its lists differ in length from the first row's."""
    lengths, here = [], at
    for item in element.properties:
        length = 1
        if item.count_type is not None:
            if here + _size(item.count_type, is_text) > len(body):
                return None
            first = _value(body, here, item.count_type, is_text)
            if not 0 <= first <= len(body):
                return None
            length = int(first)
            here += _size(item.count_type, is_text)
        lengths.append(length)
        here += length * _size(item.type, is_text)
    if element.count * (here - at) > len(body) - at:
        return None
    end = at + element.count * (here - at)
    columns: Columns = {}
    if is_text:
        table, column = body[at:end].reshape(element.count, -1), 0
        for item, length in zip(element.properties, lengths, strict=True):
            if item.count_type is not None:
                if (table[:, column] != length).any():
                    return None
                column += 1
            columns[item.name] = table[:, column : column + length] if item.count_type else table[:, column]
            column += length
        return columns, end
    fields: list[Any] = []
    for index, (item, length) in enumerate(zip(element.properties, lengths, strict=True)):
        fields += [(f"n{index}", item.count_type)] if item.count_type else []
        fields.append((f"v{index}", item.type, (length,)) if item.count_type else (f"v{index}", item.type))
    records = np.frombuffer(body, np.dtype(fields), element.count, at)
    for index, (item, length) in enumerate(zip(element.properties, lengths, strict=True)):
        if item.count_type is not None and (records[f"n{index}"] != length).any():
            return None
        columns[item.name] = records[f"v{index}"]
    return columns, end


def _uneven(path: Path, body: Any, at: int, element: _PlyElement, is_text: bool) -> tuple[Columns, int]:
    """Return an element read row by row, because its lists differ in length, and where it ends."""
    columns: Columns = {item.name: [] for item in element.properties}
    sizes = [(item, _size(item.type, is_text)) for item in element.properties]
    for row in range(element.count):
        for item, size in sizes:
            length = 1
            try:
                if item.count_type is not None:
                    length = int(_value(body, at, item.count_type, is_text))
                    at += _size(item.count_type, is_text)
            except (ValueError, OverflowError, IndexError):
                length = -1
            if length < 0 or at + length * size > len(body):
                raise damaged(path, f"is truncated or damaged in row {row:,} of {element.count:,} of {element.name!r}")
            values = body[at : at + length] if is_text else np.frombuffer(body, item.type, length, at)
            columns[item.name].append(values)
            at += length * size
    return {
        item.name: values if item.count_type is not None else np.concatenate(values)
        for item, values in zip(element.properties, columns.values(), strict=True)
    }, at


def _polygons(read: dict[str, Columns]) -> Any:
    """Return the corners of the faces: (n, k) int64 if all have the same number, otherwise a list of lists."""
    face = read.get("face", {})
    corners = next((face[name] for name in _CORNERS if name in face), ())
    strips = next((read.get("tristrips", {})[name] for name in _CORNERS if name in read.get("tristrips", {})), ())
    if len(strips):
        return [_whole(corner) for corner in corners] + [face for strip in strips for face in _of_strip(_whole(strip))]
    if isinstance(corners, np.ndarray) and corners.ndim == 2:
        return np.array(_whole_array(corners)) if corners.shape[1] >= 3 else ()
    return [_whole(corner) for corner in corners]


def _whole_array(corners: NDArray[Any]) -> NDArray[np.int64]:
    """Return corners as integers; -1 for invalid ones."""
    wide: NDArray[np.float64] = np.asarray(corners, dtype=np.float64)
    usable = (wide >= 0) & (wide < 2.0**53)
    return np.where(usable, np.where(usable, wide, 0), -1).astype(np.int64)


def _whole(corners: NDArray[Any]) -> list[int]:
    result: list[int] = _whole_array(np.atleast_1d(corners)).tolist()
    return result


def _of_strip(strip: list[int]) -> list[list[int]]:
    """Return the triangles of strips separated by -1; every second one is reversed."""
    faces, start = [], 0
    for index, corner in enumerate(strip):
        if corner < 0:
            start = index + 1
        elif index >= start + 2:
            a, b, c = strip[index - 2], strip[index - 1], corner
            faces.append([a, b, c] if (index - start) % 2 == 0 else [b, a, c])
    return faces
