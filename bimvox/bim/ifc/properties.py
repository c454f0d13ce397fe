"""Properties of an element other than its geometry: type, storey, material, status, mass."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import ifcopenshell.util.element as element_util
import ifcopenshell.util.unit as unit_util

from bimvox.bim.densities import DEFAULT_DENSITY_KG_M3, density_by_name

# Net before gross: a gross weight is that of the stock before cuts and openings (50 % more on one cut balcony).
_WEIGHTS = (
    *("netweight", "nettogewicht", "poidsnet", "pesonetto", "weight", "mass", "gewicht", "masse", "massa", "poids"),
    *("peso", "grossweight", "bruttogewicht", "poidsbrut", "pesobruto", "pesolordo"),
)
_VOLUMES = ("netvolume", "nettovolumen", "volume", "volumen", "grossvolume", "bruttovolumen")
_PLAUSIBLE_KG_M3 = (5.0, 23000.0)
"""From insulation to above lead: a stated weight that gives a density outside this has a wrong number or unit."""
_ODD_KG_M3 = (50.0, 12000.0)
"""A stated weight that gives a density outside this is used, with a note."""
SOURCES = ("quantity", "density", "default")
"""Where a mass comes from, most reliable first."""


@dataclass(frozen=True, slots=True)
class Mass:
    """A mass, its source, and whether a stated weight was refused as impossible, or used although it is odd."""

    kg: float
    source: str
    stated_refused: bool = False
    stated_odd: bool = False


class Properties:
    """Looks properties up in one file.

    Args:
        file: The ``ifcopenshell.file``.
    """

    def __init__(self, file: Any) -> None:
        self._kg_per_unit = _scale(file, "MASSUNIT", base=1e-3)
        self._m3_per_unit = _scale(file, "VOLUMEUNIT", base=1.0)
        self._density_per_unit = _scale(file, "MASSDENSITYUNIT", base=1e-3)
        self._density_by_material: dict[int, float | None] = {}
        self._sets: dict[int, dict[str, dict[str, Any]]] = {}
        self._old_densities: dict[int, float] = {}
        if file.schema == "IFC2X3":
            for properties in file.by_type("IfcGeneralMaterialProperties"):
                if properties.MassDensity:
                    self._old_densities[properties.Material.id()] = float(properties.MassDensity)

    def type_name(self, product: Any) -> str | None:
        """Return the name of its type; None if it has none."""
        kind = element_util.get_type(product)
        return str(kind.Name) if kind is not None and kind.Name else None

    def material(self, product: Any) -> str | None:
        """Return the name of its material, or of its thickest layer's material; None if it has none."""
        layers = self._layers(product)
        named = [(thickness, material) for material, thickness in layers if (material.Name or "").strip()]
        return str(max(named, key=lambda layer: layer[0])[1].Name).strip() if named else None

    def predefined_type(self, product: Any) -> str | None:
        """Return the predefined type of the product or its type (IFC2X3 plates and members have it only there)."""
        found = element_util.get_predefined_type(product)
        return str(found).upper() if found else None

    def is_existing(self, product: Any) -> bool:
        """Return whether its common property set states that it already exists (``Status``)."""
        for properties in self.sets_of(product).values():
            status = properties.get("Status")
            for value in status if isinstance(status, list | tuple) else (status,):
                if str(value).upper() in ("EXISTING", "DEMOLISH"):
                    return True
        return False

    def mass(self, product: Any, volume_m3: float, exact: bool) -> Mass:
        """Return the mass of one product.

        A stated weight comes first, then volume times density of its material, then volume times default density.

        Args:
            product: The ``IfcProduct``.
            volume_m3: Volume of its mesh.
            exact: Whether that volume is exact; if not, a stated volume replaces it.
        """
        stated = self.sets_of(product)
        weight = _first(stated, _WEIGHTS)
        refused = False
        if weight is not None:
            kg = weight * self._kg_per_unit
            low, high = _PLAUSIBLE_KG_M3
            if volume_m3 == 0.0 or not exact:
                return Mass(kg, "quantity")
            if low <= kg / volume_m3 <= high:
                return Mass(kg, "quantity", stated_odd=not _ODD_KG_M3[0] <= kg / volume_m3 <= _ODD_KG_M3[1])
            refused = True
        if not exact:
            volume = _first(stated, _VOLUMES)
            volume_m3 = volume * self._m3_per_unit if volume is not None else volume_m3
        density = self._density(product)
        if density is None:
            return Mass(volume_m3 * DEFAULT_DENSITY_KG_M3, "default", refused)
        return Mass(volume_m3 * density, "density", refused)

    def sets_of(self, product: Any) -> dict[str, dict[str, Any]]:
        """Return the property and quantity sets of a product and its type (cached: the look-up is slow)."""
        if product.id() not in self._sets:
            self._sets[product.id()] = element_util.get_psets(product)
        return self._sets[product.id()]

    def _density(self, product: Any) -> float | None:
        """Return the mean density of the layers with a known density, weighted by thickness; None if there are none."""
        known = [(self._density_of(material), thickness) for material, thickness in self._layers(product)]
        pairs = [(density, thickness) for density, thickness in known if density is not None]
        total = sum(thickness for _, thickness in pairs)
        return sum(density * thickness for density, thickness in pairs) / total if total > 0 else None

    def _density_of(self, material: Any) -> float | None:
        key = material.id()
        if key not in self._density_by_material:
            stated = self._old_densities.get(key)
            if stated is None and getattr(material, "HasProperties", None):
                stated = element_util.get_pset(material, "Pset_MaterialCommon", "MassDensity")
            density = float(stated) * self._density_per_unit if stated else None
            if density is None or not _PLAUSIBLE_KG_M3[0] <= density <= _PLAUSIBLE_KG_M3[1]:
                density = density_by_name(str(material.Name or ""))
            self._density_by_material[key] = density
        return self._density_by_material[key]

    def _layers(self, product: Any) -> list[tuple[Any, float]]:
        """Return (material, weight) of its layers; only the first if the shares are not stated."""
        material = element_util.get_material(product, should_skip_usage=True)
        if material is None:
            return []
        if material.is_a("IfcMaterial"):
            return [(material, 1.0)]
        if material.is_a("IfcMaterialLayerSet"):
            layers = [(layer.Material, float(layer.LayerThickness or 0.0)) for layer in material.MaterialLayers]
        elif material.is_a("IfcMaterialProfileSet"):
            layers = [(profile.Material, 1.0) for profile in material.MaterialProfiles][:1]
        elif material.is_a("IfcMaterialConstituentSet"):
            constituents = material.MaterialConstituents or ()
            layers = [(constituent.Material, float(constituent.Fraction or 0.0)) for constituent in constituents]
            if not any(share for _, share in layers):
                layers = [(part, 1.0) for part, _ in layers][:1]
        elif material.is_a("IfcMaterialList"):
            layers = [(part, 1.0) for part in material.Materials][:1]
        else:
            return []
        return [(part, weight) for part, weight in layers if part is not None]


def weakest(sources: Sequence[str]) -> str:
    """Return the least reliable of several mass sources."""
    return max(sources, key=SOURCES.index)


def _first(sets: dict[str, dict[str, Any]], names: Sequence[str]) -> float | None:
    """Return the first positive number under one of these names, earlier names first."""
    found: dict[str, float] = {}
    for values in sets.values():
        for key, value in values.items():
            name = key.lower().replace(" ", "").replace("_", "")
            if name in names and isinstance(value, int | float) and not isinstance(value, bool) and value > 0:
                found.setdefault(name, float(value))
    return next((found[name] for name in names if name in found), None)


def _scale(file: Any, unit_type: str, base: float) -> float:
    """Return one project unit in kg, m3 or kg/m3; 1.0 if the project does not state it."""
    assignment = file.by_type("IfcProject")[0].UnitsInContext
    for unit in assignment.Units if assignment else ():
        if getattr(unit, "UnitType", None) == unit_type:
            return float(unit_util.get_unit_scale(unit)) * base
    return 1.0
