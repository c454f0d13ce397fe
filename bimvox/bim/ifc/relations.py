"""Relations between the parts of an IFC file: connections and storeys.

None of them orders two parts by itself. A connection gives a part support if nothing below carries it. Storeys are
erected from the bottom up.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import ifcopenshell.util.element as element_util
import ifcopenshell.util.placement as placement_util

from bimvox.bim.building import Storey
from bimvox.bim.ifc.text import label


def connected_products(file: Any) -> Iterator[tuple[int, int]]:
    """Yield step ids of two products that ``IfcRelConnectsElements`` or a subtype of it connects, in file order.

    Realizing elements (bolts, plates) count as connected to both.
    """
    for relation in file.by_type("IfcRelConnectsElements"):
        first, second = relation.RelatingElement, relation.RelatedElement
        if first is None or second is None:
            continue
        yield first.id(), second.id()
        for realizing in getattr(relation, "RealizingElements", None) or ():
            yield first.id(), realizing.id()
            yield second.id(), realizing.id()


def element_pairs(pairs: Iterator[tuple[int, int]], element_of: Mapping[int, str]) -> tuple[tuple[str, str], ...]:
    """Return connected products as pairs of different elements, without duplicates, sorted.

    Args:
        pairs: Step ids of products.
        element_of: Element id by step id of a product.
    """
    found = set()
    for first, second in pairs:
        one, other = element_of.get(first), element_of.get(second)
        if one is not None and other is not None and one != other:
            found.add((one, other) if one < other else (other, one))
    return tuple(sorted(found))


def storey_of(product: Any) -> Any | None:
    """Return the ``IfcBuildingStorey`` that contains a product; None if there is none."""
    place = element_util.get_container(product)
    seen: set[int] = set()
    while place is not None and place.id() not in seen:
        seen.add(place.id())
        if place.is_a("IfcBuildingStorey"):
            return place
        place = element_util.get_aggregate(place)
    return None


def storey_height(storey: Any) -> float:
    """Return the height of an ``IfcBuildingStorey`` or an ``IfcBuilding``, in the file's length unit."""
    if storey.ObjectPlacement is not None:
        return float(placement_util.get_local_placement(storey.ObjectPlacement)[2, 3])
    return float(getattr(storey, "Elevation", None) or 0.0)


def storeys_of(file: Any, metres_per_unit: float) -> tuple[Storey, ...]:
    """Return the storeys of a file, in its order."""
    return tuple(
        Storey(
            label(storey.Name),
            round(float(storey.Elevation or 0.0) * metres_per_unit, 6),
            round(storey_height(storey) * metres_per_unit, 6),
        )
        for storey in file.by_type("IfcBuildingStorey")
    )


def stated_terrain_m(file: Any, metres_per_unit: float) -> float | None:
    """Return the height of the terrain in world coordinates, as an ``IfcBuilding`` states it; None if none does.

    Both of its elevations are above sea level; the reference height is that of its own zero. Two zeros are what
    exporters write for nothing.
    """
    for building in file.by_type("IfcBuilding"):
        terrain, zero = building.ElevationOfTerrain, building.ElevationOfRefHeight
        if terrain is not None and zero is not None and (terrain or zero):
            return round((storey_height(building) + float(terrain) - float(zero)) * metres_per_unit, 6)
    return None
