"""What takes the geometry kernel minutes or for ever, found before it is asked; and what does not fit the schema."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import ifcopenshell
import ifcopenshell.validate
import numpy as np

from bimvox.errors import IfcError

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
    return _products_with(file, _large_curves(file, LARGE_M / metres_per_unit))


def _products_with(file: Any, items: Iterable[Any]) -> frozenset[int]:
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


_MISREAD = (AttributeError, TypeError, ValueError, LookupError, ArithmeticError, RuntimeError)


@contextmanager
def named_misfit(path: Path, file: Any) -> Iterator[None]:
    """Turn what a missing or misplaced value causes into an error that names it; other errors pass unchanged.

    ``file``: the ``ifcopenshell.file`` that is read meanwhile.

    Raises:
        IfcError: If reading fails and an instance does not fit the schema.
    """
    try:
        yield
    except _MISREAD as error:
        misfit = _first_misfit(file)
        if misfit is None:
            raise
        raise IfcError(
            path, f"is damaged: {misfit}", hint="export the model again, or correct it in the authoring program"
        ) from error


def _first_misfit(file: Any) -> str | None:
    """Return the first attribute whose value the schema does not allow; relations before all else."""
    schema = ifcopenshell.ifcopenshell_wrapper.schema_by_name(file.schema_identifier)
    relations = file.by_type("IfcRelationship")
    for instance in (*relations, *(one for one in file if not one.is_a("IfcRelationship"))):
        definition = schema.declaration_by_name(instance.is_a()).as_entity()
        for position, attribute in enumerate(definition.all_attributes()):
            if definition.derived()[position]:
                continue
            named = f"#{instance.id()}={instance.is_a()} has {{}} as its {attribute.name()}"
            value = instance[position]
            if value is None:
                if not attribute.optional():
                    return named.format("nothing")
            elif not ifcopenshell.validate.assert_valid(attribute.type_of_attribute(), value, schema, no_throw=True):
                return named.format("a value that the schema does not allow")
    return None


MOST_POINTS = 50_000
"""Most points of one outline: the time of the kernels grows with their square."""
_MOST_WHOLES = 100
"""Most levels of assemblies; people draw five."""
_SHORTEST_POINT = 4
"""Characters of a point of an outline, at least, among so many."""
_OUTLINE = re.compile(
    rb"\s*#(\d+)\s*=\s*(IFCPOLYLINE|IFCPOLYLOOP|IFCCARTESIANPOINTLIST2D|IFCINDEXEDPOLYGONALFACE\w*)\s*\(",
    re.IGNORECASE,
)


def long_outlines(step: bytes) -> dict[int, int]:
    """Return the number of points of the outlines with more than ``MOST_POINTS``, by step id."""
    ends = np.flatnonzero(np.frombuffer(step, np.uint8) == ord(";"))
    result: dict[int, int] = {}
    for n in np.flatnonzero(np.diff(ends, prepend=-1) > MOST_POINTS * _SHORTEST_POINT).tolist():
        instance = step[int(ends[n - 1]) + 1 if n else 0 : int(ends[n])]
        outline = _OUTLINE.match(instance)
        if outline is not None:
            commas = instance.count(b",") + 1
            points = commas // 2 if outline[2].upper() == b"IFCCARTESIANPOINTLIST2D" else commas
            if points > MOST_POINTS:
                result[int(outline[1])] = points
    return result


def endless_products(file: Any, outlines: Mapping[int, int], step_ids: Collection[int]) -> dict[int, str]:
    """Return why products are not meshed, by step id: an outline of ``long_outlines``, or a circle of references.

    Args:
        file: The ``ifcopenshell.file``.
        outlines: What ``long_outlines`` returns.
        step_ids: The products that are wanted.
    """
    found = {
        product: f"an outline of it has {points:,} points, more than {MOST_POINTS:,}"
        for outline, points in outlines.items()
        for product in _products_with(file, [file.by_id(outline)])
    }
    cut = _products_with(file, _circular_booleans(file))
    found |= dict.fromkeys(cut, "a boolean operation in it has itself as operand")
    deep = _too_deep(file, step_ids)
    return found | dict.fromkeys(deep, f"it is a part of itself, or nested in more than {_MOST_WHOLES} assemblies")


def _circular_booleans(file: Any) -> list[Any]:
    """Return the boolean operations that contain themselves, at any depth, and those that contain such."""
    waits_for: dict[int, int] = {}
    users: dict[int, list[int]] = {}
    for one in file.by_type("IfcBooleanResult"):
        inner = [operand.id() for operand in map(_operation, (one.FirstOperand, one.SecondOperand)) if operand]
        waits_for[one.id()] = len(inner)
        for operand in inner:
            users.setdefault(operand, []).append(one.id())
    ready = [one for one, count in waits_for.items() if not count]
    while ready:
        done = ready.pop()
        del waits_for[done]
        for user in users.get(done, ()):
            waits_for[user] -= 1
            if not waits_for[user]:
                ready.append(user)
    return [file.by_id(one) for one in waits_for]


def _operation(operand: Any) -> Any:
    """Return the boolean operation that an operand is, or is the tree of; None if it is a solid."""
    if operand is not None and operand.is_a("IfcCsgSolid"):
        operand = operand.TreeRootExpression
    return operand if operand is not None and operand.is_a("IfcBooleanResult") else None


def _too_deep(file: Any, step_ids: Collection[int]) -> set[int]:
    """Return the products in more than ``_MOST_WHOLES`` wholes, one in the other; also those that contain themselves.

    The kernel would look for the topmost whole of the latter for ever.
    """
    levels: dict[int, int] = {}
    for step_id in step_ids:
        above: list[int] = []
        whole = file.by_id(step_id)
        while whole is not None and whole.id() not in levels and len(above) <= _MOST_WHOLES:
            above.append(whole.id())
            whole = next((relation.RelatingObject for relation in getattr(whole, "Decomposes", ()) or ()), None)
        top = 0 if whole is None else levels.get(whole.id(), _MOST_WHOLES + 1)
        levels.update({one: top + n for n, one in enumerate(reversed(above))})
    return {step_id for step_id in step_ids if levels[step_id] > _MOST_WHOLES}
