"""Reader of point clouds: PLY (text and binary), plain text tables (XYZ, CSV, PTS), LAS and LAZ."""

from __future__ import annotations

import io
import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.mesh.ply import ply_header
from bimvox.errors import FileError
from bimvox.files import read_input, require_input
from bimvox.site.obstructions.las_file import read_las

_LAS = (".las", ".laz")
SCAN_SUFFIXES = (".xyz", ".pts", ".asc", *_LAS)
"""Suffixes of files that hold only a point cloud; a PLY file may also hold one."""
_KNOWN = (".ply", ".csv", ".txt", *SCAN_SUFFIXES)


def read_points(path: Path) -> NDArray[np.float64]:
    """Return the points of a file.

    Args:
        path: A PLY file with x, y, z vertices, a LAS or LAZ file (LAZ needs the extra ``scan``), or a text table whose
            first three columns are x, y, z (separated by spaces, commas or semicolons; with decimal commas if
            something else separates; lines that start with ``#`` and one heading line are ignored).

    Returns:
        (N, 3) float64, N >= 1, in the file's unit.

    Raises:
        FileError: If the file cannot be read, is truncated, or holds no points.
    """
    if path.suffix.lower() in _LAS:
        return _checked(path, read_las(path))
    if path.suffix.lower() not in _KNOWN:
        raise FileError(path, "unknown type of point file", hint=f"known: {', '.join(_KNOWN)}")
    data = read_input(path, may_be_empty=True)
    return _checked(path, _ply(path, data) if path.suffix.lower() == ".ply" else _table(path, data))


def is_scan(path: Path) -> bool:
    """Return whether a file holds points and no faces: by its suffix, or by the header of a PLY file."""
    if path.suffix.lower() != ".ply":
        return path.suffix.lower() in SCAN_SUFFIXES
    try:
        with require_input(path).open("rb") as stream:
            head = stream.read(1 << 16).partition(b"end_header")[0]
    except (FileError, OSError):
        return False
    faces = [line.split() for line in head.splitlines() if line.startswith(b"element face")]
    return head.startswith(b"ply") and all(words[-1] == b"0" for words in faces)


def _checked(path: Path, points: NDArray[np.float64]) -> NDArray[np.float64]:
    if len(points) == 0:
        raise FileError(path, "holds no points")
    if not np.isfinite(points).all():
        raise FileError(path, f"point {int(np.argmin(np.isfinite(points).all(axis=1)))} is not finite")
    return points


def _ply(path: Path, data: bytes) -> NDArray[np.float64]:
    is_text, elements, start = ply_header(path, data)
    if not elements or elements[0].name != "vertex":
        raise FileError(path, "not a PLY file of points (its first element must be vertex)")
    vertex, count = elements[0], elements[0].count
    names = [item.name for item in vertex.properties]
    if not {"x", "y", "z"} <= set(names) or len(set(names)) < len(names) or vertex.lists:
        raise FileError(path, "its vertices lack x, y, z, or have a list or two properties of one name")
    if is_text:
        text = data[start:].splitlines()[:count]
        if len(text) < count:
            raise FileError(path, f"truncated: {len(text)} of {count} points")
        return _numbers(path, b"\n".join(text), [names.index(axis) for axis in "xyz"])
    dtype = np.dtype([(item.name, item.type) for item in vertex.properties])
    if len(data) - start < count * dtype.itemsize:
        raise FileError(path, f"truncated: {(len(data) - start) // dtype.itemsize} of {count} points")
    rows = np.frombuffer(data, dtype, count, start)
    return np.stack([rows[axis].astype(np.float64) for axis in "xyz"], axis=1)


def _table(path: Path, data: bytes) -> NDArray[np.float64]:
    text = data.removeprefix(b"\xef\xbb\xbf")
    first, _, rest = text.partition(b"\n")
    has_heading = any(byte in b"xyzXYZ/" for byte in first) or len(re.split(rb"[\s,;]+", first.strip())) == 1
    if has_heading:
        text = rest  # a heading, or the number of points (PTS)
    lines = (line.strip() for line in io.BytesIO(text))
    row = next((line for line in lines if line and not line.startswith(b"#")), b"")
    if _has_decimal_commas(row):
        text = re.sub(rb",(?=\s)", b" ", text).replace(b",", b".")
    text = text.replace(b",", b" ").replace(b";", b" ")
    return _numbers(path, text, [0, 1, 2], lines_before=int(has_heading))


def _has_decimal_commas(row: bytes) -> bool:
    """Return whether a comma in a table with this first row can only be a decimal one: something else separates."""
    if b";" in row:
        return True
    fields = row.split()
    given = [field.rstrip(b",") for field in fields[:3]]
    if len(given) < 3 or any(field.count(b",") > 1 or (b"," in field and b"." in field) for field in given):
        return False
    return any(b"," in field for field in given) or not any(b"," in field for field in fields[:3])


def _numbers(path: Path, text: bytes, columns: list[int], lines_before: int = 0) -> NDArray[np.float64]:
    if not text.strip():
        return np.zeros((0, 3))
    try:
        return np.loadtxt(io.BytesIO(text), dtype=np.float64, usecols=columns, ndmin=2)
    except (ValueError, IndexError):
        wrong = _first_wrong(text, columns)
        if wrong is None:
            raise FileError(path, "not a table of numbers") from None
        number, line = wrong
        said = f"not a table of numbers: line {number + lines_before} is {line.decode(errors='replace')[:60]!r}"
        hint = "write x, y and z in this order, separated by spaces or semicolons, with decimal points or commas"
        raise FileError(path, said, hint=hint) from None


def _first_wrong(text: bytes, columns: list[int]) -> tuple[int, bytes] | None:
    """Return number and content of the first line that lacks a number in one of the columns."""
    for number, line in enumerate(io.BytesIO(text), start=1):
        fields = line.partition(b"#")[0].split()
        try:
            _ = [float(fields[column]) for column in columns if fields]
        except (ValueError, IndexError):
            return number, line.strip()
    return None
