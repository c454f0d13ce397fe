"""Read STL, OBJ and OFF, the formats of plain triangles and polygons. They state neither unit nor up."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.mesh.contents import (
    CORNERS_MOST,
    MeshContents,
    RawBody,
    body_of_polygons,
    damaged,
    numbers,
    rows_of_numbers,
    text_of,
    too_many_corners,
)
from bimvox.errors import MeshError

_HEADER_BYTES = 84
_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_SOLID = re.compile(r"^[ \t]*solid\b[ \t]*([^\r\n]*)", re.IGNORECASE | re.MULTILINE)
_VERTEX = re.compile(r"\bvertex\s+(\S+\s+\S+\s+\S+)", re.IGNORECASE)
_END_LOOP = re.compile(r"\bend\s*loop\b", re.IGNORECASE)
_END_SOLID = re.compile(r"\bend\s*solid\b", re.IGNORECASE)
_LARGEST = 1e37


def read_stl(path: Path, data: bytes) -> MeshContents:
    """Return the bodies of an STL file.

    A single solid is an unnamed triangle soup, whatever its title; several solids are bodies with their names.

    Raises:
        MeshError: If it is truncated, or not STL.
    """
    count = int.from_bytes(data[80:84], "little") if len(data) >= _HEADER_BYTES else -1
    if len(data) == _HEADER_BYTES + count * _RECORD.itemsize:
        return _binary(data, count)
    if data.removeprefix(b"\xef\xbb\xbf").lstrip()[:5].lower() == b"solid" and b"\0" not in data[:_HEADER_BYTES]:
        return _text(path, text_of(data))
    if 0 < count * _RECORD.itemsize < len(data) - _HEADER_BYTES:
        rest = len(data) - _HEADER_BYTES - count * _RECORD.itemsize
        contents = _binary(data, count)
        return MeshContents(contents.bodies, notes=(f"{rest:,} bytes after the last triangle were not read",))
    if count < 0:
        raise damaged(path, "is too short to be an STL file")
    raise damaged(
        path,
        f"is not an STL file, or is truncated: as binary STL it declares {count:,} triangles "
        f"({_HEADER_BYTES + count * _RECORD.itemsize:,} bytes), but it has {len(data):,} bytes",
    )


def _binary(data: bytes, count: int) -> MeshContents:
    records = np.frombuffer(data, dtype=_RECORD, count=count, offset=_HEADER_BYTES)
    vertices: NDArray[np.float64] = records["corners"].reshape(-1, 3).astype(np.float64)
    return MeshContents((RawBody("", vertices, _in_threes(len(vertices)), single_rounding(vertices)),))


def _text(path: Path, text: str) -> MeshContents:
    starts = list(_SOLID.finditer(text))
    if not starts or not _END_SOLID.search(text, starts[-1].start() + len("solid")):
        raise damaged(path, "is truncated: its last solid has no 'endsolid'")
    ends = [match.start() for match in starts[1:]] + [len(text)]
    bodies = []
    for match, end in zip(starts, ends, strict=True):
        solid = text[match.start() : end]
        name = re.split(r"\s+facet\s", match.group(1))[0].strip()
        where = f"solid {name!r}" if name else "the solid"
        found = numbers(path, " ".join(_VERTEX.findall(solid)), where)
        if len(found) != 9 * len(_END_LOOP.findall(solid)):
            raise damaged(path, f"{where}: has facets with other than three corners")
        vertices = found.reshape(-1, 3)
        if len(vertices):
            bodies.append(RawBody(name if len(starts) > 1 else "", vertices, _in_threes(len(vertices))))
    return MeshContents(tuple(bodies))


def _in_threes(count: int) -> NDArray[np.int32]:
    """Return the faces of vertices that are listed three per face."""
    return np.arange(count, dtype=np.int32).reshape(-1, 3)


def single_rounding(vertices: NDArray[np.float64]) -> float:
    """Return half the step between adjacent single-precision numbers at the largest usable coordinate."""
    usable = vertices[np.isfinite(vertices)]
    largest = np.float32(min(np.abs(usable).max(), _LARGEST)) if len(usable) else np.float32(0.0)
    return float(np.spacing(largest)) / 2 if largest else 0.0


# Read OBJ: vertices, polygons, objects and groups as text. It states neither unit nor up.
#
# Materials, normals and texture coordinates are ignored. A body is an object (``o``) if the file has several, otherwise
# a group (``g``). Without objects and groups the file is one unnamed triangle soup.

_CURVED = ("curv", "curv2", "surf")
_NO_NAME = ("", "default", "off", "(null)")

Polygons = dict[tuple[int, str, str], list[list[int]]]
"""Corners of the faces by (number of the object, its name, group)."""


def read_obj(path: Path, data: bytes) -> MeshContents:
    """Return the bodies of an OBJ file.

    Raises:
        MeshError: If it is damaged, or not OBJ.
    """
    rows: list[str] = []
    faces: Polygons = {}
    left_out = {"lines": 0, "points": 0, "curved surfaces": 0}
    key = (0, "", "")
    corners = faces.setdefault(key, [])
    text = text_of(data).replace("\\\r\n", " ").replace("\\\n", " ")
    for number, line in enumerate(text.split("\n"), 1):
        word, rest = (*line.split("#", 1)[0].split(None, 1), "", "")[:2]
        if word == "v":
            rows.append(rest)
        elif word in ("f", "fo"):
            corners.append(_obj_corners(path, number, rest, len(rows)))
        elif word in ("o", "g"):
            name = line.split(None, 1)[-1].strip() if rest else ""
            name = "" if name.lower() in _NO_NAME else name
            key = (key[0] + 1, name, "") if word == "o" else (key[0], key[1], name)
            corners = faces.setdefault(key, [])
        elif word in ("l", "p") or word in _CURVED:
            left_out[{"l": "lines", "p": "points"}.get(word, "curved surfaces")] += 1
    if not rows:
        raise MeshError(path, "has no vertices: it is empty or not OBJ", hint="check the suffix, or export it again")
    vertices = rows_of_numbers(path, rows, 3, "a vertex")
    named = _bodies({key: polygons for key, polygons in faces.items() if polygons})
    bodies: list[RawBody] = [body_of_polygons(name, vertices, polygons) for name, polygons in named]
    if not bodies and not any(left_out.values()):
        left_out["points"] = len(vertices)
    some = tuple(("", f"{count:,} {what}") for what, count in left_out.items() if count)
    return MeshContents(tuple(body for body in bodies if np.size(body.faces)), left_out=some)


def _bodies(faces: Polygons) -> list[tuple[str, list[list[int]]]]:
    """Return the faces of every body with its name."""
    objects = {(number, name) for number, name, _ in faces if name}
    if len(objects) == 1 and len({group for _, _, group in faces}) == 1:
        return [(name, polygons) for (_, name, _), polygons in faces.items()]
    by_object = len(objects) > 1
    bodies: dict[tuple[int, str], list[list[int]]] = {}
    for (number, name, group), polygons in faces.items():
        body = (number, name) if by_object else (0, group or name)
        bodies.setdefault(body, []).extend(polygons)
    return [(name, polygons) for (_, name), polygons in bodies.items()]


def _obj_corners(path: Path, number: int, rest: str, vertices: int) -> list[int]:
    """Return the vertices of a face, from 0 (``1/2/3``, ``1//3`` or ``1`` in the file; negative ones count back)."""
    words = rest.split(None, CORNERS_MOST)
    if len(words) > CORNERS_MOST:
        raise too_many_corners(path, f"line {number}: the face {rest.strip()[:40]!r}")
    try:
        corners = [int(word.split("/", 1)[0]) for word in words]
    except ValueError:
        raise damaged(path, f"line {number}: the face {rest.strip()[:40]!r} is not understood") from None
    return [corner - 1 if corner > 0 else corner + vertices if corner < 0 else -1 for corner in corners]


_KEYWORD = re.compile(r"\s*(ST)?C?N?(4)?(n)?OFF(?![a-z])[ \t]*(BINARY)?", re.IGNORECASE)


def read_off(path: Path, data: bytes) -> MeshContents:
    """Return the contents of an OFF file: one unnamed triangle soup.

    Raises:
        MeshError: If it is truncated, binary, or not OFF.
    """
    text = re.sub(r"#[^\n]*", "", text_of(data))
    keyword = _KEYWORD.match(text)
    if keyword is None:
        raise MeshError(path, "does not begin with OFF", hint="check the suffix")
    if any(keyword.group(index) for index in (2, 3, 4)):
        kind = " ".join(keyword.group().split())
        raise MeshError(path, f"is a {kind} file, which is not read", hint="export it as plain, three-dimensional OFF")
    lines = [line for line in text[keyword.end() :].splitlines() if line.strip()]
    counts = numbers(path, lines[0], "its second line") if lines else ()
    if len(counts) < 2 or any(count < 0 or count != int(count) for count in counts[:2]):
        raise damaged(path, "its second line does not count vertices and faces")
    vertex_count, face_count = (int(count) for count in counts[:2])
    if 1 + vertex_count + face_count > len(lines):
        raise damaged(
            path,
            f"declares {vertex_count:,} vertices and {face_count:,} faces, but has {len(lines) - 1:,} lines",
        )
    vertices = rows_of_numbers(path, lines[1 : 1 + vertex_count], 3, "a vertex")
    polygons = [_off_corners(path, line) for line in lines[1 + vertex_count : 1 + vertex_count + face_count]]
    if vertex_count and not face_count:
        return MeshContents((), left_out=(("", f"{vertex_count:,} points"),))
    return MeshContents((body_of_polygons("", vertices, polygons),))


def _off_corners(path: Path, line: str) -> list[int]:
    """Return the corners of a face; the line starts with their number and may end with a colour."""
    words = line.split(None, CORNERS_MOST + 1)
    if len(words) > CORNERS_MOST + 1:
        raise too_many_corners(path, f"the face {line.strip()[:40]!r}")
    try:
        count = int(words[0])
        corners = [int(word) for word in words[1 : count + 1]]
    except ValueError:
        raise damaged(path, f"the face {line.strip()[:40]!r} has a corner that is not a number") from None
    if count < 0 or len(corners) < count:
        raise damaged(path, f"the face {line.strip()[:40]!r} has fewer corners than it declares")
    return corners
