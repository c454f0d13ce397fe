"""What takes the geometry kernel minutes or for ever, found before it is asked."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from bimvox.bim.ifc.curves import products_with
from bimvox.errors import IfcError

MOST_POINTS = 50_000
"""Most points of one outline: the time of the kernels grows with their square."""
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


def endless_products(file: Any, outlines: Mapping[int, int]) -> dict[int, str]:
    """Return why products are not meshed, by step id: they have an outline of ``long_outlines``, or cut themselves."""
    found = {
        product: f"an outline of it has {points:,} points, more than {MOST_POINTS:,}"
        for outline, points in outlines.items()
        for product in products_with(file, [file.by_id(outline)])
    }
    return found | dict.fromkeys(
        products_with(file, _circular_booleans(file)), "a boolean operation in it has itself as operand"
    )


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


def check_wholes(path: Path, file: Any, step_ids: Iterable[int]) -> None:
    """Raise an error if a product is a part of itself: the kernel would look for its topmost whole for ever.

    Raises:
        IfcError: With the products that contain each other.
    """
    known: set[int] = set()
    for step_id in step_ids:
        above: dict[int, int] = {}
        whole = file.by_id(step_id)
        while whole is not None and whole.id() not in known:
            if whole.id() in above:
                ring = [file.by_id(number) for number in [*above][above[whole.id()] :]]
                names = ", ".join(f"#{one.id()} {one.is_a()} {one.GlobalId}" for one in ring[:4])
                raise IfcError(
                    path,
                    f"has parts that contain themselves (IfcRelAggregates in a circle): {names}"
                    + (f" and {len(ring) - 4} more" if len(ring) > 4 else ""),
                    hint="take the assemblies apart in the authoring program, and export the model again",
                )
            above[whole.id()] = len(above)
            whole = next((relation.RelatingObject for relation in getattr(whole, "Decomposes", ()) or ()), None)
        known.update(above)
