"""Products whose curves are too large for the fast library, which gives every circle the same number of edges."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

LARGE_M = 0.8
"""Radius above which the 64 edges of the fast library deviate by more than the plain library's 1 mm."""

_CIRCLES = ("IfcCircle", "IfcCircleProfileDef", "IfcRightCircularCylinder", "IfcRightCircularCone", "IfcSphere")
_FLAT = ("Annotation", "Curve", "FootPrint", "Geometric", "Point")
_FOLLOWED = ("IfcRepresentationItem", "IfcProfileDef", "IfcRepresentation", "IfcRepresentationMap")


def largely_curved(file: Any, metres_per_unit: float) -> frozenset[int]:
    """Return the step ids of the products whose shape, or an opening in it, contains a curve of a large radius.

    Args:
        file: The ``ifcopenshell.file``.
        metres_per_unit: Its length unit in metres.
    """
    return products_with(file, _large_curves(file, LARGE_M / metres_per_unit))


def products_with(file: Any, items: Iterable[Any]) -> frozenset[int]:
    """Return the step ids of the products whose shape, or an opening in it, contains one of the items."""
    above = list(items)
    seen = {item.id() for item in above}
    products: set[int] = set()
    while above:
        for user in file.get_inverse(above.pop()):
            if user.id() in seen:
                continue
            seen.add(user.id())
            if user.is_a("IfcProductRepresentation"):
                products |= _owners(user)
            elif any(user.is_a(name) for name in _FOLLOWED) and not _is_flat(user):
                above.append(user)
    return frozenset(products)


def _large_curves(file: Any, radius: float) -> Iterator[Any]:
    for name in _CIRCLES:
        for circle in file.by_type(name):
            if float(getattr(circle, "Radius", None) or getattr(circle, "BottomRadius", None) or 0.0) > radius:
                yield circle
    for ellipse in file.by_type("IfcEllipse"):
        if max(float(ellipse.SemiAxis1), float(ellipse.SemiAxis2)) > radius:
            yield ellipse
    for solid in file.by_type("IfcRevolvedAreaSolid"):
        # Profiles surround the origin of the solid, so this is their distance from the axis.
        if float(np.linalg.norm(solid.Axis.Location.Coordinates)) > radius:
            yield solid
    if file.schema != "IFC2X3":
        yield from (curve for curve in file.by_type("IfcIndexedPolyCurve") if _largest_arc(curve) > radius)


def _largest_arc(curve: Any) -> float:
    """Return the largest arc radius of an ``IfcIndexedPolyCurve``; 0.0 if it has no arcs."""
    arcs = [segment.wrappedValue for segment in curve.Segments or () if segment.is_a("IfcArcIndex")]
    if not arcs:
        return 0.0
    points = np.array(curve.Points.CoordList, dtype=np.float64)
    a, b, c = np.moveaxis(points[np.array(arcs, dtype=np.int64) - 1], 1, 0)
    sides = np.linalg.norm([b - a, c - b, a - c], axis=2)
    half = sides.sum(axis=0) / 2.0
    area = np.sqrt(np.maximum(half * np.prod(half - sides, axis=0), 0.0))  # Heron
    return float(np.divide(sides.prod(axis=0), 4.0 * area, out=np.zeros(len(arcs)), where=area > 0.0).max())


def _is_flat(item: Any) -> bool:
    """Return whether it is a representation of lines, such as the swing of a door in a plan."""
    return bool(item.is_a("IfcRepresentation")) and str(item.RepresentationType or "").startswith(_FLAT)


def _owners(shape: Any) -> set[int]:
    """Return the products that a product shape belongs to; for an opening, the product that it is cut out of."""
    owners = set()
    for product in getattr(shape, "ShapeOfProduct", ()):
        voids = getattr(product, "VoidsElements", None) or ()
        owners.add(voids[0].RelatingBuildingElement.id() if voids else product.id())
    return owners
