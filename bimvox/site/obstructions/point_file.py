"""Reader of point clouds: PLY (text and binary), plain text tables (XYZ, CSV, PTS), LAS and LAZ."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.mesh.ply import ply_header
from bimvox.errors import FileError
from bimvox.files import read_input, require_input
from bimvox.site.obstructions.esri_grid import is_esri_grid, read_esri_grid
from bimvox.site.obstructions.las_file import crs_of_las, read_las
from bimvox.site.obstructions.text_table import numbers_in, read_table, table_in_words

_LAS = (".las", ".laz")
SCAN_SUFFIXES = (".xyz", ".pts", ".asc", ".csv", ".txt", *_LAS)
"""Suffixes of files that hold only a point cloud or an ESRI grid; a PLY file may also hold one."""
_KNOWN = (".ply", *SCAN_SUFFIXES)


def read_points(path: Path, metres_per_unit: float = 1.0) -> NDArray[np.float64]:
    """Return the points of a file.

    Args:
        path: A PLY file with x, y, z vertices, a LAS or LAZ file (LAZ needs the extra ``scan``), or a text table whose
            first three columns are x, y, z, as :func:`read_table` reads it.
        metres_per_unit: Its unit, if the file does not state one; only LAS and LAZ files may.

    Returns:
        (N, 3) float64, N >= 1, metres.

    Raises:
        FileError: If the file cannot be read, is truncated, or holds no points.
    """
    if path.suffix.lower() in _LAS:
        return _checked(path, read_las(path, metres_per_unit))
    if path.suffix.lower() not in _KNOWN:
        raise FileError(path, "unknown type of point file", hint=f"known: {', '.join(_KNOWN)}")
    data = read_input(path, may_be_empty=True)
    points = _ply(path, data) if path.suffix.lower() == ".ply" else read_table(path, data)
    return _checked(path, points if metres_per_unit == 1.0 else points * metres_per_unit)


def scan_in_words(path: Path) -> str:
    """Return how a scan is read, or an ESRI grid: its unit, what separates its columns, its cells."""
    if is_esri_grid(path):
        return str(read_esri_grid(path))
    kind = path.suffix.lower()
    if kind in _LAS:
        return f"{kind[1:].upper()}, {crs_of_las(path)}"
    return "PLY" if kind == ".ply" else f"table, {table_in_words(path, read_input(path))}"


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
        return numbers_in(path, b"\n".join(text), [names.index(axis) for axis in "xyz"])
    dtype = np.dtype([(item.name, item.type) for item in vertex.properties])
    if len(data) - start < count * dtype.itemsize:
        raise FileError(path, f"truncated: {(len(data) - start) // dtype.itemsize} of {count} points")
    rows = np.frombuffer(data, dtype, count, start)
    return np.stack([rows[axis].astype(np.float64) for axis in "xyz"], axis=1)
