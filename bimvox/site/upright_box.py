"""The smallest upright box around a part, and the one around it when it is laid flat: what a lorry must take."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from bimvox.bim.building import TriangleMesh
from bimvox.bim.own_box import own_sides_m


def sizes_m(mesh: TriangleMesh) -> tuple[float, float, float]:
    """Return the edges of a part's smallest upright box, the longest first; it may be turned about the vertical."""
    low, high = mesh.bounds_m
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
        plan = (high - low)[:2]
    x, y, z = sorted((*plan.tolist(), float(high[2] - low[2])), reverse=True)
    return x, y, z


def laid_flat_m(mesh: TriangleMesh) -> tuple[float, float, float]:
    """Return the edges of the smaller of two boxes, the longest first: upright, and along a part's own main directions.

    A brace or a rafter is set at a slope, but no lorry carries it like that.
    """
    z, y, x = own_sides_m(mesh)
    return min((sizes_m(mesh), (x, y, z)), key=lambda sizes: round(float(np.prod(sizes)), 6))


def _outline(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the corners of the convex outline of (N, 2) points; of their box if they are on a line."""
    try:
        return np.asarray(points[ConvexHull(points).vertices], np.float64)
    except (QhullError, ValueError):
        (x0, y0), (x1, y1) = points.min(axis=0), points.max(axis=0)
        return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])
