"""What a LAS file states about its coordinates: the unit of plan and height, by its GeoTIFF keys or its WKT."""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass

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
class LasCrs:
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


def las_crs(records: Iterator[tuple[bytes, int, bytes]]) -> LasCrs:
    """Return what the variable length records of a LAS file state.

    Args:
        records: User id, record id and content of each.
    """
    found = LasCrs()
    for user, number, content in records:
        if user == b"LASF_Projection" and number == _WKT:
            # The specification prefers WKT where both are given.
            return _of_wkt(content.partition(b"\0")[0].decode("utf-8", "replace"))
        if user == b"LASF_Projection" and number == _GEO_KEYS:
            found = _of_keys(content)
    return found


def _of_keys(content: bytes) -> LasCrs:
    values = struct.unpack(f"<{len(content) // 2}H", content[: len(content) // 2 * 2])
    keys = {
        key: value
        for key, place, value in zip(values[4::4], values[5::4], values[7::4], strict=False)
        if place == 0  # the value itself, not where it is
    }
    plan_m = _METRES_BY_CODE.get(keys.get(_LINEAR_UNIT, 0))
    epsg = keys.get(_PROJECTED_CRS)
    return LasCrs(
        plan_m,
        _METRES_BY_CODE.get(keys.get(_VERTICAL_UNIT, 0), plan_m),
        keys.get(_MODEL_TYPE) == _GEOGRAPHIC,
        epsg if epsg is not None and 1024 <= epsg < 32767 else None,
    )


def _of_wkt(text: str) -> LasCrs:
    vertical = re.search(r"VERT(_CS|CRS|ICALCRS)\s*\[", text)
    plan, height = (text, "") if vertical is None else (text[: vertical.start()], text[vertical.start() :])
    is_projected = re.search(r"PROJ(CS|CRS|ECTEDCRS)\s*\[", text) is not None
    is_geographic = not is_projected and re.search(r"GEO(GCS|GCRS|DCRS|GRAPHICCRS|DETICCRS)\s*\[", text) is not None
    # The unit of the coordinate system is the last one: before it come those of the ellipsoid and the parameters.
    plan_m = None if is_geographic else _last_length(plan)
    height_m = _last_length(height)
    return LasCrs(plan_m, plan_m if height_m is None else height_m, is_geographic)


def _last_length(text: str) -> float | None:
    """Return the last unit of length in a WKT, in metres; None if there is none."""
    found = None
    for name, factor in _UNIT_IN_WKT.findall(text):
        try:
            metres = float(factor)
        except ValueError:
            continue
        if not re.search("(?i)deg|grad|rad|gon|unity|scale", name) and _LENGTHS_M[0] <= metres <= _LENGTHS_M[1]:
            found = metres
    return found


def _name(metres: float) -> str:
    return next((name for known, name in _NAMES.items() if abs(known - metres) < 1e-9), f"units of {metres:g} m")
