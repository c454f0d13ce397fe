"""Lifting points of a part whose model has none, or whose anchors are not where a sling can use them.

All of it is assumed: a part's designer decides where its anchors are. A long part hangs on two points on its long axis,
a wide one on four, each halfway between the centre of mass and the end; a small one, and one that is upended, on one
point above the centre of mass.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh

Point = tuple[float, float, float]

SMALL_M = 1.0
"""A part that is nowhere longer on plan hangs on one point."""
NARROW_M = 0.8
"""A part that is no wider on plan hangs on points in one line."""
_AROUND_M = 0.25
"""Anchors hold a part level if its centre of mass is between them, or no further outside than this."""
MOST_POINTS = 4


def assumed_points(
    mesh: TriangleMesh, hook_m: tuple[float, float], top_m: float, *, upended: bool
) -> tuple[Point, ...]:
    """Return lifting points on the top of a part, metres in its frame: one, two or four.

    Args:
        mesh: Its triangles, in the orientation in which it hangs.
        hook_m: (x, y) of its centre of mass.
        top_m: Height of its top, where no triangle is below a point.
        upended: Whether it hangs on its end.
    """
    corners = _plan_box(mesh)
    one, two = corners[1] - corners[0], corners[3] - corners[0]
    long, wide = (one, two) if np.hypot(*one) >= np.hypot(*two) else (two, one)
    length_m, width_m = float(np.hypot(*long)), float(np.hypot(*wide))
    if upended or length_m <= SMALL_M:
        return ((*hook_m, top_m),)
    hook = np.array(hook_m)
    along = long / length_m * _halfway_m(corners, hook, long / length_m)
    places = [hook - along, hook + along]
    if width_m > NARROW_M:
        across = wide / width_m * _halfway_m(corners, hook, wide / width_m)
        places = [place + side for place in places for side in (-across, across)]
    return tuple((float(x), float(y), _top_at_m(mesh, (float(x), float(y)), top_m)) for x, y in places)


def usable_anchors(anchors_m: Sequence[Point], hook_m: tuple[float, float]) -> tuple[Point, ...]:
    """Return the anchors on which a part can hang level: at most the four outermost; empty if there are none."""
    points = tuple(dict.fromkeys(anchors_m))
    if len(points) > MOST_POINTS:
        off = np.array(points)[:, :2] - np.array(hook_m)
        outermost = [int(np.argmax(off @ side)) for side in np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]], float)]
        points = tuple(points[n] for n in sorted(set(outermost)))
    if not points:
        return ()
    hull = shapely.MultiPoint([point[:2] for point in points]).convex_hull
    return points if hull.distance(shapely.Point(hook_m)) <= _AROUND_M else ()


def _plan_box(mesh: TriangleMesh) -> NDArray[np.float64]:
    """Return the (4, 2) corners of the smallest box around a part on plan."""
    low, high = mesh.bounds_m
    outline = shapely.MultiPoint(mesh.vertices_m[:, :2]).convex_hull
    if outline.geom_type != "Polygon":
        return np.array([[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]])
    square = np.array([[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]])
    if outline.area >= (1.0 - 1e-6) * float(np.prod(high[:2] - low[:2])):
        return square
    return np.asarray(shapely.minimum_rotated_rectangle(outline).exterior.coords)[:4]


def _halfway_m(corners: NDArray[np.float64], hook: NDArray[np.float64], axis: NDArray[np.float64]) -> float:
    """Return half the distance from the hook to the nearer end of the box along an axis."""
    ends = (corners - hook) @ axis
    return max(0.0, min(-float(ends.min()), float(ends.max()))) / 2.0


def _top_at_m(mesh: TriangleMesh, at_m: tuple[float, float], otherwise_m: float) -> float:
    """Return the height of a part's surface at a point on plan."""
    a, b, c = (mesh.vertices_m[mesh.faces[:, n]] for n in range(3))
    det = (b[:, 1] - c[:, 1]) * (a[:, 0] - c[:, 0]) + (c[:, 0] - b[:, 0]) * (a[:, 1] - c[:, 1])
    with np.errstate(divide="ignore", invalid="ignore"):
        x, y = at_m[0] - c[:, 0], at_m[1] - c[:, 1]
        u = ((b[:, 1] - c[:, 1]) * x + (c[:, 0] - b[:, 0]) * y) / det
        v = ((c[:, 1] - a[:, 1]) * x + (a[:, 0] - c[:, 0]) * y) / det
        inside = (np.abs(det) > 1e-12) & (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1.0 + 1e-9)
        heights = (u * a[:, 2] + v * b[:, 2] + (1.0 - u - v) * c[:, 2])[inside]
    return float(heights.max()) if len(heights) else otherwise_m
