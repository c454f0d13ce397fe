"""Units of an IFC file in SI units, which a damaged file may define by zero, by a text or by themselves."""

from __future__ import annotations

from pathlib import Path
from typing import Any

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
        if self._kind(stated, "LENGTHUNIT") != "LENGTHUNIT":
            return None
        scale = self.metres if stated.unit is None else si_scale(stated.unit)
        return None if scale is None else stated.value * scale

    def m3(self, stated: Stated) -> float | None:
        """Return a volume; None if the value is none."""
        if self._kind(stated, "VOLUMEUNIT") != "VOLUMEUNIT":
            return None
        unit = stated.unit or self._of_project.get("VOLUMEUNIT")
        scale = 1.0 if unit is None else si_scale(unit)
        return None if scale is None else stated.value * scale

    def kg_m3(self, stated: Stated) -> float | None:
        """Return a density; None if the value is none."""
        if self._kind(stated, "MASSDENSITYUNIT") != "MASSDENSITYUNIT":
            return None
        unit = stated.unit or self._of_project.get("MASSDENSITYUNIT")
        scale = 1e3 if unit is None else si_scale(unit)
        return None if scale is None else stated.value * scale * 1e-3

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
    found: dict[str, Any] = {}
    for unit in assignment.Units if assignment else ():
        kind = getattr(unit, "UnitType", None)
        if kind not in _USED or kind in found:
            continue
        if si_scale(unit) is None:
            raise IfcError(
                path,
                f"its {kind} {shown(str(unit))} cannot be converted into SI units",
                hint="export the model again, in metres or millimetres",
            )
        found[kind] = unit
    return found


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
