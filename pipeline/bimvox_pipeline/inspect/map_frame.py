"""The transform from a model's coordinates to map coordinates, from its file (IfcMapConversion)."""

from __future__ import annotations

import math
from collections.abc import Mapping

from bimvox.units import METRES_PER_UNIT

Matrix = list[list[float]]


def ifc_to_map(georeference: Mapping[str, str | float], unit: str) -> Matrix | None:
    """Return the (4, 4) transform from the model's metres to map metres, or None if the file has none.

    ``map = scale * R_z(yaw) * ifc + (eastings, northings, height)``; heights are not rotated (IFC4 ADD2,
    IfcMapConversion).

    Args:
        georeference: ``Building.georeference``.
        unit: Length unit of the file: some exporters include its conversion to the map's unit in the scale.
    """
    if "eastings_m" not in georeference:
        return None
    yaw_rad = float(georeference.get("x_axis_yaw_rad", 0.0))
    scale = metric_scale(float(georeference.get("scale", 1.0)), unit)
    cos, sin = scale * math.cos(yaw_rad), scale * math.sin(yaw_rad)
    east, north, height = (float(georeference[key]) for key in ("eastings_m", "northings_m", "height_m"))
    return [[cos, 0.0 - sin, 0.0, east], [sin, cos, 0.0, north], [0.0, 0.0, scale, height], [0.0, 0.0, 0.0, 1.0]]


def metric_scale(stated: float, unit: str) -> float:
    """Return a map conversion's scale as a factor from metres to metres.

    By the standard the scale includes the unit conversion and the map's distortion, which is within a few per mille of
    1. Real files include either or both, so the reading near 1 is taken.
    """
    for scale in (stated, stated / METRES_PER_UNIT.get(unit, 1.0)):
        if 0.9 < scale < 1.1:
            return scale
    return 1.0
