"""Radii and masts of a machine on many places at once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.fit_luffing import pivoted
from bimvox.crane.reach import allowed_radii_m
from bimvox.crane.tower_crane import TowerCrane

MAST_CLEARANCE_M = 1.5
"""Free width between the mast and the building or the yard."""
HOOK_BLOCK_M = 2.0
"""Room between the highest hook and the rope exit: hook block and limit switch."""
MARGIN_M = 0.5
"""Distance by which points lie inside the radius limits."""


def radii_for_m(crane: TowerCrane, masses_kg: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (N, 2) the smallest and the largest radius at which a crane carries each mass."""
    different, which = np.unique(masses_kg, return_inverse=True)
    return np.array([allowed_radii_m(crane, float(mass)) for mass in different]).reshape(-1, 2)[which.ravel()]


def distances_m(bases_m: NDArray[np.float64], points_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (B, N) distances on plan."""
    return np.hypot(points_m[:, 0] - bases_m[:, 0, None], points_m[:, 1] - bases_m[:, 1, None])


def standing(machine: TowerCrane, height_under_hook_m: float) -> TowerCrane:
    """Return a machine on a mast so high that its hook reaches a height."""
    if machine.luffing is not None:
        return pivoted(machine, machine.luffing, height_under_hook_m)
    return replace(machine, jib_height_m=float(height_under_hook_m + HOOK_BLOCK_M))


def distance_to_polygon_m(points_m: NDArray[np.float64], polygon_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (N,) distances of (N, 2) points to a simple polygon (K, 2), 0 inside."""
    start, end = polygon_m, np.roll(polygon_m, -1, axis=0)
    edge = end - start
    relative = points_m[:, None, :] - start[None]
    length_squared = np.maximum((edge**2).sum(axis=1), 1e-300)
    along = np.clip((relative * edge).sum(axis=2) / length_squared, 0.0, 1.0)
    nearest = np.sqrt(((relative - along[:, :, None] * edge) ** 2).sum(axis=2)).min(axis=1)
    # Even-odd rule: the ray in +x crosses an edge if the edge's ends lie on both sides of the point's y.
    y = points_m[:, 1, None]
    crosses = (start[:, 1] > y) != (end[:, 1] > y)
    rise = np.where(edge[:, 1] == 0.0, 1.0, edge[:, 1])
    at_x = start[:, 0] + (y - start[:, 1]) / rise * edge[:, 0]
    inside = (crosses & (points_m[:, 0, None] < at_x)).sum(axis=1) % 2 == 1
    distance: NDArray[np.float64] = np.where(inside, 0.0, nearest)
    return distance
