"""The content of a building model, as plain values."""

from __future__ import annotations

from collections import Counter, defaultdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bimvox.site.map_frame import ifc_to_map
from bimvox_pipeline.inspect.site import default_site_to_ifc

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bimvox.bim.building import Building
    from bimvox.site.kind_rows import KindRow


def describe_building(building: Building) -> dict[str, Any]:
    """Return format, units, counts by class and storey, bounds, transforms and skipped products."""
    from bimvox.voxelization.lattice import cell_count, default_voxel_size_m

    source = building.source
    bounds_m = building.bounds_m
    world_m = bounds_m + building.origin_m
    voxel_size_m = default_voxel_size_m(bounds_m)
    return {
        "format": source.format,
        "unit": source.unit,
        "unit_assumed": source.unit_assumed,
        "sha256": source.sha256,
        "elements": len(building.elements),
        "roles": dict(Counter(element.role.value for element in building.elements)),
        "mass_t": round(sum(element.mass_kg for element in building.elements) / 1000, 3),
        "classes": _classes(building),
        "kinds": [row.to_dict() for row in kinds_of(building)],
        "storeys": _storeys(building),
        "bounds_m": rounded_m(world_m),
        "size_m": rounded_m(bounds_m[1] - bounds_m[0]),
        "default_voxel_size_m": voxel_size_m,
        "default_cells": cell_count(bounds_m, voxel_size_m),
        "origin_m": rounded_m(building.origin_m),
        "georeference": dict(building.georeference),
        "site_to_ifc": default_site_to_ifc(building),
        "ifc_to_map": ifc_to_map(building.georeference, source.unit),
        "skipped": [
            {"ifc_class": ifc_class, "products": count, "reason": reason}
            for (ifc_class, reason), count in Counter(
                (item.ifc_class, item.reason) for item in building.skipped
            ).items()
        ],
        "notes": list(building.notes),
    }


def kinds_of(building: Building) -> tuple[KindRow, ...]:
    """Return what the parts of a model are, by type, as its site file would have it by default."""
    from bimvox.site.config.site_config import ModelConfig, SiteConfig
    from bimvox.site.kind_rows import kind_rows

    return kind_rows(SiteConfig(model=ModelConfig(path=Path(building.source.name))), building)


def _classes(building: Building) -> list[dict[str, Any]]:
    """Count elements by class and role, the most numerous first."""
    masses_kg: dict[tuple[str, str], list[float]] = defaultdict(list)
    for element in building.elements:
        masses_kg[element.ifc_class, element.role.value].append(element.mass_kg)
    found = sorted(masses_kg.items(), key=lambda item: (-len(item[1]), item[0]))
    return [
        {
            "ifc_class": ifc_class,
            "role": role,
            "elements": len(kilograms),
            "heaviest_t": round(max(kilograms) / 1000, 3),
            "all_t": round(sum(kilograms) / 1000, 3),
        }
        for (ifc_class, role), kilograms in found
    ]


def _storeys(building: Building) -> list[dict[str, Any]]:
    """Count elements by storey, with the heights that they span, from the bottom up."""
    heights: dict[str, list[NDArray[Any]]] = defaultdict(list)
    for element in building.elements:
        if element.storey is not None:
            heights[element.storey].append(element.mesh.bounds_m[:, 2] + building.origin_m[2])
    storeys = [
        {
            "storey": name,
            "elements": len(spans),
            "from_m": round(min(float(span[0]) for span in spans), 3),
            "to_m": round(max(float(span[1]) for span in spans), 3),
        }
        for name, spans in heights.items()
    ]
    return sorted(storeys, key=lambda storey: (storey["from_m"], storey["storey"]))


def rounded_m(metres: NDArray[Any]) -> Any:
    """Return plain numbers, to the tenth of a millimetre; those that rounding would make infinite stay as they are."""
    import numpy as np

    with np.errstate(over="ignore"):
        rounded = metres.round(4) + 0.0
    return np.where(np.isfinite(rounded), rounded, metres).tolist()
