"""Properties of an element other than its geometry and mass: type, material, status."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import ifcopenshell.util.element as element_util

from bimvox.bim.building import Casting
from bimvox.bim.ifc.text import label
from bimvox.bim.kinds.words import casting_by_name, density_by_name

_MOST = 1e15
"""A larger number is not a quantity, in any unit."""


@dataclass(frozen=True, slots=True)
class Stated:
    """A number that a file states.

    Attributes:
        value: The number.
        measure: The IFC class of the value, or of the quantity.
        unit: Its own ``IfcUnit``; None if that of the project counts.
    """

    value: float
    measure: str = "IfcReal"
    unit: Any = None


class Properties:
    """Looks properties up in one file."""

    def __init__(self) -> None:
        self._sets: dict[int, dict[str, dict[str, Any]]] = {}

    def type_name(self, product: Any) -> str | None:
        """Return the name of its type; None if it has none."""
        kind = element_util.get_type(product)
        return label(kind.Name) or None if kind is not None else None

    def material(self, product: Any) -> str | None:
        """Return the name of its material, or of its thickest layer's material; None if it has none."""
        layers = layers_of(product)
        named = [(thickness, material) for material, thickness in layers if (material.Name or "").strip()]
        return label(max(named, key=lambda layer: layer[0])[1].Name).strip() if named else None

    def predefined_type(self, product: Any) -> str | None:
        """Return the predefined type of the product or its type (IFC2X3 plates and members have it only there)."""
        found = element_util.get_predefined_type(product)
        return str(found).upper() if found else None

    def classes(self, product: Any) -> list[str]:
        """Return the names of the classifications of a product itself."""
        references = (
            association.RelatingClassification
            for association in getattr(product, "HasAssociations", ()) or ()
            if association.is_a("IfcRelAssociatesClassification")
        )
        return [name for one in references if (name := label(getattr(one, "Name", None)))]

    def is_existing(self, product: Any) -> bool:
        """Return whether its property sets state that it already exists (``Status``)."""
        return not {"EXISTING", "DEMOLISH"}.isdisjoint(self._statuses(product))

    def is_demolished(self, product: Any) -> bool:
        """Return whether its property sets state that it exists and goes (``Status``)."""
        return "DEMOLISH" in self._statuses(product)

    def is_temporary(self, product: Any) -> bool:
        """Return whether its property sets state that it does not stay (``Status``)."""
        return "TEMPORARY" in self._statuses(product)

    def _statuses(self, product: Any) -> set[str]:
        stated = [properties.get("Status") for properties in self.sets_of(product).values()]
        return {
            str(one).upper() for status in stated for one in (status if isinstance(status, list | tuple) else (status,))
        }

    def sets_of(self, product: Any) -> dict[str, dict[str, Any]]:
        """Return the property and quantity sets of a product and its type (cached: the look-up is slow)."""
        if product.id() not in self._sets:
            found = element_util.get_psets(product)  # names may be missing
            self._sets[product.id()] = {
                label(name): {label(key): value for key, value in values.items()} for name, values in found.items()
            }
        return self._sets[product.id()]

    def stated(self, product: Any, names: Sequence[str], *, negative: bool = False) -> list[Stated]:
        """Return the numbers under these names: earlier names first, then those of the product before its type's.

        Args:
            product: The ``IfcProduct``.
            names: In lower case, without blanks and underscores.
            negative: Whether negative numbers are returned too.
        """
        if not any(_plain_key(key) in names for values in self.sets_of(product).values() for key in values):
            return []
        found = [
            (names.index(name), stated)
            for definition in _definitions(product)
            for name, stated in numbers_in(definition)
            if name in names and (negative or stated.value > 0.0)
        ]
        return [stated for _, stated in sorted(found, key=lambda pair: pair[0])]


def numbers_in(definition: Any) -> Iterator[tuple[str, Stated]]:
    """Yield the numbers other than 0 in a set of properties or quantities, by name in lower case without blanks."""
    for entry in getattr(definition, "Quantities", None) or ():
        if entry.is_a("IfcPhysicalSimpleQuantity") and _is_number(entry[3]):
            yield _plain_key(label(entry.Name)), Stated(float(entry[3]), entry.is_a(), entry.Unit)
    for entry in getattr(definition, "HasProperties", None) or getattr(definition, "Properties", None) or ():
        value = entry.NominalValue if entry.is_a("IfcPropertySingleValue") else None
        if value is not None and _is_number(value.wrappedValue):
            yield _plain_key(label(entry.Name)), Stated(float(value.wrappedValue), value.is_a(), entry.Unit)


def _definitions(product: Any) -> Iterator[Any]:
    """Yield the property and quantity sets of a product, then those of its type."""
    for relation in getattr(product, "IsDefinedBy", None) or ():
        if relation.is_a("IfcRelDefinesByProperties"):
            definition = relation.RelatingPropertyDefinition
            yield from definition.wrappedValue if definition.is_a("IfcPropertySetDefinitionSet") else (definition,)
    kind = element_util.get_type(product)
    yield from (getattr(kind, "HasPropertySets", None) or ()) if kind is not None else ()


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and 0 < abs(value) < _MOST


def _plain_key(name: str) -> str:
    """Return the name of a property in lower case, without blanks and underscores."""
    return name.lower().replace(" ", "").replace("_", "")


def has_thickness(product: Any) -> bool:
    """Return whether the weights of a product's layers are their thicknesses."""
    material = element_util.get_material(product, should_skip_usage=True)
    return material is not None and material.is_a("IfcMaterialLayerSet")


def layers_of(product: Any) -> list[tuple[Any, float]]:
    """Return (material, weight) of a product's layers; without shares only the first one that is not insulation."""
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
            layers = [(part, 1.0) for part, _ in sorted(layers, key=lambda layer: _is_insulation(layer[0]))][:1]
    elif material.is_a("IfcMaterialList"):
        layers = [(part, 1.0) for part in sorted(material.Materials, key=_is_insulation)][:1]
    else:
        return []
    return [(part, weight) for part, weight in layers if part is not None]


INSULATION_KG_M3 = 60.0
"""A part whose mean density is below this is a layer of insulation or air modelled as a slab, wall or plate: it is
laid by hand. (The lightest layer that is lifted is a stud layer, about 100 kg/m3.)"""


def _is_insulation(material: Any) -> bool:
    """Return whether a material is insulation by its name: without shares, it is not what a part is made of."""
    kg_m3 = None if material is None else density_by_name(label(material.Name))
    return kg_m3 is not None and kg_m3 < INSULATION_KG_M3


_STATED = ("castingmethod", "constructionmethod", "castunittype")
"""Properties that state it: ``Pset_ConcreteElementGeneral`` of IFC4 and of IFC2X3, and Tekla's cast unit type."""
_PRECAST_SET = "Pset_PrecastConcreteElement"


def stated_casting(sets: Mapping[str, Mapping[str, Any]]) -> Casting | None:
    """Return how a part is cast, as its property sets state it; None if they do not."""
    for name, properties in sets.items():
        for key, value in properties.items():
            is_stated = _plain_key(key) in _STATED and isinstance(value, str)
            if is_stated and (result := casting_by_name(value)) is not None:
                return result
        if name.startswith(_PRECAST_SET):
            return Casting.PRECAST
    return None
