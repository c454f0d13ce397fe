"""Units of an IFC file in SI units, which a damaged file may define by zero, by a text or by themselves."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import ifcopenshell.util.unit

from bimvox.errors import IfcError, shown

_USED = ("LENGTHUNIT", "AREAUNIT", "VOLUMEUNIT", "PLANEANGLEUNIT", "MASSUNIT", "MASSDENSITYUNIT")
_SMALLEST, _LARGEST = 1e-12, 1e12
_MOST_CONVERSIONS = 16


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
