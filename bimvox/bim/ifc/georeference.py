"""Position of a model on the map, as the file states it. It does not move the geometry."""

from __future__ import annotations

import math
from typing import Any

import ifcopenshell.util.geolocation

from bimvox.bim.ifc.units import si_scale


def georeference_of(file: Any, metres_per_unit: float) -> dict[str, str | float]:
    """Return the map conversion and site position of a file as plain values.

    Keys, each only if stated: ``eastings_m``, ``northings_m``, ``height_m`` (of the local origin in the map's
    system), ``x_axis_yaw_rad`` (of the local x axis, counter-clockwise from map east), ``scale``, ``crs``,
    ``true_north_rad`` (of true north, counter-clockwise from the local y axis), ``latitude_deg``, ``longitude_deg``,
    ``elevation_m`` (of the ``IfcSite``).

    Args:
        file: The ``ifcopenshell.file``.
        metres_per_unit: The project's length unit in metres; eastings use it if the map does not state a unit.
    """
    found: dict[str, str | float] = {}
    conversion = ifcopenshell.util.geolocation.get_helmert_transformation_parameters(file)
    crs = ifcopenshell.util.geolocation.get_crs(file) or {}
    if conversion is not None and any((conversion.e, conversion.n, conversion.h)):
        map_unit = crs.get("MapUnit")
        is_unit = map_unit is not None and not isinstance(map_unit, str)
        metres = (si_scale(map_unit) if is_unit else None) or metres_per_unit
        found["eastings_m"] = float(conversion.e) * metres
        found["northings_m"] = float(conversion.n) * metres
        found["height_m"] = float(conversion.h) * metres
        found["x_axis_yaw_rad"] = _angle(float(conversion.xaa), float(conversion.xao))
        found["scale"] = float(conversion.scale)
    if crs.get("Name"):
        found["crs"] = str(crs["Name"])
    for context in file.by_type("IfcGeometricRepresentationContext", include_subtypes=False):
        if context.TrueNorth is not None and context.CoordinateSpaceDimension == 3:
            east, north = context.TrueNorth.DirectionRatios[:2]
            found["true_north_rad"] = _angle(float(north), -float(east))
            break
    for site in file.by_type("IfcSite")[:1]:
        if site.RefLatitude and site.RefLongitude:
            found["latitude_deg"] = _degrees(site.RefLatitude)
            found["longitude_deg"] = _degrees(site.RefLongitude)
        if site.RefElevation is not None:
            found["elevation_m"] = float(site.RefElevation) * metres_per_unit
    return found


def _angle(x: float, y: float) -> float:
    """Return the direction of (x, y), without the rounding noise of the exporter's trigonometry."""
    return round(math.atan2(y, x), 12) + 0.0


def _degrees(parts: tuple[int, ...]) -> float:
    """Return an IfcCompoundPlaneAngleMeasure (degrees, minutes, seconds, millionths; all of one sign) in degrees."""
    weights = (1.0, 1 / 60, 1 / 3600, 1 / 3.6e9)
    return round(float(sum(part * weight for part, weight in zip(parts, weights, strict=False))), 10)
