"""Read 3MF: a zip of XML that states its unit; z is up. Every placed object with a mesh is a body.

Follows the core specification and the ``p:path`` references of the production extension. Ignores colours, slices, beam
lattices and supports for printing.
"""

from __future__ import annotations

import io
import zipfile
import zlib
from array import array
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from xml.parsers import expat

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.mesh.contents import REPEATED_MOST, MeshContents, RawBody, damaged
from bimvox.errors import MeshError

_UNITS = {"micron": "µm", "millimeter": "mm", "centimeter": "cm", "inch": "in", "foot": "ft", "meter": "m"}
_START_PART = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"
_XML_MOST = 1 << 29
_RATIO_MOST = 200
_DEPTH_MOST = 64
_LEAST = 100
"""Cost of placing an object in addition to its triangles, in triangles."""
_NO_NAME = "object-"

_Key = tuple[str, str]
"""Identifies an object: its part of the zip, and its id."""


_Start = Callable[[str, dict[str, str]], None]
_End = Callable[[str], None]


@dataclass(slots=True)
class _Object:
    """An object while it is read: a mesh, or a list of other objects placed in it."""

    name: str
    kind: str
    coordinates: array[float] = field(default_factory=lambda: array("d"))
    corners: array[int] = field(default_factory=lambda: array("q"))
    components: list[tuple[_Key, NDArray[np.float64]]] = field(default_factory=list)


@dataclass(slots=True)
class _Package:
    """The contents of all parts of the zip."""

    unit: str = "millimeter"
    objects: dict[_Key, _Object] = field(default_factory=dict)
    items: list[tuple[_Key, str, NDArray[np.float64]]] = field(default_factory=list)


def read_3mf(path: Path, data: bytes) -> MeshContents:
    """Return the bodies of a 3MF file.

    Raises:
        MeshError: If it is damaged, or expands beyond the limits.
    """
    package = _Package()
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            parts = {info.filename.lstrip("/").lower(): info for info in archive.infolist()}
            _check_sizes(path, parts)
            root = _root(path, archive, parts)
            todo, done = [root], set()
            while todo:
                part = todo.pop()
                if part in done:
                    continue
                done.add(part)
                if part not in parts:
                    raise damaged(path, f"its part {part!r} is missing")
                todo += _read_part(path, archive, parts[part], part, package, is_root=part == root)
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError, OSError) as error:
        raise damaged(path, f"its zip is damaged: {error}") from error
    if package.unit not in _UNITS:
        raise damaged(path, f"states the unknown unit {package.unit!r}")
    return _placed(path, package)


def _check_sizes(path: Path, parts: dict[str, zipfile.ZipInfo]) -> None:
    """Raise if the zip would expand beyond the limits, before anything is unpacked."""
    models = [info for name, info in parts.items() if name.endswith((".model", ".rels"))]
    size, packed = sum(info.file_size for info in models), sum(info.compress_size for info in models)
    if size > _XML_MOST or (size > 1 << 24 and size > _RATIO_MOST * packed):
        raise MeshError(path, f"unpacks from {packed:,} to {size:,} bytes of XML", hint="export it again, in pieces")


def _root(path: Path, archive: zipfile.ZipFile, parts: dict[str, zipfile.ZipInfo]) -> str:
    """Return the root part: the one that the package names, otherwise the usual one."""
    found: list[str] = []

    def start(tag: str, attributes: dict[str, str]) -> None:
        if tag.endswith("Relationship") and attributes.get("Type") == _START_PART:
            found.append(attributes.get("Target", "").lstrip("/").lower())

    if "_rels/.rels" in parts:
        _parse(path, archive, parts["_rels/.rels"], start, lambda tag: None)
    usual = [name for name in sorted(parts) if name.endswith(".model")]
    named = [name for name in found if name in parts]
    if not named and not usual:
        raise damaged(path, "has no 3D model")
    return named[0] if named else next((name for name in usual if name == "3d/3dmodel.model"), usual[0])


def _read_part(
    path: Path, archive: zipfile.ZipFile, info: zipfile.ZipInfo, part: str, package: _Package, *, is_root: bool
) -> list[str]:
    """Read one part into the package; return the parts that it refers to."""
    others: list[str] = []
    current: list[_Object] = []

    def reference(attributes: dict[str, str]) -> _Key:
        other = next((value for key, value in attributes.items() if key.rpartition(" ")[2] == "path"), None)
        if other is not None:
            others.append(other.lstrip("/").lower())
        return (others[-1] if other is not None else part, attributes["objectid"])

    def start(tag: str, attributes: dict[str, str]) -> None:
        kind = tag.rpartition(" ")[2]
        if kind == "vertex" and current:
            current[0].coordinates.extend((float(attributes["x"]), float(attributes["y"]), float(attributes["z"])))
        elif kind == "triangle" and current:
            corners = (int(attributes["v1"]), int(attributes["v2"]), int(attributes["v3"]))
            current[0].corners.extend(corner if 0 <= corner < 2**31 else -1 for corner in corners)
        elif kind == "model" and is_root:
            package.unit = attributes.get("unit", "millimeter")
        elif kind == "object":
            name = attributes.get("name") or attributes.get("partnumber") or f"{_NO_NAME}{attributes['id']}"
            current.append(_Object(name, attributes.get("type", "model")))
            package.objects[part, attributes["id"]] = current[0]
        elif kind == "component" and current:
            current[0].components.append((reference(attributes), _transform(attributes)))
        elif kind == "item" and is_root:
            package.items.append((reference(attributes), attributes.get("partnumber", ""), _transform(attributes)))

    def end(tag: str) -> None:
        if tag.rpartition(" ")[2] == "object":
            current.clear()

    _parse(path, archive, info, start, end)
    return others


def _parse(path: Path, archive: zipfile.ZipFile, info: zipfile.ZipInfo, start: _Start, end: _End) -> None:
    """Run the XML parser over a part, piece by piece; refuse a document type, which allows XML bombs."""

    def refuse(*_: object) -> None:
        raise damaged(path, f"{info.filename}: has a document type, which 3MF forbids")

    parser = expat.ParserCreate(namespace_separator=" ")
    parser.StartElementHandler, parser.EndElementHandler, parser.StartDoctypeDeclHandler = start, end, refuse
    try:
        with archive.open(info) as stream:
            while piece := stream.read(1 << 20):
                parser.Parse(piece)
            parser.Parse(b"", True)
    except (expat.ExpatError, KeyError, ValueError, OverflowError) as error:
        what = f"{error} is missing" if isinstance(error, KeyError) else str(error)
        raise damaged(path, f"{info.filename}: line {parser.CurrentLineNumber}: {what}") from error


def _transform(attributes: dict[str, str]) -> NDArray[np.float64]:
    """Return the (4, 4) transform; 3MF writes its first three columns, for row vectors."""
    matrix = np.eye(4)
    if "transform" in attributes:
        matrix[:3] = np.array([float(word) for word in attributes["transform"].split()]).reshape(4, 3).T
    return matrix


def _placed(path: Path, package: _Package) -> MeshContents:
    """Return a body for every mesh that the build places."""
    bodies: list[RawBody] = []
    left_out: list[tuple[str, str]] = []
    sizes: dict[_Key, int] = {}
    if sum(_size(path, package, key, sizes, 0) for key, _, _ in package.items) > REPEATED_MOST:
        raise MeshError(path, f"repeats its objects into more than {REPEATED_MOST:,} triangles", hint="split it")
    todo = [(key, name, to_world) for key, name, to_world in reversed(package.items)]
    while todo:
        key, name, to_world = todo.pop()
        item = package.objects[key]
        if item.kind in ("support", "solidsupport"):
            left_out.append((name or item.name, "a support for printing"))
            continue
        # The name of a placed assembly does not apply to its parts.
        todo += [(inner, "", to_world @ to_item) for inner, to_item in reversed(item.components)]
        if len(item.corners):
            bodies.append(_body(name or item.name, item, to_world))
    if len(bodies) == 1 and bodies[0].name.startswith(_NO_NAME):
        bodies = [replace(bodies[0], name="")]
    return MeshContents(tuple(bodies), _UNITS[package.unit], up="z", left_out=tuple(left_out))


def _size(path: Path, package: _Package, key: _Key, sizes: dict[_Key, int], depth: int) -> int:
    """Return how many triangles or vertices one placement of an object makes; ``sizes`` caches the results."""
    if key not in package.objects:
        raise damaged(path, f"object {key[1]!r} is placed but not defined")
    if depth > _DEPTH_MOST:
        raise damaged(path, f"object {key[1]!r} contains itself, or is nested too deep")
    if key not in sizes:
        item = package.objects[key]
        own = max(len(item.corners), len(item.coordinates)) // 3
        sizes[key] = _LEAST + own + sum(_size(path, package, inner, sizes, depth + 1) for inner, _ in item.components)
    return sizes[key]


def _body(name: str, item: _Object, to_world: NDArray[np.float64]) -> RawBody:
    vertices = np.array(item.coordinates, dtype=np.float64).reshape(-1, 3)
    faces = np.array(item.corners, dtype=np.int64).reshape(-1, 3).astype(np.int32)
    with np.errstate(invalid="ignore", over="ignore"):
        if not np.array_equal(to_world, np.eye(4)):
            vertices = vertices @ to_world[:3, :3].T + to_world[:3, 3]
            if np.linalg.det(to_world[:3, :3]) < 0:
                faces = np.ascontiguousarray(faces[:, ::-1])
    return RawBody(name, vertices, faces)
