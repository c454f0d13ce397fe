"""What takes the geometry kernel minutes or for ever, found before it is asked."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from typing import Any

import numpy as np

from bimvox.bim.ifc.curves import products_with

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
    found: dict[int, int] = {}
    for n in np.flatnonzero(np.diff(ends, prepend=-1) > MOST_POINTS * _SHORTEST_POINT).tolist():
        instance = step[int(ends[n - 1]) + 1 if n else 0 : int(ends[n])]
        outline = _OUTLINE.match(instance)
        if outline is not None:
            commas = instance.count(b",") + 1
            points = commas // 2 if outline[2].upper() == b"IFCCARTESIANPOINTLIST2D" else commas
            if points > MOST_POINTS:
                found[int(outline[1])] = points
    return found


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
        for product in products_with(file, [file.by_id(outline)])
    }
    cut = products_with(file, _circular_booleans(file))
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
