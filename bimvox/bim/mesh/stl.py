"""Read STL, binary and text: a triangle soup; text may have named solids. It states neither unit nor up."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.mesh.contents import MeshContents, RawBody, damaged
from bimvox.bim.mesh.text import numbers, text_of

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
