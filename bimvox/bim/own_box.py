"""The box around a part along its own main directions, however it is turned."""

from __future__ import annotations

import numpy as np

from bimvox.bim.building import TriangleMesh


def own_sides_m(mesh: TriangleMesh) -> tuple[float, float, float]:
    """Return the sides of the box around a mesh along its main directions, metres, the shortest first."""
    points_m = mesh.vertices_m[np.unique(mesh.faces)]
    spread = points_m - points_m.mean(axis=0)
    _, axes = np.linalg.eigh(spread.T @ spread)
    a, b, c = sorted(float(side) for side in np.ptp(spread @ axes, axis=0))
    return a, b, c
