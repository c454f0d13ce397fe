"""Outlines of parts and areas as plain values.

An outline is a list of rings; a ring is a list of [x, y] corners, or of [along, z] corners in an elevation. A part is
drawn by the convex hull of its vertices.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from bimvox.bim.building import TriangleMesh
from bimvox.kept import kept

Outline = list[list[list[float]]]
PLAN, FRONT, SIDE = (0, 1), (0, 2), (1, 2)
"""The two axes of a drawing: from above, along +y, along -x."""

_SIMPLE_M = 0.02
"""Outlines are simplified by this much."""
_SMALL_M2, _MOST_TRIANGLES = 20.0, 5000
"""A hull of less has no opening for a mast; more triangles take too long to join."""


@kept
def hull(mesh: TriangleMesh, axes: tuple[int, int]) -> BaseGeometry:
    """Return the convex hull of a mesh along two axes."""
    used = np.zeros(len(mesh.vertices_m), np.bool_)
    used[mesh.faces] = True
    # A line through all vertices has their hull, and is made much faster than a set of points.
    return shapely.linestrings(mesh.vertices_m[:, axes][used]).convex_hull


@kept
def shadow(mesh: TriangleMesh) -> BaseGeometry:
    """Return what a mesh covers on plan, its openings left free; of a small or an intricate one the convex hull."""
    around = hull(mesh, PLAN)
    if around.area < _SMALL_M2 or len(mesh.faces) > _MOST_TRIANGLES:
        return around
    flat = shapely.polygons(mesh.triangles_m[:, :, :2])
    return shapely.union_all(flat[shapely.area(flat) > 0.0])


def union(shapes: Iterable[BaseGeometry]) -> BaseGeometry:
    """Return the union of all shapes that have an area."""
    return shapely.union_all([shape for shape in shapes if shape.area > 0.0])


def outline(shape: BaseGeometry) -> Outline:
    """Return the rings of a shape, to the millimetre."""
    parts = shapely.get_parts(shape.simplify(_SIMPLE_M))
    polygons = [part for part in parts if isinstance(part, shapely.Polygon) and not part.is_empty]
    rings = [ring for polygon in polygons for ring in (polygon.exterior, *polygon.interiors)]
    return [[rounded(at) for at in ring.coords[:-1]] for ring in rings]


def rounded(values: Iterable[float]) -> list[float]:
    """Return values to the millimetre."""
    return [round(float(value), 3) + 0.0 for value in values]
