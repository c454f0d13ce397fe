"""The largest area that a part shows the wind, from its triangles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from bimvox.bim.building import TriangleMesh

_DIRECTIONS = 36
_LYING = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])


def sail_area_m2(mesh: TriangleMesh, *, tipped: bool = False) -> float:
    """Return the largest area that a part shows the wind, which blows level, from whichever side.

    Per direction of the wind (every 5 degrees; opposite ones are the same) the smaller of two areas that the outline
    cannot exceed: half of what all faces show (exact for convex parts), and what the hull around the part shows (small
    for parts with many inner faces).

    Args:
        mesh: The part as it is built in; metres.
        tipped: Whether it is hoisted lying too, and tipped up: its area as it lies then counts as well.
    """
    areas = [_largest(mesh.triangles_m, mesh.vertices_m)]
    if tipped:
        areas.append(_largest(mesh.triangles_m @ _LYING.T, mesh.vertices_m @ _LYING.T))
    return max(areas)


def _largest(triangles_m: NDArray[np.float64], vertices_m: NDArray[np.float64]) -> float:
    angles = np.arange(_DIRECTIONS) * (np.pi / _DIRECTIONS)
    along = np.stack([np.cos(angles), np.sin(angles), np.zeros(_DIRECTIONS)], axis=1)
    shown = _shown(triangles_m, along)
    try:
        hull = ConvexHull(vertices_m)
    except QhullError:  # a flat part: its faces say it all
        return float(shown.max(initial=0.0))
    return float(np.minimum(shown, _shown(vertices_m[hull.simplices], along)).max())


def _shown(triangles_m: NDArray[np.float64], along: NDArray[np.float64]) -> NDArray[np.float64]:
    """(D,) half of the area that triangles ((N, 3, 3)) show in each direction: a closed surface shows it twice."""
    normals = 0.5 * np.cross(triangles_m[:, 1] - triangles_m[:, 0], triangles_m[:, 2] - triangles_m[:, 0])
    half: NDArray[np.float64] = 0.5 * np.abs(normals @ along.T).sum(axis=0)
    return half
