"""Reader of LAS point clouds (ASPRS LAS 1.0 to 1.4), and of LAZ through laspy.

The header is checked before its counts are used: a damaged one may claim more points than the file holds.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bimvox.errors import FileError
from bimvox.files import read_input
from bimvox.processes import python_module, run_to_end
from bimvox.site.obstructions.las_crs import LasCrs, las_crs

_SHORTEST = 227
_LONG_1_4 = 375
_COMPRESSED = 0x80
# LAZ compresses points 5 to 20 times, repeated points more.
_MOST_PACKED = 200
_SECONDS = 300.0


@dataclass(frozen=True, slots=True)
class _Header:
    """The fields of a LAS header that the reader needs.

    Attributes:
        start: Offset of the first point, bytes.
        count: Number of points.
        length: Bytes per point.
        compressed: Whether it is LAZ.
        scale: Factors of the stored integers, x, y, z.
        offset: Added after scaling.
        crs: What it states about its coordinates.
    """

    start: int
    count: int
    length: int
    compressed: bool
    scale: tuple[float, float, float]
    offset: tuple[float, float, float]
    crs: LasCrs


def read_las(path: Path, metres_per_unit: float = 1.0) -> NDArray[np.float64]:
    """Return the points of a LAS or LAZ file.

    Args:
        path: The file; LAZ needs the extra ``scan``.
        metres_per_unit: Its unit, if the file does not state one.

    Returns:
        (N, 3) float64, metres.

    Raises:
        FileError: If the file cannot be read, is damaged or is truncated, or its x and y are degrees.
    """
    data = read_input(path, may_be_empty=True)
    header = _header(path, data)
    crs = header.crs
    if crs.is_geographic:
        hint = "project it to the map's coordinate system, in metres or feet"
        raise FileError(path, "its x and y are longitude and latitude", hint=hint)
    points = _unpacked(path, header) if header.compressed else _stored(path, data, header)
    plan_m = metres_per_unit if crs.plan_m is None else crs.plan_m
    height_m = metres_per_unit if crs.height_m is None else crs.height_m
    return points if plan_m == height_m == 1.0 else points * (plan_m, plan_m, height_m)


def crs_of_las(path: Path) -> LasCrs:
    """Return what a LAS or LAZ file states about its coordinates."""
    return _header(path, read_input(path, may_be_empty=True)).crs


def _stored(path: Path, data: bytes, header: _Header) -> NDArray[np.float64]:
    there = max(0, len(data) - header.start) // header.length
    if there < header.count:
        raise FileError(path, f"truncated: {there:,} of {header.count:,} points")
    record = np.dtype({"names": ["xyz"], "formats": ["(3,)<i4"], "offsets": [0], "itemsize": header.length})
    stored = np.frombuffer(data, record, header.count, header.start)["xyz"]
    points: NDArray[np.float64] = stored * np.array(header.scale) + np.array(header.offset)
    return points


def _header(path: Path, data: bytes) -> _Header:
    if not data.startswith(b"LASF") or len(data) < _SHORTEST:
        raise FileError(path, "not a LAS file")
    minor, extended, extended_count = data[25], 0, 0
    size, start, records, form, length, count = struct.unpack_from("<HIIBHI", data, 94)
    scale, offset = struct.unpack_from("<3d", data, 131), struct.unpack_from("<3d", data, 155)
    if minor >= 4:
        if len(data) < _LONG_1_4:
            raise FileError(path, "not a LAS file: its header is truncated")
        extended, extended_count, count = struct.unpack_from("<QIQ", data, 235)
        if extended_count and extended + 60 * extended_count > len(data):
            raise FileError(path, "damaged LAS file: its extended records lie beyond its end")
    if data[24] != 1 or length < 20 or size < _SHORTEST or start < size or size + 54 * records > start:
        raise FileError(path, "damaged LAS file: its header contradicts itself")
    if start > len(data):
        raise FileError(path, f"truncated: {len(data):,} bytes, but its points begin at byte {start:,}")
    if not np.isfinite([*scale, *offset]).all():
        raise FileError(path, "damaged LAS file: its scale or offset is not finite")
    crs = las_crs(_records(data, size, records, extended, extended_count))
    return _Header(start, count, length, bool(form & _COMPRESSED), scale, offset, crs)


def _records(
    data: bytes, start: int, count: int, extended: int, extended_count: int
) -> Iterator[tuple[bytes, int, bytes]]:
    """Yield user id, record id and content of the variable length records and the extended ones."""
    for first, number, form in ((start, count, "<2x16sHH32x"), (extended, extended_count, "<2x16sHQ32x")):
        at = first
        for _ in range(number):
            if at + struct.calcsize(form) > len(data):
                return
            user, record, length = struct.unpack_from(form, data, at)
            at += struct.calcsize(form)
            yield user.partition(b"\0")[0], record, data[at : at + length]
            at += length


def _unpacked(path: Path, header: _Header) -> NDArray[np.float64]:
    if find_spec("laspy") is None or find_spec("lazrs") is None:
        raise FileError(path, "LAZ files need laspy and lazrs", hint="pip install 'bimvox[scan]'")
    if header.count * header.length > _MOST_PACKED * path.stat().st_size:
        raise FileError(path, f"damaged LAZ file: its header claims {header.count:,} points, more than fit into it")
    done = run_to_end(python_module("bimvox.site.obstructions.laz_worker", str(path.resolve())), _SECONDS)
    if done is None:
        raise FileError(path, f"LAZ file not decompressed within {_SECONDS:g} s")
    if done.code:
        raise FileError(path, f"damaged LAZ file: {done.last_line or 'its decoder crashed'}")
    points = np.frombuffer(done.out, np.float64).reshape(-1, 3)
    if len(points) < header.count:
        raise FileError(path, f"truncated: {len(points):,} of {header.count:,} points")
    return points
