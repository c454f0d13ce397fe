"""What the drawings of a lift plan show, as plain values in site metres: computed from the log alone.

An outline is a list of rings; a ring is a list of [x, y] corners, or of [along, z] corners in an elevation. Parts and
structure are drawn by the convex hull of their vertices.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from contextlib import suppress
from math import atan2, pi
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from bimvox.bim.building import TriangleMesh
from bimvox.crane.load_chart import capacity_kg
from bimvox.crane.outline import outline_of
from bimvox.crane.tower_crane import TowerCrane
from bimvox.grid.labels import Label
from bimvox.proof.racks import frames_of
from bimvox.records.lift import Status
from bimvox.rendering.page.source import Revision
from bimvox.rendering.report.exclusion import below_load, fall_zone
from bimvox.site.site import Blocker, Site

Outline = list[list[list[float]]]
PLAN, FRONT, SIDE = (0, 1), (0, 2), (1, 2)
"""The two axes of a drawing: from above, along +y, along -x."""

_GEOREFERENCE = "georeference"
"""Key of a log's metadata: the model's map conversion as JSON."""
_RINGS = 7
_STEPS_M = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0)
_SIMPLE_M = 0.02
"""Outlines are simplified by this much."""


def drawing_of(revision: Revision) -> dict[str, Any]:
    """Return what the drawings show.

    Returns:
        ``extent_m`` (lowest and highest corner of the site), ``north`` (``kind`` and angle from the site's +x axis,
        or None), ``areas`` with ``areas_m2``, ``obstructions``, ``structure``, ``storeys``, ``stored`` parts,
        ``frames`` of racks, ``cranes`` with their radii and capacities, ``below_loads`` (where a load hangs above),
        ``falling_loads`` (what one may reach when it falls) and ``distances_m`` on plan.
    """
    site = revision.plan.site
    low = np.array(site.frame.origin_m)
    high = low + np.array(site.shape) * site.frame.voxel_size_m
    building = _union(_hull(component.mesh, PLAN) for component in site.components)
    yard, storeys = _columns(site, site.yard), _storeys(site)
    areas, (below, falling) = _areas(site, yard), _hanging(revision)
    return {
        "extent_m": [_rounded(low), _rounded(high)],
        "north": _north(revision),
        "areas": {name: _outline(shape) for name, shape in areas.items() if not shape.is_empty},
        "obstructions": [_blocker(site, one) for one in site.blockers if one.kind == "obstruction"],
        "structure": {
            _name(axes): _outline(_union(_hull(one.mesh, axes) for one in site.blockers if one.mesh))
            for axes in (PLAN, FRONT, SIDE)
        },
        "storeys": storeys,
        "stored": _stored(revision),
        "frames": _frames(revision),
        "cranes": [_crane(crane, storeys) for crane in site.cranes],
        "below_loads": _outline(below),
        "falling_loads": _outline(falling),
        "areas_m2": _sizes(site, areas, below, falling),
        "distances_m": _distances(site, building, yard),
    }


def _name(axes: tuple[int, int]) -> str:
    return {PLAN: "plan", FRONT: "front", SIDE: "side"}[axes]


def _areas(site: Site, yard: BaseGeometry) -> dict[str, BaseGeometry]:
    """Return the areas on the ground by their kind."""
    heights = site.hook_heights
    limited = None if heights is None else np.isfinite(heights.low_m) | np.isfinite(heights.high_m)
    return {
        "construction": _columns(site, site.labels[:, :, 0] == Label.CONSTRUCTION_AREA),
        "yard": yard,
        "access": _columns(site, site.access),
        "prohibited": _columns(site, site.prohibited),
        "no_load": _columns(site, site.no_load),
        "limiter": _columns(site, limited),
        "slow": _union(shapely.Polygon(zone.polygon) for crane in site.cranes for zone in crane.slow_zones),
    }


def _sizes(site: Site, areas: dict[str, BaseGeometry], below: BaseGeometry, falling: BaseGeometry) -> dict[str, float]:
    """Return the areas of loads and below the jib, and how much of them is outside construction area and yard."""
    own = areas["construction"].union(areas["yard"]).union(areas["access"])
    sweeps = (shapely.Point(c.base_m[:2]).buffer(outline_of(c).jib_end_m, quad_segs=64) for c in site.cranes)
    sizes = {
        "below_loads": below.area,
        "below_outside": below.difference(own).area,
        "falling": falling.area,
        "falling_outside": falling.difference(own).area,
        "oversail": _union(sweeps).difference(own).area,
    }
    return {name: round(float(size), 1) for name, size in sizes.items()}


def _blocker(site: Site, blocker: Blocker) -> dict[str, Any]:
    size_m, origin = site.frame.voxel_size_m, np.array(site.frame.origin_m)
    columns = np.zeros(site.shape[:2], np.bool_)
    columns[blocker.cells[:, 0], blocker.cells[:, 1]] = True
    low, high = blocker.cells.min(axis=0) * size_m + origin, (blocker.cells.max(axis=0) + 1) * size_m + origin
    return {"id": blocker.id, "outline": _outline(_columns(site, columns)), "box_m": [_rounded(low), _rounded(high)]}


def _storeys(site: Site) -> list[dict[str, Any]]:
    """Return the outlines of the building by storey, the lowest first."""
    meshes: dict[str, list[TriangleMesh]] = {}
    for component in site.components:
        meshes.setdefault(component.storey or "", []).append(component.mesh)
    found = []
    for name, group in meshes.items():
        bounds = np.array([mesh.bounds_m for mesh in group])
        found.append(
            {
                "name": name,
                "parts": len(group),
                "low_m": round(float(bounds[:, 0, 2].min()), 3),
                "high_m": round(float(bounds[:, 1, 2].max()), 3),
                **{_name(axes): _outline(_union(_hull(m, axes) for m in group)) for axes in (PLAN, FRONT, SIDE)},
            }
        )
    return sorted(found, key=lambda one: (one["low_m"], one["high_m"], one["name"]))


def _stored(revision: Revision) -> list[dict[str, Any]]:
    """Return the boxes of the parts in the yard, with lift and delivery."""
    frame, found = revision.plan.site.frame, []
    for lift in revision.lifts:
        if lift.place is None or lift.status is not Status.PLANNED:
            continue
        low = np.array(frame.corner_of(lift.place.cell_vox))[:2]
        high = low + np.array(lift.place.shape.size_vox[:2]) * frame.voxel_size_m
        found.append(
            {"number": lift.number, "delivery": lift.place.delivery + 1, "box_m": [_rounded(low), _rounded(high)]}
        )
    return found


def _frames(revision: Revision) -> list[dict[str, Any]]:
    """Return the boxes of the frames of racks, with delivery and number."""
    site = revision.plan.site
    size_m, origin = site.frame.voxel_size_m, np.array(site.frame.origin_m[:2])
    lifts = [lift for lift in revision.lifts if lift.status is Status.PLANNED]
    return [
        {
            "delivery": delivery + 1,
            "rack": rack,
            "box_m": [_rounded(origin + low * size_m), _rounded(origin + (high + 1) * size_m)],
        }
        for (delivery, rack), (low, high) in sorted(frames_of(site, lifts).items())
    ]


def _crane(crane: TowerCrane, storeys: list[dict[str, Any]]) -> dict[str, Any]:
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


def _hanging(revision: Revision) -> tuple[BaseGeometry, BaseGeometry]:
    """Return where a load hangs above, and what it may reach when it falls; empty without a crane."""
    site, driven = revision.plan.site, {motion.order for motion in revision.motions}
    tracks = [track for track in revision.tracks if track.lift.order in driven]
    return _union(below_load(site, track) for track in tracks), _union(fall_zone(site, track) for track in tracks)


def _distances(site: Site, building: BaseGeometry, yard: BaseGeometry) -> list[dict[str, Any]]:
    """Return the shortest distances on plan between crane axes, building and yard, with their ends."""
    axes = [(crane.name, shapely.Point(crane.base_m[:2])) for crane in site.cranes]
    pairs = [(f"{name} to building", axis, building) for name, axis in axes]
    pairs += [(f"{name} to yard", axis, yard) for name, axis in axes]
    pairs.append(("building to yard", building, yard))
    found = []
    for name, first, second in pairs:
        if first.is_empty or second.is_empty:
            continue
        line = shapely.shortest_line(first, second)
        ends = [_rounded(at) for at in shapely.get_coordinates(line)]
        found.append({"name": name, "ends_m": ends, "distance_m": round(float(line.length), 3)})
    return found


def _north(revision: Revision) -> dict[str, Any] | None:
    """Return the direction of north: true north if the model states it, otherwise the map's."""
    given: dict[str, Any] = {}
    with suppress(ValueError):
        loaded = json.loads(revision.metadata.get(_GEOREFERENCE, "{}"))
        given = loaded if isinstance(loaded, dict) else {}
    to_ifc = revision.plan.site.site_to_ifc
    yaw_rad = atan2(to_ifc[1, 0], to_ifc[0, 0])
    for key, kind, sign in (("true_north_rad", "true north", 1.0), ("x_axis_yaw_rad", "map north", -1.0)):
        angle = given.get(key)
        if isinstance(angle, int | float):
            return {"kind": kind, "angle_rad": pi / 2.0 + sign * angle - yaw_rad}
    return None


def _hull(mesh: TriangleMesh, axes: tuple[int, int]) -> BaseGeometry:
    return shapely.MultiPoint(mesh.vertices_m[np.unique(mesh.faces)][:, axes]).convex_hull


def _columns(site: Site, columns: NDArray[np.bool_] | None) -> BaseGeometry:
    """Return (X, Y) columns as an area."""
    if columns is None or not columns.any():
        return shapely.Polygon()
    size_m, (x0, y0, _) = site.frame.voxel_size_m, site.frame.origin_m
    edges = np.diff(np.pad(columns, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    (row, start), (_, end) = np.nonzero(edges == 1), np.nonzero(edges == -1)
    low_x, low_y, high_y = x0 + row * size_m, y0 + start * size_m, y0 + end * size_m
    return shapely.union_all(shapely.box(low_x, low_y, low_x + size_m, high_y), grid_size=1e-6)


def _union(shapes: Iterable[BaseGeometry]) -> BaseGeometry:
    return shapely.union_all([shape for shape in shapes if shape.area > 0.0])


def _outline(shape: BaseGeometry) -> Outline:
    parts = shapely.get_parts(shape.simplify(_SIMPLE_M))
    polygons = [part for part in parts if isinstance(part, shapely.Polygon) and not part.is_empty]
    rings = [ring for polygon in polygons for ring in (polygon.exterior, *polygon.interiors)]
    return [[_rounded(at) for at in ring.coords[:-1]] for ring in rings]


def _rounded(values: Iterable[float]) -> list[float]:
    return [round(float(value), 3) + 0.0 for value in values]
