"""Origins: near the model for small numbers, and the site frame, its axes along the building, z = 0 at the ground."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

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


FAR_M = 1000.0
"""A model that is entirely beyond this distance along an axis gets a local origin on that axis."""


def local_origin(bounds_m: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Return the (3,) whole-metre point to subtract; zeros for a model near its origin.

    Whole metres do not shift a lattice whose cells divide a metre. Each axis is judged separately: a georeferenced
    model is usually far away in x and y, and its heights stay as modelled.

    Args:
        bounds_m: (2, 3) boxes of the elements, lowest and highest corner.
    """
    if not bounds_m:
        return np.zeros(3)
    low = np.min([box[0] for box in bounds_m], axis=0)
    high = np.max([box[1] for box in bounds_m], axis=0)
    far = (low > FAR_M) | (high < -FAR_M)
    return np.where(far, np.floor(low), 0.0)


def stray(bounds_m: Sequence[NDArray[np.float64]]) -> NDArray[np.int64]:
    """Return the indices of boxes whose centre is more than ``FAR_M`` from the median centre."""
    centres = np.array([box.mean(axis=0) for box in bounds_m]).reshape(-1, 3)
    if not len(centres):
        return np.zeros(0, dtype=np.int64)
    distance = np.linalg.norm(centres - np.median(centres, axis=0), axis=1)
    return np.flatnonzero(distance > FAR_M)


_BEGINS = "the model is placed on the map twice"
_FAR_M = 10_000.0
"""Farther from the origin than a site reaches, so these are map coordinates."""
_ALIKE_M = 100_000.0


def placed_twice(georeference: Mapping[str, str | float], middle_m: ArrayLike) -> str | None:
    """Return a note if a model's geometry is in map coordinates already, and its map conversion moves it again.

    A conversion that brings far geometry closer to the origin, such as one between two maps, is no fault.

    Args:
        georeference: ``Building.georeference``.
        middle_m: (3,) middle of the geometry in the file's world coordinates, metres.
    """
    if "eastings_m" not in georeference:
        return None
    at = np.asarray(middle_m, np.float64)[:2]
    by = np.array([float(georeference["eastings_m"]), float(georeference["northings_m"])])
    yaw_rad = float(georeference.get("x_axis_yaw_rad", 0.0))
    cos, sin = math.cos(yaw_rad), math.sin(yaw_rad)
    placed = by + np.array([[cos, -sin], [sin, cos]]) @ at
    own, added, total, apart = (float(np.hypot(*point)) for point in (at, by, placed, at - by))
    if min(own, added) < _FAR_M or (total < own / 2.0 and apart > _ALIKE_M):
        return None
    return (
        f"{_BEGINS}: its geometry lies at {_shown(at)} already, and its map conversion adds {_shown(by)}, which makes "
        f"{_shown(placed)}; export it with one of the two, before anything is set out by map coordinates"
    )


def is_about_place(note: str) -> bool:
    """Return whether a note says that a model is placed twice."""
    return note.startswith(_BEGINS)


def _shown(point: ArrayLike) -> str:
    x, y = np.asarray(point).tolist()
    return f"({x:,.1f}, {y:,.1f}) m"
