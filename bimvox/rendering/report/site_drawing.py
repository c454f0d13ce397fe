"""What the drawing of a site shows before there is a plan: from the site file and the building alone."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from math import atan2, dist, pi
from typing import Any, Protocol

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from bimvox.bim.building import Building, Element, Role, TriangleMesh
from bimvox.crane.load_chart import capacity_kg
from bimvox.crane.outline import outline_of
from bimvox.crane.tower_crane import TowerCrane
from bimvox.rendering.report.plan_view import ZONES
from bimvox.site.areas import FRONT, PLAN, SIDE, hull, outline, rounded, union
from bimvox.site.config.site_config import SiteConfig
from bimvox.site.crane_distances import FOUNDATION_DEEP_M, base_of
from bimvox.site.ground import WORKING_SPACE_M
from bimvox.site.guess import ground_why, lifted_of
from bimvox.site.machine import cranes_of
from bimvox.site.map_frame import ifc_to_map
from bimvox.site.parts import entries_by_id
from bimvox.site.placement import built_bounds_m, place_building

HEAVIEST = 8
"""How many masses are named; of parts with the same mass (to 10 kg) the one that is furthest from the crane."""
_KINDS = {"public": ("prohibited", "no_load")}
"""A public zone forbids both."""
_ROOM_M = 2.5
"""Margin around all that is drawn."""
_DEPTH_M = 1e-3
_OFF_M = 0.6
"""Distance of the building's dimensions from it."""


def drawing_of_site(config: SiteConfig, building: Building) -> dict[str, Any]:
    """Return what the plan of a site shows, with the keys of ``site_plan.drawing_of`` but without lifts.

    Also ``parts`` (outlines from above, each once), ``heavy`` parts (``number``, ``name``, ``mass_kg``, ``plan``,
    ``at_m``), named ``zones`` (``name``, ``at_m``), ``lifted``, the number of parts that cranes lift, and
    ``ground``, its height in the model, and why. The site file is complete, in the site's frame; the building is as
    read.

    Raises:
        ConfigError: If the site file does not fit the building.
        SelectionError: If there is nothing to lift.
    """
    placed, site_to_ifc = place_building(config, building)
    entries, cranes = entries_by_id(config, placed.elements), cranes_of(config)
    standing = {name for name, entry in entries.items() if entry.pinned}
    parts = [one for one in placed.elements if one.role is Role.COMPONENT and one.id not in standing]
    structure = [one for one in placed.elements if one.role is Role.STRUCTURE or one.id in standing]
    storeys, outlines = storeys_of(parts, (PLAN,)), {one.id: outline(hull(one.mesh, PLAN)) for one in parts}
    areas = _areas(config) | {"excavation": _excavation(parts)}
    whole, lifted = union(hull(one.mesh, PLAN) for one in parts), lifted_of(config, placed)
    to_map = ifc_to_map(building.georeference, building.source.unit)
    return {
        "extent_m": _extent_m(config, placed, cranes),
        "north": north_of(building.georeference, site_to_ifc),
        "survey": survey_grid(building.georeference, to_map, site_to_ifc),
        "areas": {kind: outline(shape) for kind, shape in areas.items() if not shape.is_empty},
        "obstructions": [],
        "structure": outlines_of([one.mesh for one in structure], (PLAN,)),
        "storeys": storeys,
        "parts": list({str(one): one for one in outlines.values() if one}.values()),  # storeys repeat their parts
        "heavy": _heavy(lifted, cranes, outlines),
        "lifted": len(lifted),
        "ground": (config.model.ground_m, ground_why(config, building)),
        "zones": [_named(zone.name, zone.polygon) for zone in config.zone if zone.name],
        "stored": [],
        "frames": [],
        "cranes": [crane_values(crane, storeys) for crane in cranes],
        "below_loads": [],
        "falling_loads": [],
        "distances_m": [*distances(cranes, whole, areas["yard"]), *_sides(whole)],
    }


def _areas(config: SiteConfig) -> dict[str, BaseGeometry]:
    """Return the areas on the ground by their kind."""
    areas, zones = config.areas, config.zone
    polygons = {"construction": [areas.construction] if areas.construction else [], "yard": [*(areas.yard or ())]}
    polygons["access"] = [*(areas.access or ())]
    for kind in ZONES:
        polygons[kind] = [zone.polygon for zone in zones if kind in _KINDS.get(zone.kind, (zone.kind,))]
    found = {kind: union(map(shapely.Polygon, given)) for kind, given in polygons.items()}
    return found | {"yard": found["yard"].difference(found["construction"])}


def _excavation(parts: Iterable[Element]) -> BaseGeometry:
    """Return where the ground is dug out for what is set below z = 0, about: its cells are not known yet."""
    below = [hull(one.mesh, PLAN) for one in parts if one.mesh.bounds_m[0, 2] < -_DEPTH_M]
    return shapely.union_all(below).buffer(WORKING_SPACE_M, join_style="mitre") if below else shapely.Polygon()


def _extent_m(config: SiteConfig, placed: Building, cranes: Sequence[TowerCrane]) -> list[list[float]]:
    """Return the lowest and the highest corner of all that is drawn; it may be larger than any grid that is planned."""
    built, areas = built_bounds_m(placed.elements), config.areas
    points = [*built[:, :2].tolist(), *(areas.construction or ())]
    points += [at for polygon in (*(areas.yard or ()), *(areas.access or ())) for at in polygon]
    points += [at for zone in config.zone for at in zone.polygon]
    points += [crane.base_m[:2] for crane in cranes]
    points += [config.grid.low_m[:2], config.grid.high_m[:2]] if config.grid else []
    plan = np.array(points, np.float64)
    low, high = plan.min(axis=0) - _ROOM_M, plan.max(axis=0) + _ROOM_M
    return [rounded((*low, built[0, 2])), rounded((*high, built[1, 2]))]


def _heavy(
    lifted: Sequence[Element], cranes: Sequence[TowerCrane], outlines: dict[str, list[Any]]
) -> list[dict[str, Any]]:
    """Return the heaviest parts that are lifted, the heaviest first."""

    def away_m(one: Element) -> float:
        x, y, _ = one.mesh.bounds_m.mean(axis=0)
        return min((dist((x, y), crane.base_m[:2]) for crane in cranes), default=0.0)

    by_mass: dict[int, Element] = {}
    for one in sorted(lifted, key=lambda one: (-one.mass_kg, -away_m(one), one.id)):
        by_mass.setdefault(round(one.mass_kg / 10.0), one)
    return [
        {
            "number": number,
            "name": one.name or one.id,
            "mass_kg": one.mass_kg,
            "plan": outlines[one.id],
            "at_m": rounded(one.mesh.bounds_m.mean(axis=0)[:2]),
        }
        for number, one in enumerate(list(by_mass.values())[:HEAVIEST], 1)
    ]


def _named(name: str | None, polygon: Sequence[Sequence[float]]) -> dict[str, Any]:
    at = shapely.Polygon(polygon).representative_point()
    return {"name": name, "at_m": rounded((at.x, at.y))}


def _sides(building: BaseGeometry) -> list[dict[str, Any]]:
    """Return the building's length along x and along y, as dimensions below and to the left of it."""
    if building.is_empty:
        return []
    x0, y0, x1, y1 = building.bounds
    below, left = y0 - _OFF_M, x0 - _OFF_M
    return [
        {
            "name": "building along x",
            "ends_m": [rounded((x0, below)), rounded((x1, below))],
            "distance_m": round(x1 - x0, 3),
        },
        {
            "name": "building along y",
            "ends_m": [rounded((left, y0)), rounded((left, y1))],
            "distance_m": round(y1 - y0, 3),
        },
    ]


# What every drawing of a site shows, as plain values in site metres: storeys, cranes, distances, north, map.

_RINGS = 7
_STEPS_M = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0)
_NAMES = {PLAN: "plan", FRONT: "front", SIDE: "side"}


_Axes = tuple[int, int]


class _Part(Protocol):
    """A part of the building: a component of a site, or an element of a model."""

    @property
    def storey(self) -> str | None:
        """Name of its storey, if any."""
        ...

    @property
    def mesh(self) -> TriangleMesh:
        """Its triangles in the site frame."""
        ...


def storeys_of(parts: Iterable[_Part], views: Sequence[_Axes] = (PLAN, FRONT, SIDE)) -> list[dict[str, Any]]:
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


def outlines_of(meshes: Sequence[TriangleMesh], views: Sequence[_Axes] = (PLAN, FRONT, SIDE)) -> dict[str, Any]:
    """Return the outline of meshes from above (``plan``), along +y (``front``) and along -x (``side``)."""
    return {_NAMES[axes]: outline(union(hull(mesh, axes) for mesh in meshes)) for axes in views}


def crane_values(crane: TowerCrane, storeys: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return a crane's place, sizes, what it stands on, and capacities at round radii (metres and kilograms)."""
    own, base, top_m = outline_of(crane), base_of(crane), max((one["high_m"] for one in storeys), default=None)
    low, high = crane.min_radius_m, crane.jib_length_m
    step = next((step for step in _STEPS_M if (high - low) / step <= _RINGS), _STEPS_M[-1])
    radii = [low, *(n * step for n in range(1, int(high / step) + 1) if low + step / 2 < n * step < high - step / 3)]
    radii.append(high)
    return {
        "name": crane.name,
        "base_m": list(crane.base_m),
        "mast_m": crane.mast_size_m,
        "base": {"words": base_in_words(crane), "plan": outline(_square(crane, base.edge_m))}
        | {"deep_m": 0.0 if crane.kind == "mobile" else FOUNDATION_DEEP_M},
        "jib_m": [own.jib_end_m, *own.jib_m],
        "tail_m": own.tail_m,
        "highest_m": max(own.jib_m[1], own.mast_height_m[1]),
        "below_jib_m": None if top_m is None or own.luffs else round(own.jib_m[0] - top_m, 3),
        "hook_height_m": crane.highest_hook_m,
        "slew_rad": list(crane.working_range.slew_rad) if crane.working_range.slew_rad else None,
        "rings": [[radius_m, float(capacity_kg(crane.chart, radius_m))] for radius_m in radii],
    }


def base_in_words(crane: TowerCrane) -> str:
    """Return what a crane stands on, in words."""
    if crane.kind == "mobile":
        return "outriggers"
    return "foundation" if base_of(crane).stated else "foundation, assumed"


def _square(crane: TowerCrane, edge_m: float) -> BaseGeometry:
    x, y, _ = crane.base_m
    return shapely.box(x - edge_m / 2.0, y - edge_m / 2.0, x + edge_m / 2.0, y + edge_m / 2.0)


def distances(cranes: Sequence[TowerCrane], building: BaseGeometry, yard: BaseGeometry) -> list[dict[str, Any]]:
    """Return the shortest distances on plan between masts (or outriggers), building and yard, with their ends."""
    faces = ["outriggers" if crane.kind == "mobile" else "mast's face" for crane in cranes]
    squares = [_square(crane, crane.mast_size_m) for crane in cranes]
    masts = [(f"{crane.name}, {face}", square) for crane, face, square in zip(cranes, faces, squares, strict=True)]
    pairs = [(f"{name} to building", mast, building) for name, mast in masts]
    pairs += [(f"{name} to yard", mast, yard) for name, mast in masts]
    pairs.append(("building to yard", building, yard))
    result = []
    for name, first, second in pairs:
        if first.is_empty or second.is_empty:
            continue
        line = shapely.shortest_line(first, second)
        ends = [rounded(at) for at in shapely.get_coordinates(line)]
        result.append({"name": name, "ends_m": ends, "distance_m": round(float(line.length), 3)})
    return result


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
