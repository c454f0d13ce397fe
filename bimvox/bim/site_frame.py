"""Transform a building into the site frame: axes along the building, z = 0 at the top of the ground."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import Building, TriangleMesh


def turn_about_z(yaw_rad: float) -> NDArray[np.float64]:
    """Return the (3, 3) rotation by ``yaw_rad``, counter-clockwise seen from above; exact at quarter turns."""
    quarters = yaw_rad / (math.pi / 2)
    if abs(quarters - round(quarters)) < 1e-12:
        # cos(pi / 2) is 6e-17, which would tilt every face off the lattice by a rounding error.
        cos, sin = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[round(quarters) % 4]
    else:
        cos, sin = math.cos(yaw_rad), math.sin(yaw_rad)
    return np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])


def in_site_frame(building: Building, *, ground_m: float, yaw_rad: float = 0.0) -> tuple[Building, NDArray[np.float64]]:
    """Return a building in the site frame, and the transformation back.

    The building is turned by ``-yaw_rad`` about the z axis through its local origin, so that its main axis becomes
    x. Then it is shifted so that ``ground_m`` becomes z = 0. x and y are not shifted.

    Args:
        building: In its local frame.
        ground_m: Local height of the top of the ground, metres.
        yaw_rad: Direction of the building's main axis in its local frame, radians.

    Returns:
        The building with its vertices in the site frame (``origin_m`` and ``georeference`` still refer to the local
        frame), and ``site_to_local``, (4, 4) float64: ``world = site_to_local @ site + origin_m``.
    """
    site_to_local = np.eye(4)
    site_to_local[:3, :3] = turn_about_z(yaw_rad)
    site_to_local[2, 3] = ground_m
    local_to_site = turn_about_z(-yaw_rad)

    def moved(mesh: TriangleMesh) -> TriangleMesh:
        # "+ 0.0" turns a -0.0 from the rotation into 0.0, so that equal positions have equal bytes.
        vertices = mesh.vertices_m @ local_to_site.T - np.array([0.0, 0.0, ground_m]) + 0.0
        return TriangleMesh(vertices, mesh.faces)

    def moved_points(points: tuple[tuple[float, float, float], ...]) -> tuple[tuple[float, float, float], ...]:
        if not points:
            return points
        at = np.round(np.array(points) @ local_to_site.T - np.array([0.0, 0.0, ground_m]), 6) + 0.0
        return tuple((x, y, z) for x, y, z in at.tolist())

    elements = tuple(
        replace(element, mesh=moved(element.mesh), lifting_points_m=moved_points(element.lifting_points_m))
        for element in building.elements
    )
    return replace(building, elements=elements), site_to_local
