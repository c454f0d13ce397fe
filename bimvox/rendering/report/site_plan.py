"""What the drawings of a lift plan show, as plain values in site metres: computed from the log alone."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from shapely.geometry.base import BaseGeometry

from bimvox.crane.outline import outline_of
from bimvox.grid.frame import Label
from bimvox.proof.storage import frames_of
from bimvox.records.lift import Status
from bimvox.records.track import LoadTrack
from bimvox.rendering.page.source import Revision
from bimvox.rendering.report.site_drawing import crane_values, distances, north_of, outlines_of, storeys_of, survey_grid
from bimvox.site.areas import PLAN, area_of, hull, outline, rounded, union
from bimvox.site.component import Component
from bimvox.site.map_frame import map_of_model
from bimvox.site.site import Blocker, Site

GEOREFERENCE = "georeference"
"""Key of a log's metadata: the model's map conversion as JSON."""


def drawing_of(revision: Revision) -> dict[str, Any]:
    """Return what the drawings show.

    Returns:
        ``extent_m`` (lowest and highest corner of the site), ``north`` (``kind`` and angle from the site's +x axis,
        or None), ``survey`` (the map's grid, or None), ``areas`` with ``areas_m2``, ``obstructions``, ``structure``,
        ``storeys``, ``stored`` parts, ``frames`` of racks, ``cranes`` with their radii and capacities, ``below_loads``
        (where a load hangs above), ``falling_loads`` (what one may reach when it falls) and ``distances_m`` on plan.
    """
    site = revision.plan.site
    low = np.array(site.frame.origin_m)
    high = low + np.array(site.shape) * site.frame.voxel_size_m
    building = union(hull(component.mesh, PLAN) for component in site.components)
    yard, storeys = area_of(site, site.yard), storeys_of(site.components)
    areas, (below, falling) = _areas(site, yard), _hanging(revision)
    stated = revision.metadata.get(GEOREFERENCE, "")
    given = georeference_of(stated)
    return {
        "extent_m": [rounded(low), rounded(high)],
        "north": north_of(given, site.site_to_ifc),
        "survey": survey_grid(given, map_of_model(stated, site.source), site.site_to_ifc),
        "areas": {name: outline(shape) for name, shape in areas.items() if not shape.is_empty},
        "obstructions": [_blocker(site, one) for one in site.blockers if one.kind == "obstruction"],
        "structure": outlines_of([one.mesh for one in site.blockers if one.mesh]),
        "storeys": storeys,
        "stored": _stored(revision),
        "frames": _frames(revision),
        "cranes": [crane_values(crane, storeys) for crane in site.cranes],
        "below_loads": outline(below),
        "falling_loads": outline(falling),
        "areas_m2": _sizes(site, areas, below, falling),
        "distances_m": distances(site.cranes, building, yard),
    }


def _areas(site: Site, yard: BaseGeometry) -> dict[str, BaseGeometry]:
    """Return the areas on the ground by their kind."""
    heights = site.hook_heights
    limited = None if heights is None else np.isfinite(heights.low_m) | np.isfinite(heights.high_m)
    return {
        "construction": area_of(site, site.labels[:, :, 0] == Label.CONSTRUCTION_AREA),
        "yard": yard,
        "access": area_of(site, site.access),
        "excavation": area_of(site, site.dug_m > 1e-6),
        "prohibited": area_of(site, site.prohibited),
        "no_load": area_of(site, site.no_load),
        "limiter": area_of(site, limited),
        "slow": union(shapely.Polygon(zone.polygon) for crane in site.cranes for zone in crane.slow_zones),
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
        "oversail": union(sweeps).difference(own).area,
    }
    return {name: round(float(size), 1) for name, size in sizes.items()}


def _blocker(site: Site, blocker: Blocker) -> dict[str, Any]:
    size_m, origin = site.frame.voxel_size_m, np.array(site.frame.origin_m)
    columns = np.zeros(site.shape[:2], np.bool_)
    columns[blocker.cells[:, 0], blocker.cells[:, 1]] = True
    low, high = blocker.cells.min(axis=0) * size_m + origin, (blocker.cells.max(axis=0) + 1) * size_m + origin
    return {"id": blocker.id, "outline": outline(area_of(site, columns)), "box_m": [rounded(low), rounded(high)]}


def _stored(revision: Revision) -> list[dict[str, Any]]:
    """Return the boxes of the parts in the yard, with lift and delivery."""
    frame, result = revision.plan.site.frame, []
    for lift in revision.lifts:
        if lift.place is None or lift.status is not Status.PLANNED:
            continue
        low = np.array(frame.corner_of(lift.place.cell_vox))[:2]
        high = low + np.array(lift.place.shape.size_vox[:2]) * frame.voxel_size_m
        result.append(
            {"number": lift.number, "delivery": lift.place.delivery + 1, "box_m": [rounded(low), rounded(high)]}
        )
    return result


def _frames(revision: Revision) -> list[dict[str, Any]]:
    """Return the boxes of the frames of racks, with delivery and number."""
    site = revision.plan.site
    size_m, origin = site.frame.voxel_size_m, np.array(site.frame.origin_m[:2])
    lifts = [lift for lift in revision.lifts if lift.status is Status.PLANNED]
    return [
        {
            "delivery": delivery + 1,
            "rack": rack,
            "box_m": [rounded(origin + low * size_m), rounded(origin + (high + 1) * size_m)],
        }
        for (delivery, rack), (low, high) in sorted(frames_of(site, lifts).items())
    ]


def _hanging(revision: Revision) -> tuple[BaseGeometry, BaseGeometry]:
    """Return where a load hangs above, and what it may reach when it falls; empty without a crane."""
    site, driven = revision.plan.site, {motion.order for motion in revision.motions}
    tracks = [track for track in revision.tracks if track.lift.order in driven]
    return union(below_load(site, track) for track in tracks), union(fall_zone(site, track) for track in tracks)


def georeference_of(stated: str) -> dict[str, Any]:
    """Return the model's map conversion as a log states it; empty if it is damaged."""
    with suppress(ValueError):
        loaded = json.loads(stated or "{}")
        return loaded if isinstance(loaded, dict) else {}
    return {}


# Where a load hangs above, and how far it may reach when it falls.
#
# Below a load: the convex hull of the part on plan, swept along the track of the load in the log, turned and upended
# as there. A load that keeps its heading gives the exact area; between two samples that turn it, the hull of both
# counts.
#
# A falling load: the path of the middle of the load, widened by half its smallest side on plan, its longest side, and
# the least distance that a falling load travels, by its height: the rule of the Russian building rules, as
# muzlitra.ru ("Опасная зона падения груза со здания") quotes it, with the table of the rules on consultant.ru
# (LAW_157709, table 1, repealed there; interpolation permitted). The height is that of the load's lowest point above
# the ground.

FALL_M = ((10.0, 4.0), (20.0, 7.0), (70.0, 10.0), (120.0, 15.0), (200.0, 20.0), (300.0, 25.0), (450.0, 30.0))
"""Height of a fall up to which a load travels at least how far, metres."""

_SIMPLE_M = 0.02
_STEP_M = 0.25
"""Distances of falling loads are rounded up to this."""
_STILL = 1e-9

_Floats = NDArray[np.float64]


def below_load(site: Site, track: LoadTrack) -> BaseGeometry:
    """Return the area on plan above which a load hangs, widened by 2 cm for simplified paths."""
    outline_m, corner_m, turns = _held(site, track)
    pieces: list[BaseGeometry] = []
    still = np.abs(np.diff(track.tilt, axis=0)).max(axis=1, initial=0.0) < _STILL
    for first, last in _runs(still):
        if not still[first]:
            ends = [(turns[n].apply(outline_m) + corner_m[n])[:, :2] for n in (first, last)]
            pieces.append(shapely.MultiPoint(np.concatenate(ends)).convex_hull)
            continue
        own = turns[first].apply(outline_m)[:, :2]
        hull = shapely.get_coordinates(shapely.MultiPoint(own).convex_hull)
        line = _path(corner_m[first : last + 1, :2])
        swept = np.concatenate([hull + line[:-1, None], hull + line[1:, None]], axis=1)
        pieces.append(shapely.union_all(shapely.convex_hull(shapely.multipoints(swept))))
    return shapely.union_all(pieces).buffer(_SIMPLE_M, quad_segs=2)


def fall_zone(site: Site, track: LoadTrack) -> BaseGeometry:
    """Return the area on plan that a load may reach when it falls."""
    outline_m, corner_m, turns = _held(site, track)
    component = site.components[track.lift.component]
    middle_m = corner_m + turns.apply(outline_m.min(axis=0) / 2.0 + outline_m.max(axis=0) / 2.0)
    lowest_m = corner_m[:, 2] + (turns.as_matrix()[:, 2] @ outline_m.T).min(axis=1)
    reach_m = reach_of(component) + np.ceil(fall_distance_m(lowest_m) / _STEP_M) * _STEP_M
    zones = []
    for first, last in _runs(np.diff(reach_m) == 0.0):
        line = _path(middle_m[first : last + 1, :2])
        wide_m = float(reach_m[first : last + 1].max()) + _SIMPLE_M
        zones.append(
            shapely.MultiPoint(line).convex_hull.buffer(wide_m)
            if len(line) < 3
            else shapely.LineString(line).buffer(wide_m, quad_segs=8)
        )
    return shapely.union_all(zones)


def fall_distance_m(height_m: _Floats) -> _Floats:
    """Return how far a load travels at least when it falls; above the table in proportion to its end."""
    heights, distances = np.array(FALL_M).T
    beyond = np.maximum(height_m - heights[-1], 0.0) * distances[-1] / heights[-1]
    result: _Floats = np.interp(height_m, heights, distances) + beyond
    return result


def reach_of(component: Component) -> float:
    """Return half the smallest side of a part on plan, and its longest side, metres."""
    vertices = component.mesh.vertices_m[np.unique(component.mesh.faces)]
    box = shapely.get_coordinates(shapely.MultiPoint(vertices[:, :2]).minimum_rotated_rectangle)
    sides = np.linalg.norm(np.diff(box, axis=0), axis=1) if len(box) > 2 else np.array([0.0, float(np.ptp(box))])
    return float(sides.min() / 2.0 + max(sides.max(), np.ptp(vertices[:, 2])))


def _held(site: Site, track: LoadTrack) -> tuple[_Floats, _Floats, Rotation]:
    """Return the part's vertices in its frame, and the frame's origin and rotation at each sample while it hangs."""
    component = site.components[track.lift.component]
    vertices = component.mesh.vertices_m[np.unique(component.mesh.faces)]
    return vertices - np.array(site.frame.corner_of(component.target_vox)), track.corner_m, Rotation(track.tilt)


def _runs(same: NDArray[np.bool_]) -> Iterator[tuple[int, int]]:
    """Yield first and last sample of each run of equal neighbours, and of each pair of different ones."""
    first, count = 0, len(same)
    while first < count:
        last = first + 1
        while same[first] and last < count and same[last]:
            last += 1
        yield first, last
        first = last


def _path(points: _Floats) -> _Floats:
    """Return a path without what does not change it; at least two points."""
    line = shapely.LineString(points).simplify(_SIMPLE_M)
    result: _Floats = shapely.get_coordinates(line)
    return result
