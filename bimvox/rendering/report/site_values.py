"""What every drawing of a site shows, as plain values in site metres: storeys, cranes, distances, north, map."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from math import atan2, pi
from typing import Any, Protocol

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from bimvox.bim.building import TriangleMesh
from bimvox.crane.load_chart import capacity_kg
from bimvox.crane.outline import outline_of
from bimvox.crane.tower_crane import TowerCrane
from bimvox.site.outlines import FRONT, PLAN, SIDE, hull, outline, rounded, union

_RINGS = 7
_STEPS_M = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0)
_NAMES = {PLAN: "plan", FRONT: "front", SIDE: "side"}


Axes = tuple[int, int]


class Part(Protocol):
    """A part of the building: a component of a site, or an element of a model."""

    @property
    def storey(self) -> str | None:
        """Name of its storey, if any."""
        ...

    @property
    def mesh(self) -> TriangleMesh:
        """Its triangles in the site frame."""
        ...


def storeys_of(parts: Iterable[Part], views: Sequence[Axes] = (PLAN, FRONT, SIDE)) -> list[dict[str, Any]]:
    """Return the outlines of the building by storey in these views, the lowest first."""
    meshes: dict[str, list[TriangleMesh]] = {}
    for part in parts:
        meshes.setdefault(part.storey or "", []).append(part.mesh)
    found = []
    for name, group in meshes.items():
        bounds = np.array([mesh.bounds_m for mesh in group])
        found.append(
            {
                "name": name,
                "parts": len(group),
                "low_m": round(float(bounds[:, 0, 2].min()), 3),
                "high_m": round(float(bounds[:, 1, 2].max()), 3),
                **outlines_of(group, views),
            }
        )
    return sorted(found, key=lambda one: (one["low_m"], one["high_m"], one["name"]))


def outlines_of(meshes: Sequence[TriangleMesh], views: Sequence[Axes] = (PLAN, FRONT, SIDE)) -> dict[str, Any]:
    """Return the outline of meshes from above (``plan``), along +y (``front``) and along -x (``side``)."""
    return {_NAMES[axes]: outline(union(hull(mesh, axes) for mesh in meshes)) for axes in views}


def crane_values(crane: TowerCrane, storeys: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return a crane's place, sizes, and capacities at round radii (``rings``: metres and kilograms)."""
    own, top_m = outline_of(crane), max((one["high_m"] for one in storeys), default=None)
    low, high = crane.min_radius_m, crane.jib_length_m
    step = next((step for step in _STEPS_M if (high - low) / step <= _RINGS), _STEPS_M[-1])
    radii = [low, *(n * step for n in range(1, int(high / step) + 1) if low + step / 2 < n * step < high - step / 3)]
    radii.append(high)
    return {
        "name": crane.name,
        "base_m": list(crane.base_m),
        "mast_m": crane.mast_size_m,
        "jib_m": [own.jib_end_m, *own.jib_m],
        "tail_m": own.tail_m,
        "highest_m": max(own.jib_m[1], own.mast_height_m[1]),
        "below_jib_m": None if top_m is None or own.luffs else round(own.jib_m[0] - top_m, 3),
        "hook_height_m": crane.highest_hook_m,
        "slew_rad": list(crane.working_range.slew_rad) if crane.working_range.slew_rad else None,
        "rings": [[radius_m, float(capacity_kg(crane.chart, radius_m))] for radius_m in radii],
    }


def distances(cranes: Sequence[TowerCrane], building: BaseGeometry, yard: BaseGeometry) -> list[dict[str, Any]]:
    """Return the shortest distances on plan between crane axes, building and yard, with their ends."""
    axes = [(crane.name, shapely.Point(crane.base_m[:2])) for crane in cranes]
    pairs = [(f"{name} to building", axis, building) for name, axis in axes]
    pairs += [(f"{name} to yard", axis, yard) for name, axis in axes]
    pairs.append(("building to yard", building, yard))
    found = []
    for name, first, second in pairs:
        if first.is_empty or second.is_empty:
            continue
        line = shapely.shortest_line(first, second)
        ends = [rounded(at) for at in shapely.get_coordinates(line)]
        found.append({"name": name, "ends_m": ends, "distance_m": round(float(line.length), 3)})
    return found


def north_of(georeference: Mapping[str, Any], site_to_ifc: NDArray[np.float64]) -> dict[str, Any] | None:
    """Return the direction of north: true north if the model states it, otherwise the map's."""
    yaw_rad = atan2(site_to_ifc[1, 0], site_to_ifc[0, 0])
    for key, kind, sign in (("true_north_rad", "true north", 1.0), ("x_axis_yaw_rad", "map north", -1.0)):
        angle = georeference.get(key)
        if isinstance(angle, int | float):
            return {"kind": kind, "angle_rad": pi / 2.0 + sign * angle - yaw_rad}
    return None


def survey_grid(
    georeference: Mapping[str, Any], ifc_to_map: Sequence[Sequence[float]] | None, site_to_ifc: NDArray[np.float64]
) -> dict[str, Any] | None:
    """Return the map's grid over the site: its name (``crs``) and ``site_to_map``; None without a map conversion."""
    if ifc_to_map is None:
        return None
    site_to_map: list[list[float]] = (np.array(ifc_to_map) @ site_to_ifc).tolist()
    return {"crs": georeference.get("crs"), "site_to_map": site_to_map}
