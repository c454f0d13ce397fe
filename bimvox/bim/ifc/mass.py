"""The mass of an element: what the file states, or volume times density."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from typing import Any

import ifcopenshell.util.element as element_util

from bimvox.bim.densities import DEFAULT_DENSITY_KG_M3, density_by_name
from bimvox.bim.ifc.properties import Properties, layers_of
from bimvox.bim.ifc.text import label
from bimvox.bim.ifc.units import si_scale

# Net before gross: a gross weight is that of the stock before cuts and openings (50 % more on one cut balcony).
_WEIGHTS = (
    *("netweight", "nettogewicht", "poidsnet", "pesonetto", "weight", "mass", "gewicht", "masse", "massa", "poids"),
    *("peso", "grossweight", "bruttogewicht", "poidsbrut", "pesobruto", "pesolordo"),
)
_VOLUMES = ("netvolume", "nettovolumen", "volume", "volumen", "grossvolume", "bruttovolumen")
_MOST = 1e12
"""A larger weight or volume is not one, in any unit."""
_PLAUSIBLE_KG_M3 = (5.0, 23000.0)
"""From insulation to above lead: a stated weight that gives a density outside this has a wrong number or unit."""
_ODD_KG_M3 = (50.0, 12000.0)
"""A stated weight that gives a density outside this is used, with a note."""
_LEAST_SHARE = 1e-3
"""Least share of a guessed volume that a stated one is believed to be: a frame hardly fills its box, and a wrong unit
is wrong by more."""
SOURCES = ("quantity", "density", "default")
"""Where a mass comes from, most reliable first."""


@dataclass(frozen=True, slots=True)
class Mass:
    """A mass, its source, and whether what is stated was refused as impossible, or used although it is odd.

    Attributes:
        kg: The mass.
        source: Where it comes from.
        stated_refused: Whether a stated weight was refused.
        stated_odd: Whether a stated weight was used although it is odd.
        volume_refused: Whether a stated volume was refused.
    """

    kg: float
    source: str
    stated_refused: bool = False
    stated_odd: bool = False
    volume_refused: bool = False


class Masses:
    """Masses of the products of one file.

    Args:
        file: The ``ifcopenshell.file``.
        properties: Looks its properties up.
    """

    def __init__(self, file: Any, properties: Properties) -> None:
        self._properties = properties
        self._kg_per_unit = _scale(file, "MASSUNIT", base=1e-3)
        self._m3_per_unit = _scale(file, "VOLUMEUNIT", base=1.0)
        self._density_per_unit = _scale(file, "MASSDENSITYUNIT", base=1e-3)
        self._density_by_material: dict[int, float | None] = {}
        self._old_densities: dict[int, float] = {}
        if file.schema == "IFC2X3":
            for entry in file.by_type("IfcGeneralMaterialProperties"):
                if entry.MassDensity:
                    self._old_densities[entry.Material.id()] = float(entry.MassDensity)

    def of(self, product: Any, volume_m3: float, exact: bool, box_m3: float = inf) -> Mass:
        """Return the mass of one product.

        A stated weight comes first, then volume times density of its material, then volume times default density. What
        is stated must fit the mesh: its volume if that is exact, otherwise its box.

        Args:
            product: The ``IfcProduct``.
            volume_m3: Volume of its mesh.
            exact: Whether that volume is exact; if not, a stated volume replaces it.
            box_m3: Volume of the box around its mesh, as thick as a part is.
        """
        stated = self._properties.sets_of(product)
        least_m3, most_m3 = (volume_m3, volume_m3) if exact else (_LEAST_SHARE * volume_m3, max(volume_m3, box_m3))
        weight = _first(stated, _WEIGHTS)
        refused = wrong_volume = False
        if weight is not None:
            kg = weight * self._kg_per_unit
            low, high = _PLAUSIBLE_KG_M3
            if low * least_m3 <= kg <= high * most_m3:
                odd = exact and not _ODD_KG_M3[0] * volume_m3 <= kg <= _ODD_KG_M3[1] * volume_m3
                return Mass(kg, "quantity", stated_odd=odd)
            refused = True
        volume = None if exact else _first(stated, _VOLUMES)
        if volume is not None:
            stated_m3 = volume * self._m3_per_unit
            wrong_volume = not least_m3 <= stated_m3 <= most_m3
            volume_m3 = volume_m3 if wrong_volume else stated_m3
        density = self._density(product)
        source = "default" if density is None else "density"
        kg = volume_m3 * (DEFAULT_DENSITY_KG_M3 if density is None else density)
        return Mass(kg, source, refused, volume_refused=wrong_volume)

    def _density(self, product: Any) -> float | None:
        """Return the mean density of the layers with a known density, weighted by thickness; None if there are none."""
        known = [(self._density_of(material), thickness) for material, thickness in layers_of(product)]
        pairs = [(density, thickness) for density, thickness in known if density is not None]
        total = sum(thickness for _, thickness in pairs)
        return sum(density * thickness for density, thickness in pairs) / total if total > 0 else None

    def _density_of(self, material: Any) -> float | None:
        key = material.id()
        if key not in self._density_by_material:
            stated = self._old_densities.get(key)
            if stated is None and getattr(material, "HasProperties", None):
                stated = element_util.get_pset(material, "Pset_MaterialCommon", "MassDensity")
            density = stated * self._density_per_unit if isinstance(stated, int | float) else None
            if density is None or not _PLAUSIBLE_KG_M3[0] <= density <= _PLAUSIBLE_KG_M3[1]:
                density = density_by_name(label(material.Name))
            self._density_by_material[key] = density
        return self._density_by_material[key]


def weakest(sources: Sequence[str]) -> str:
    """Return the least reliable of several mass sources."""
    return max(sources, key=SOURCES.index)


def _first(sets: dict[str, dict[str, Any]], names: Sequence[str]) -> float | None:
    """Return the first positive number under one of these names, earlier names first."""
    found: dict[str, float] = {}
    for values in sets.values():
        for key, value in values.items():
            name = key.lower().replace(" ", "").replace("_", "")
            if name in names and isinstance(value, int | float) and not isinstance(value, bool) and 0 < value < _MOST:
                found.setdefault(name, float(value))
    return next((found[name] for name in names if name in found), None)


def _scale(file: Any, unit_type: str, base: float) -> float:
    """Return one project unit in kg, m3 or kg/m3; 1.0 if the project does not state it."""
    assignment = file.by_type("IfcProject")[0].UnitsInContext
    for unit in assignment.Units if assignment else ():
        if getattr(unit, "UnitType", None) == unit_type:
            return (si_scale(unit) or 1.0) * base
    return 1.0
