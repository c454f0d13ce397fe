"""Where a load hangs above, and how far it may reach when it falls.

Below a load: the convex hull of the part on plan, swept along the track of the load in the log, turned and upended as
there. A load that keeps its heading gives the exact area; between two samples that turn it, the hull of both counts.

A falling load: the path of the middle of the load, widened by half its smallest side on plan, its longest side, and the
least distance that a falling load travels, by its height: the rule of the Russian building rules, as muzlitra.ru
("Опасная зона падения груза со здания") quotes it, with the table of the rules on consultant.ru (LAW_157709, table 1,
repealed there; interpolation permitted). The height is that of the load's lowest point above the ground.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from shapely.geometry.base import BaseGeometry

from bimvox.records.track import LoadTrack
from bimvox.site.component import Component
from bimvox.site.site import Site

FALL_M = ((10.0, 4.0), (20.0, 7.0), (70.0, 10.0), (120.0, 15.0), (200.0, 20.0), (300.0, 25.0), (450.0, 30.0))
"""Height of a fall up to which a load travels at least how far, metres."""

_SIMPLE_M = 0.02
_STEP_M = 0.25
"""Distances of falling loads are rounded up to this."""
_STILL = 1e-9

Floats = NDArray[np.float64]


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
        zones.append(shapely.MultiPoint(line).convex_hull.buffer(wide_m) if len(line) < 3 else _wide(line, wide_m))
    return shapely.union_all(zones)


def fall_distance_m(height_m: Floats) -> Floats:
    """Return how far a load travels at least when it falls; above the table in proportion to its end."""
    heights, distances = np.array(FALL_M).T
    beyond = np.maximum(height_m - heights[-1], 0.0) * distances[-1] / heights[-1]
    found: Floats = np.interp(height_m, heights, distances) + beyond
    return found


def reach_of(component: Component) -> float:
    """Return half the smallest side of a part on plan, and its longest side, metres."""
    vertices = component.mesh.vertices_m[np.unique(component.mesh.faces)]
    box = shapely.get_coordinates(shapely.MultiPoint(vertices[:, :2]).minimum_rotated_rectangle)
    sides = np.linalg.norm(np.diff(box, axis=0), axis=1) if len(box) > 2 else np.array([0.0, float(np.ptp(box))])
    return float(sides.min() / 2.0 + max(sides.max(), np.ptp(vertices[:, 2])))


def _held(site: Site, track: LoadTrack) -> tuple[Floats, Floats, Rotation]:
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


def _wide(line: Floats, wide_m: float) -> BaseGeometry:
    return shapely.LineString(line).buffer(wide_m, quad_segs=8)


def _path(points: Floats) -> Floats:
    """Return a path without what does not change it; at least two points."""
    line = shapely.LineString(points).simplify(_SIMPLE_M)
    found: Floats = shapely.get_coordinates(line)
    return found
