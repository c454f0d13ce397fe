"""The content of a building model, as plain values."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bimvox.crane.machine import identity
from bimvox.errors import FileError
from bimvox.exporters.text import table
from bimvox.files import check_output, write_atomically
from bimvox.site.config.kind_file import SELECT, SET_KIND, SET_MEANS
from bimvox.site.map_frame import ifc_to_map

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bimvox.bim.building import Building
    from bimvox.crane.tower_crane import TowerCrane
    from bimvox.progress import Progress
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
        "kinds": [row.to_dict() for row in _kinds_of(building)],
        "storeys": _storeys(building),
        "bounds_m": rounded_m(world_m),
        "size_m": rounded_m(bounds_m[1] - bounds_m[0]),
        "default_voxel_size_m": voxel_size_m,
        "default_cells": cell_count(bounds_m, voxel_size_m),
        "origin_m": rounded_m(building.origin_m),
        "georeference": dict(building.georeference),
        "site_to_ifc": _default_site_to_ifc(building),
        "ifc_to_map": ifc_to_map(building.georeference, source.unit),
        "skipped": [
            {"ifc_class": ifc_class, "products": count, "reason": reason}
            for (ifc_class, reason), count in Counter(
                (item.ifc_class, item.reason) for item in building.skipped
            ).items()
        ],
        "notes": list(building.notes),
    }


def _kinds_of(building: Building) -> tuple[KindRow, ...]:
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


# A site file with all defaults resolved: extent, areas, cranes, and its place in the model and on a map.


def describe_site(path: Path, progress: Progress) -> dict[str, Any]:
    """Return the description of a site, from its file and model.

    Raises:
        ConfigError: If the site file is wrong.
        InputError: If its model cannot be used.
    """
    import numpy as np

    from bimvox.bim.building import Role
    from bimvox.bim.read import read_building
    from bimvox.site.config.file import load_site_config
    from bimvox.site.guess import complete_config
    from bimvox.site.kind_rows import kind_rows
    from bimvox.site.machine import cranes_of
    from bimvox.site.map_frame import ifc_to_map, set_out
    from bimvox.site.placement import place_building, site_extent

    stated = load_site_config(path)
    model = stated.model
    building = read_building(model.path, stated.read_options, progress.report)
    progress.stage("describe")
    config = complete_config(stated, building)
    placed, site_to_ifc = place_building(config, building)
    cranes = cranes_of(config)
    frame, shape = site_extent(config, placed, *cranes)
    pinned = {entry.global_id for entry in config.component if entry.pinned}
    lifted = [
        one
        for one in placed.elements
        if one.role is Role.COMPONENT and not pinned.intersection((one.id, one.global_id))
    ]
    to_map = ifc_to_map(building.georeference, building.source.unit)
    return {
        "name": config.name,
        "model": str(model.path),
        "select": model.select,
        "assemblies": model.assemblies,
        "kinds": [row.to_dict() for row in kind_rows(config, building)],
        "corrections": [
            {"select": one.select, "kind": one.kind and one.kind.value, "means": one.means, "where": one.where}
            for one in stated.corrections
            if not one.one_part
        ],
        "components": len(lifted),
        "heaviest_t": round(max(one.mass_kg for one in lifted) / 1000, 3) if lifted else None,
        "shape": list(shape),
        "cells": int(np.prod(shape)),
        "voxel_size_m": frame.voxel_size_m,
        "origin_m": list(frame.origin_m),
        "crane": _crane(cranes[0]) if cranes else None,
        **({"cranes": [_crane(crane) for crane in cranes]} if len(cranes) > 1 else {}),
        "areas": config.areas.model_dump(mode="json"),
        "zones": len(config.zone),
        "rules": config.rules.model_dump(mode="json"),
        "policy": config.policy.model_dump(mode="json"),
        "georeference": dict(building.georeference),
        "site_to_ifc": (site_to_ifc + 0.0).tolist(),
        "ifc_to_map": to_map,
        "map": None if to_map is None else set_out(config, cranes, site_to_ifc, to_map),
        "notes": list(building.notes),
    }


def _crane(crane: TowerCrane) -> dict[str, Any]:
    return {
        **identity(crane),
        "base_m": list(crane.base_m),
        "jib_height_m": crane.jib_height_m,
        "capacity_at_jib_end_t": crane.chart.capacity_kg[-1] / 1000,
        "largest_capacity_t": crane.chart.capacity_kg[0] / 1000,
    }


def _default_site_to_ifc(building: Building) -> list[list[float]] | None:
    """Return the (4, 4) transform that `bimvox init` would give the site; None without elements on the ground."""
    import math

    from bimvox.site.config.site_config import ModelConfig, SiteConfig
    from bimvox.site.ground import ground_level
    from bimvox.site.placement import built_elements, dominant_yaw_rad, place_building

    if not built_elements(building.elements):
        return None
    model = ModelConfig(
        path=Path(building.source.name),
        yaw_deg=math.degrees(dominant_yaw_rad(building)),
        ground_m=ground_level(building).height_m,
    )
    # "+ 0.0" turns -0.0 into 0.0.
    matrix: list[list[float]] = (place_building(SiteConfig(model=model), building)[1] + 0.0).tolist()
    return matrix


# The types of a model as a CSV table, in which a person writes what is wrong.

_COLUMNS = ("ifc_class", "type", "material", "kind", "means")
_BYTE_ORDER_MARK = b"\xef\xbb\xbf"
"""Without it, spreadsheets do not see that the text is UTF-8."""


def check_kind_file(path: Path, inputs: Sequence[Path]) -> None:
    """Refuse to write a file of kinds over another one, which may hold corrections.

    Raises:
        FileError: If it exists already, or cannot be written.
    """
    check_output(path, inputs=inputs)
    if path.exists():
        raise FileError(path, "exists already and may hold your corrections", hint="name another file")


def write_kind_file(
    path: Path,
    rows: Sequence[Mapping[str, Any]],
    corrections: Sequence[Mapping[str, Any]],
    inputs: Sequence[Path],
) -> None:
    """Write the rows of a model's types; the columns ``set_kind`` and ``set_means`` are for a person.

    They hold what the site file says already, so that the table can take its place.

    Args:
        path: The file.
        rows: The ``kinds`` of a document.
        corrections: The ``corrections`` of a site's document; those of no row are rows of their own.
        inputs: Files that must not be overwritten.
    """
    said: dict[str, dict[str, Any]] = {}
    for one in corrections:
        own = said.setdefault(one["select"], {SET_KIND: "", SET_MEANS: ""})
        own |= {key: one[name] for key, name in ((SET_KIND, "kind"), (SET_MEANS, "means")) if one[name]}
    columns = (SET_KIND, SET_MEANS, "parts", *_COLUMNS, "from_kg", "to_kg", "confidence", "kind_from", SELECT)
    body = [
        (*_said(said, row["select"]), row["count"], *(row[key] for key in _COLUMNS), *map(round, row["mass_kg"] or ()),
         *("",) * (0 if row["mass_kg"] else 2),
         "way assumed" if row["assumed"] == ["way"] else row["confidence"], row["kind_from"], row["select"])
        for row in rows
    ]  # fmt: skip
    shown = {row["select"] for row in rows}
    empty = ("",) * (len(columns) - 3)
    body += [(*_said(said, select), *empty, select) for select in said if select not in shown]
    write_atomically(path, _BYTE_ORDER_MARK + table(columns, body).encode(), inputs=inputs)


def _said(said: Mapping[str, Mapping[str, Any]], select: str) -> tuple[str, str]:
    own = said.get(select, {})
    return own.get(SET_KIND, ""), own.get(SET_MEANS, "")
