"""Boxes around a part: along its own main directions, upright, and laid flat for the lorry that takes it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from bimvox.bim.building import TriangleMesh
from bimvox.kept import kept


@kept
def own_sides_m(mesh: TriangleMesh) -> tuple[float, float, float]:
    """Return the sides of the box around a mesh along its main directions, metres, the shortest first."""
    points_m = mesh.vertices_m[np.unique(mesh.faces)]
    spread = points_m - points_m.mean(axis=0)
    _, axes = np.linalg.eigh(spread.T @ spread)
    a, b, c = sorted(float(side) for side in np.ptp(spread @ axes, axis=0))
    return a, b, c


@kept
def plan_sides_m(mesh: TriangleMesh) -> tuple[float, float]:
    """Return the sides of the smallest rectangle around a mesh in plan, metres, the shorter first."""
    outline = _outline(mesh.vertices_m[:, :2])
    edges = np.roll(outline, -1, axis=0) - outline
    lengths = np.hypot(*edges.T)
    along = edges[lengths > 0.0] / lengths[lengths > 0.0, None]
    if len(along):
        first = outline @ along.T
        second = outline @ np.stack([-along[:, 1], along[:, 0]])
        spans = np.stack([np.ptp(first, axis=0), np.ptp(second, axis=0)])
        plan = spans[:, int(np.argmin(np.round(spans.prod(axis=0), 6)))]
    else:
        plan = np.ptp(outline, axis=0)
    short_m, long_m = sorted(plan.tolist())
    return short_m, long_m


def _outline(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the corners of the convex outline of (N, 2) points; of their box if they are on a line."""
    try:
        return np.asarray(points[ConvexHull(points).vertices], np.float64)
    except (QhullError, ValueError):
        (x0, y0), (x1, y1) = points.min(axis=0), points.max(axis=0)
        return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])


def sizes_m(mesh: TriangleMesh) -> tuple[float, float, float]:
    """Return the edges of a part's smallest upright box, the longest first; it may be turned about the vertical."""
    low, high = mesh.bounds_m
    x, y, z = sorted((*plan_sides_m(mesh), float(high[2] - low[2])), reverse=True)
    return x, y, z


def boxes_m(mesh: TriangleMesh) -> tuple[tuple[float, float, float], ...]:
    """Return the boxes in which a part can be brought, the smaller one first; one of them if they are the same."""
    return tuple(dict.fromkeys((laid_flat_m(mesh), sizes_m(mesh))))


def laid_flat_m(mesh: TriangleMesh) -> tuple[float, float, float]:
    """Return the edges of the smaller of two boxes, the longest first: upright, and along a part's own main directions.

    A brace or a rafter is set at a slope, but no lorry carries it like that.
    """
    z, y, x = own_sides_m(mesh)
    return min((sizes_m(mesh), (x, y, z)), key=lambda sizes: round(float(np.prod(sizes)), 6))
