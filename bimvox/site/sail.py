"""Sail area of a part, from its triangles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from bimvox.bim.building import TriangleMesh

_DIRECTIONS = 36
_LYING = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])


def sail_area_m2(mesh: TriangleMesh, *, tipped: bool = False) -> float:
    """Return the largest area that a part presents to a horizontal wind from any direction, m2.

    Per wind direction (every 5 degrees; opposite ones are the same) it is the smaller of two upper bounds of the
    outline's area: the projected area of all faces, and that of the convex hull (smaller for parts with many inner
    faces). A closed surface covers its outline twice, so half of its projected area counts (exact for convex parts).

    Args:
        mesh: The part in its orientation in the building; metres.
        tipped: Whether it is upended: then its area while it lies counts too.
    """
    areas = [_largest(mesh.triangles_m, mesh.vertices_m)]
    if tipped:
        areas.append(_largest(mesh.triangles_m @ _LYING.T, mesh.vertices_m @ _LYING.T))
    return max(areas)


def _largest(triangles_m: NDArray[np.float64], vertices_m: NDArray[np.float64]) -> float:
    angles = np.arange(_DIRECTIONS) * (np.pi / _DIRECTIONS)
    along = np.stack([np.cos(angles), np.sin(angles), np.zeros(_DIRECTIONS)], axis=1)
    shown = _shown(triangles_m, along) * (1.0 if _is_closed(triangles_m) else 2.0)
    try:
        hull = ConvexHull(vertices_m)
    except QhullError:  # a flat part has no hull: its faces are exact
        return float(shown.max(initial=0.0))
    return float(np.minimum(shown, _shown(vertices_m[hull.simplices], along)).max())


def _is_closed(triangles_m: NDArray[np.float64]) -> bool:
    """Return whether an even number of (N, 3, 3) triangles meets at every edge: then every line crosses them evenly."""
    _, corners = np.unique(triangles_m.reshape(-1, 3), axis=0, return_inverse=True)
    edges = np.sort(corners.reshape(-1, 3)[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _, counts = np.unique(edges[edges[:, 0] != edges[:, 1]], axis=0, return_counts=True)
    return not (counts % 2).any()


def _shown(triangles_m: NDArray[np.float64], along: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (D,) half the projected area of (N, 3, 3) triangles per direction: a closed surface counts it twice."""
    normals = 0.5 * np.cross(triangles_m[:, 1] - triangles_m[:, 0], triangles_m[:, 2] - triangles_m[:, 0])
    half: NDArray[np.float64] = 0.5 * np.abs(normals @ along.T).sum(axis=0)
    return half
