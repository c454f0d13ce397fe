"""Reader of LAS point clouds (ASPRS LAS 1.0 to 1.4), and of LAZ through laspy.

The header is checked before its counts are used: a damaged one may claim more points than the file holds.
"""

from __future__ import annotations

import re
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

_GEO_KEYS = 34735
_WKT = 2112
_MODEL_TYPE, _PROJECTED_CRS, _LINEAR_UNIT, _VERTICAL_UNIT = 1024, 3072, 3076, 4099
_GEOGRAPHIC = 2
_US_SURVEY_FT_M = 1200.0 / 3937.0
_METRES_BY_CODE = {9001: 1.0, 9002: 0.3048, 9003: _US_SURVEY_FT_M}
"""Metre, foot and US survey foot by their EPSG codes."""
_UNIT_IN_WKT = re.compile(r'(?<!ANGLE)(?<!SCALE)(?:LENGTH)?UNIT\s*\[\s*"([^"]*)"\s*,\s*([0-9.eE+-]+)')
_LENGTHS_M = (1e-4, 2000.0)
_NAMES = {1.0: "m", 0.3048: "ft", _US_SURVEY_FT_M: "US survey ft"}


@dataclass(frozen=True, slots=True)
class _LasCrs:
    """Coordinates of a LAS file.

    Attributes:
        plan_m: Unit of x and y in metres; None if it is not stated.
        height_m: Unit of z in metres; that of x and y if it is not stated apart.
        is_geographic: Whether x and y are degrees.
        epsg: Code of the projected coordinate system, if it is stated by GeoTIFF keys.
    """

    plan_m: float | None = None
    height_m: float | None = None
    is_geographic: bool = False
    epsg: int | None = None

    def __str__(self) -> str:
        """Return them as ``inspect`` shows them."""
        if self.plan_m is None or self.height_m is None:
            unit = "unit not stated"
        elif self.plan_m == self.height_m:
            unit = f"in {_name(self.plan_m)}"
        else:
            unit = f"in {_name(self.plan_m)}, heights in {_name(self.height_m)}"
        return unit if self.epsg is None else f"{unit}, EPSG:{self.epsg}"


def _las_crs(records: Iterator[tuple[bytes, int, bytes]]) -> _LasCrs:
    """Return what the variable length records of a LAS file (user id, record id, content) state."""
    result = _LasCrs()
    for user, number, content in records:
        if user == b"LASF_Projection" and number == _WKT:
            # The specification prefers WKT where both are given.
            return _of_wkt(content.partition(b"\0")[0].decode("utf-8", "replace"))
        if user == b"LASF_Projection" and number == _GEO_KEYS:
            result = _of_keys(content)
    return result


def _of_keys(content: bytes) -> _LasCrs:
    values = struct.unpack(f"<{len(content) // 2}H", content[: len(content) // 2 * 2])
    keys = {
        key: value
        for key, place, value in zip(values[4::4], values[5::4], values[7::4], strict=False)
        if place == 0  # the value itself, not where it is
    }
    plan_m = _METRES_BY_CODE.get(keys.get(_LINEAR_UNIT, 0))
    epsg = keys.get(_PROJECTED_CRS)
    return _LasCrs(
        plan_m,
        _METRES_BY_CODE.get(keys.get(_VERTICAL_UNIT, 0), plan_m),
        keys.get(_MODEL_TYPE) == _GEOGRAPHIC,
        epsg if epsg is not None and 1024 <= epsg < 32767 else None,
    )


def _of_wkt(text: str) -> _LasCrs:
    vertical = re.search(r"VERT(_CS|CRS|ICALCRS)\s*\[", text)
    plan, height = (text, "") if vertical is None else (text[: vertical.start()], text[vertical.start() :])
    is_projected = re.search(r"PROJ(CS|CRS|ECTEDCRS)\s*\[", text) is not None
    is_geographic = not is_projected and re.search(r"GEO(GCS|GCRS|DCRS|GRAPHICCRS|DETICCRS)\s*\[", text) is not None
    # The unit of the coordinate system is the last one: before it come those of the ellipsoid and the parameters.
    plan_m = None if is_geographic else _last_length(plan)
    height_m = _last_length(height)
    return _LasCrs(plan_m, plan_m if height_m is None else height_m, is_geographic)


def _last_length(text: str) -> float | None:
    """Return the last unit of length in a WKT, in metres; None if there is none."""
    result = None
    for name, factor in _UNIT_IN_WKT.findall(text):
        try:
            metres = float(factor)
        except ValueError:
            continue
        if not re.search("(?i)deg|grad|rad|gon|unity|scale", name) and _LENGTHS_M[0] <= metres <= _LENGTHS_M[1]:
            result = metres
    return result


def _name(metres: float) -> str:
    return next((name for known, name in _NAMES.items() if abs(known - metres) < 1e-9), f"units of {metres:g} m")


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
    crs: _LasCrs


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


def crs_of_las(path: Path) -> _LasCrs:
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
    crs = _las_crs(_records(data, size, records, extended, extended_count))
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
