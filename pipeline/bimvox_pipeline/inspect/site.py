"""A site file with all defaults resolved: extent, areas, cranes, and its place in the model and on a map."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from bimvox.crane.machine import identity

if TYPE_CHECKING:
    from bimvox.bim.building import Building
    from bimvox.crane.tower_crane import TowerCrane
    from bimvox.progress import Progress


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
    from bimvox.site.extent import site_extent
    from bimvox.site.guess import complete_config
    from bimvox.site.kind_rows import kind_rows
    from bimvox.site.machine import cranes_of
    from bimvox.site.map_frame import ifc_to_map, set_out
    from bimvox.site.placement import place_building

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


def default_site_to_ifc(building: Building) -> list[list[float]] | None:
    """Return the (4, 4) transform that `bimvox init` would give the site; None without elements on the ground."""
    import math

    from bimvox.site.config.site_config import ModelConfig, SiteConfig
    from bimvox.site.ground_level import ground_level
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
