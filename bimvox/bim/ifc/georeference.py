"""Position of a model on the map, as the file states it. It does not move the geometry."""

from __future__ import annotations

import math
from typing import Any

import ifcopenshell.util.element
import ifcopenshell.util.geolocation

from bimvox.bim.ifc.units import si_scale

_METRES = {"m": 1.0, "metre": 1.0, "meter": 1.0, "mm": 1e-3, "millimetre": 1e-3, "millimeter": 1e-3, "ft": 0.3048,
           "foot": 0.3048, "feet": 0.3048}  # fmt: skip
"""Map units as the property sets of IFC2X3 name them, lower case and singular."""


def georeference_of(file: Any, metres_per_unit: float) -> dict[str, str | float]:
    """Return the map conversion and site position of a file as plain values.

    An IFC2X3 file has them in the property sets ``ePset_MapConversion`` and ``ePset_ProjectedCRS`` of the project (the
    Geo-referencing guide of buildingSMART) or the site (its earlier proposal); names in any case.

    Keys, each only if stated: ``eastings_m``, ``northings_m``, ``height_m`` (of the local origin in the map's
    system), ``x_axis_yaw_rad`` (of the local x axis, counter-clockwise from map east), ``scale``, ``crs``,
    ``true_north_rad`` (of true north, counter-clockwise from the local y axis), ``latitude_deg``, ``longitude_deg``,
    ``elevation_m`` (of the ``IfcSite``).

    Args:
        file: The ``ifcopenshell.file``.
        metres_per_unit: The project's length unit in metres; eastings use it if the map does not state a unit.
    """
    found: dict[str, str | float] = {}
    if file.schema == "IFC2X3":
        conversion, crs = _ifc2x3_set(file, "MapConversion"), _ifc2x3_set(file, "ProjectedCRS")
        values = [_number(conversion.get(key)) for key in ("Eastings", "Northings", "OrthogonalHeight")]
        axis = [_number(conversion.get(key)) for key in ("XAxisAbscissa", "XAxisOrdinate")]
        scale = _number(conversion.get("Scale")) or 1.0
    else:
        stated = ifcopenshell.util.geolocation.get_helmert_transformation_parameters(file)
        crs = ifcopenshell.util.geolocation.get_crs(file) or {}
        values = [] if stated is None else [float(stated.e), float(stated.n), float(stated.h)]
        axis, scale = ([], 1.0) if stated is None else ([float(stated.xaa), float(stated.xao)], float(stated.scale))
    if any(values):
        metres = _map_unit_m(crs.get("MapUnit")) or metres_per_unit
        found["eastings_m"], found["northings_m"], found["height_m"] = (value * metres for value in values)
        found["x_axis_yaw_rad"] = _angle(*(axis if any(axis) else (1.0, 0.0)))
        found["scale"] = scale
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


def _ifc2x3_set(file: Any, name: str) -> dict[str, Any]:
    """Return one of the property sets for map coordinates in an IFC2X3 file; empty if there is none."""
    for owner in (*file.by_type("IfcProject"), *file.by_type("IfcSite")):
        for key, values in ifcopenshell.util.element.get_psets(owner, psets_only=True).items():
            if key.lower() == f"epset_{name}".lower():
                return dict(values)
    return {}


def _number(value: Any) -> float:
    """Return a property's number; 0 if it is missing or has none."""
    try:
        number = float(value or 0.0)
    except (TypeError, ValueError):
        return 0.0
    return number if math.isfinite(number) else 0.0


def _map_unit_m(unit: Any) -> float | None:
    """Return a map unit in metres, an entity or its name; None if it is not stated or not known."""
    if unit is None or not isinstance(unit, str):
        return None if unit is None else si_scale(unit)
    return _METRES.get(unit.strip().lower().removesuffix("s"))


def _angle(x: float, y: float) -> float:
    """Return the direction of (x, y), without the rounding noise of the exporter's trigonometry."""
    return round(math.atan2(y, x), 12) + 0.0


def _degrees(parts: tuple[int, ...]) -> float:
    """Return an IfcCompoundPlaneAngleMeasure (degrees, minutes, seconds, millionths; all of one sign) in degrees."""
    weights = (1.0, 1 / 60, 1 / 3600, 1 / 3.6e9)
    return round(float(sum(part * weight for part, weight in zip(parts, weights, strict=False))), 10)
