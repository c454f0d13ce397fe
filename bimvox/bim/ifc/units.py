"""Units of an IFC file in SI units, which a damaged file may define by zero or by a text; its position on the map."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import ifcopenshell.util.element
import ifcopenshell.util.geolocation
import ifcopenshell.util.unit

from bimvox.bim.ifc.properties import Stated
from bimvox.errors import IfcError, shown

_USED = ("LENGTHUNIT", "AREAUNIT", "VOLUMEUNIT", "PLANEANGLEUNIT", "MASSUNIT", "MASSDENSITYUNIT", "FORCEUNIT")
_SMALLEST, _LARGEST = 1e-12, 1e12
_MOST_CONVERSIONS = 16
_KG_PER_N = 1.0 / 9.80665
_KG_BY_NAME = {
    **{"kg": 1.0, "kilogram": 1.0, "t": 1000.0, "to": 1000.0, "ton": 1000.0, "tonne": 1000.0, "metric ton": 1000.0},
    **{"lb": 0.45359237, "lbs": 0.45359237, "pound": 0.45359237, "kip": 453.59237, "kips": 453.59237},
    **{"n": _KG_PER_N, "newton": _KG_PER_N, "kn": 1000.0 * _KG_PER_N, "kilonewton": 1000.0 * _KG_PER_N},
}
"""Units that a file names, but does not define (``IfcContextDependentUnit``)."""
_KIND_OF_MEASURE = {
    **{"IfcMassMeasure": "MASSUNIT", "IfcQuantityWeight": "MASSUNIT", "IfcForceMeasure": "FORCEUNIT"},
    **{"IfcLengthMeasure": "LENGTHUNIT", "IfcPositiveLengthMeasure": "LENGTHUNIT", "IfcQuantityLength": "LENGTHUNIT"},
    **{"IfcVolumeMeasure": "VOLUMEUNIT", "IfcQuantityVolume": "VOLUMEUNIT", "IfcMassDensityMeasure": "MASSDENSITYUNIT"},
}
_PLAIN = ("IfcReal", "IfcInteger", "IfcNumericMeasure", "IfcCountMeasure")
"""Numbers without a meaning: their name has it."""


class Units:
    """Converts what a file states: each value has its own unit, otherwise the project's of its type.

    Args:
        file: The ``ifcopenshell.file``.
    """

    def __init__(self, file: Any) -> None:
        assignment = file.by_type("IfcProject")[0].UnitsInContext
        self._of_project: dict[str, Any] = {}
        for unit in assignment.Units if assignment else ():
            self._of_project.setdefault(getattr(unit, "UnitType", None) or "", unit)

    def kg(self, stated: Stated) -> float | None:
        """Return a mass, or a weight as the mass that has it; None if the value is neither."""
        kind = self._kind(stated, "MASSUNIT")
        if kind not in ("MASSUNIT", "FORCEUNIT"):
            return None
        unit = stated.unit or self._of_project.get(kind)
        usual = 1.0 if kind == "MASSUNIT" else _KG_PER_N
        if unit is None:
            return stated.value * usual
        if unit.is_a("IfcContextDependentUnit"):
            name = str(unit.Name or "").strip().lower()
            return stated.value * _KG_BY_NAME.get(name, usual)
        per_base = {"GRAM": 1e-3, "NEWTON": _KG_PER_N}.get(_base(unit))
        scale = si_scale(unit)
        return None if per_base is None or scale is None else stated.value * scale * per_base

    @property
    def metres(self) -> float:
        """The project's unit of length in metres."""
        unit = self._of_project.get("LENGTHUNIT")
        return 1.0 if unit is None else si_scale(unit) or 1.0

    def m(self, stated: Stated) -> float | None:
        """Return a length; None if the value is none."""
        return self._converted(stated, "LENGTHUNIT", self.metres)

    def m3(self, stated: Stated) -> float | None:
        """Return a volume; None if the value is none."""
        return self._converted(stated, "VOLUMEUNIT", 1.0, self._of_project.get("VOLUMEUNIT"))

    def kg_m3(self, stated: Stated) -> float | None:
        """Return a density; None if the value is none."""
        g_m3 = self._converted(stated, "MASSDENSITYUNIT", 1e3, self._of_project.get("MASSDENSITYUNIT"))
        return None if g_m3 is None else g_m3 * 1e-3

    def _converted(self, stated: Stated, kind: str, usual: float, unit: Any = None) -> float | None:
        """Return a value by its own unit, otherwise by ``unit``, otherwise by a usual scale; None if it is none."""
        if self._kind(stated, kind) != kind:
            return None
        unit = stated.unit or unit
        scale = usual if unit is None else si_scale(unit)
        return None if scale is None else stated.value * scale

    def _kind(self, stated: Stated, plain: str) -> str | None:
        """Return the type of unit in which a value is, ``plain`` for a plain number; None for another measure."""
        return plain if stated.measure in _PLAIN else _KIND_OF_MEASURE.get(stated.measure)


def _base(unit: Any) -> str:
    """Return the name of the SI unit by which a unit is defined; empty if there is not exactly one."""
    if not _ends(unit):
        return ""
    while unit is not None and unit.is_a("IfcConversionBasedUnit"):
        unit = getattr(unit.ConversionFactor, "UnitComponent", None)
    return str(unit.Name) if unit is not None and unit.is_a("IfcSIUnit") else ""


def project_units(path: Path, project: Any) -> dict[str, Any]:
    """Return the units of a project that bimvox uses, by their type; the first of each type.

    Raises:
        IfcError: If one of them cannot be converted into SI units.
    """
    assignment = project.UnitsInContext
    result: dict[str, Any] = {}
    for unit in assignment.Units if assignment else ():
        kind = getattr(unit, "UnitType", None)
        if kind not in _USED or kind in result:
            continue
        if si_scale(unit) is None:
            raise IfcError(
                path,
                f"its {kind} {shown(str(unit))} cannot be converted into SI units",
                hint="export the model again, in metres or millimetres",
            )
        result[kind] = unit
    return result


def si_scale(unit: Any) -> float | None:
    """Return a unit in SI units; None if it is not a number from 1e-12 to 1e12 of them."""
    elements = unit.Elements if unit.is_a("IfcDerivedUnit") else ()
    if not all(map(_ends, (element.Unit for element in elements) if elements else (unit,))):
        return None
    try:
        scale = float(ifcopenshell.util.unit.get_unit_scale(unit))
    except (AttributeError, ArithmeticError, KeyError, TypeError, ValueError):
        return None
    return scale if _SMALLEST <= scale <= _LARGEST else None


def _ends(unit: Any) -> bool:
    """Return whether a chain of conversions ends: IfcOpenShell would follow a loop for ever."""
    for _ in range(_MOST_CONVERSIONS):
        if unit is None or not unit.is_a("IfcConversionBasedUnit"):
            return True
        unit = getattr(unit.ConversionFactor, "UnitComponent", None)
    return False


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
    result: dict[str, str | float] = {}
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
        result["eastings_m"], result["northings_m"], result["height_m"] = (value * metres for value in values)
        result["x_axis_yaw_rad"] = _angle(*(axis if any(axis) else (1.0, 0.0)))
        result["scale"] = scale
    if crs.get("Name"):
        result["crs"] = str(crs["Name"])
    for context in file.by_type("IfcGeometricRepresentationContext", include_subtypes=False):
        if context.TrueNorth is not None and context.CoordinateSpaceDimension == 3:
            east, north = context.TrueNorth.DirectionRatios[:2]
            result["true_north_rad"] = _angle(float(north), -float(east))
            break
    for site in file.by_type("IfcSite")[:1]:
        if site.RefLatitude and site.RefLongitude:
            result["latitude_deg"] = _degrees(site.RefLatitude)
            result["longitude_deg"] = _degrees(site.RefLongitude)
        if site.RefElevation is not None:
            result["elevation_m"] = float(site.RefElevation) * metres_per_unit
    return result


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
