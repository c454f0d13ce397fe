"""Parts that are drawn twice in the same place: a copy of a storey, a part of two files that were joined."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import Building, Element, Role, TriangleMesh
from bimvox.errors import listed

_SAME_M = 1e-3
_BUILT = (Role.COMPONENT, Role.STRUCTURE)


def without_duplicates(building: Building) -> Building:
    """Return a building in which of parts with the same corners one is built, with a note; the others are fittings.

    The first in the file stays, but a part that is already in place before one that is lifted.
    """
    boxes: dict[Hashable, list[int]] = {}
    for n, element in enumerate(building.elements):
        if element.role in _BUILT:
            boxes.setdefault(_rounded(element.mesh.bounds_m).tobytes(), []).append(n)
    twins: dict[int, int] = {}
    for alike in boxes.values():
        places: dict[Hashable, int] = {}
        for n in sorted(alike, key=lambda n: (_stays_last(building.elements[n]), n)) if len(alike) > 1 else ():
            first = places.setdefault(_corners(building.elements[n].mesh), n)
            if first != n:
                twins[n] = first
    if not twins:
        return building
    elements = tuple(
        replace(element, role=Role.FITTING) if n in twins else element for n, element in enumerate(building.elements)
    )
    names = listed((building.elements[n].label for n in sorted(twins)), most=5)
    what = "parts are duplicates of others" if len(twins) > 1 else "part is a duplicate of another"
    note = f"{len(twins)} {what} in the same place, so left out: {names}"
    return replace(building, elements=elements, notes=(*building.notes, note))


def _stays_last(element: Element) -> bool:
    return element.role is Role.COMPONENT


def _corners(mesh: TriangleMesh) -> Hashable:
    """Return the corners of a mesh, whatever their order."""
    return np.unique(_rounded(mesh.vertices_m[np.unique(mesh.faces)]), axis=0).tobytes()


def _rounded(points_m: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.round(points_m / _SAME_M) + 0.0  # no negative zero
