"""Parts that are drawn twice in the same place: a copy of a storey, a part of two files that were joined.

Also a bar, a wall or a slab that is drawn again a little longer, wider or thicker: one of them is left over from an
earlier draft.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import BUILT, Building, Element, Role, TriangleMesh, plain_class

_SAME_M = 1e-3
_SHARED = 0.8
"""Share of the longer of two parts in one line that both take, from which they are drafts of one part."""


def without_duplicates(building: Building) -> Building:
    """Return a building in which of parts in the same place one is built, with a note; the others are fittings.

    Of parts with the same corners, the first in the file stays, of drafts of one part the longest; but a part that is
    already in place before one that is lifted.
    """
    twins = _same_corners(building.elements)
    twins |= _drafts([(n, one) for n, one in enumerate(building.elements) if one.role in BUILT and n not in twins])
    if not twins:
        return building
    what = "parts are duplicates of others" if len(twins) > 1 else "part is a duplicate of another"
    return building.with_role(twins, Role.FITTING, f"{len(twins)} {what} in the same place, so left out")


def _same_corners(elements: Sequence[Element]) -> set[int]:
    boxes: dict[Hashable, list[int]] = {}
    for n, element in enumerate(elements):
        if element.role in BUILT:
            boxes.setdefault(_rounded(element.mesh.bounds_m).tobytes(), []).append(n)
    twins: set[int] = set()
    for alike in boxes.values():
        places: dict[Hashable, int] = {}
        # What is already in place comes before what is lifted.
        for n in sorted(alike, key=lambda n: elements[n].role is Role.COMPONENT) if len(alike) > 1 else ():
            if places.setdefault(_corners(elements[n].mesh), n) != n:
                twins.add(n)
    return twins


def _drafts(built: Sequence[tuple[int, Element]]) -> set[int]:
    """Return the numbers of parts that another of their class takes the place of: alike but for their extent."""
    found: set[int] = set()
    for axis in range(3):
        across: dict[Hashable, list[tuple[int, Element]]] = {}
        for n, element in built:
            bounds_m = np.delete(_rounded(element.mesh.bounds_m), axis, axis=1)
            key = (plain_class(element.ifc_class), element.material, bounds_m.tobytes())
            across.setdefault(key, []).append((n, element))
        for row in across.values():
            if len(row) > 1:
                found |= set(_covered([one for one in row if one[0] not in found], axis))
    return found


def _covered(row: Sequence[tuple[int, Element]], axis: int) -> Iterator[int]:
    """Yield the numbers of parts in one line along an axis of which one that stays takes most of the place."""
    stay: list[tuple[float, float, Hashable]] = []
    for n, element in sorted(row, key=lambda one: (one[1].role is Role.COMPONENT, -_length_m(one[1], axis), one[0])):
        low, high = element.mesh.bounds_m[:, axis].tolist()
        shape = _stretched(element.mesh, axis)
        if any(
            min(high, top) - max(low, bottom) >= _SHARED * max(high - low, top - bottom) and shape == its_shape
            for bottom, top, its_shape in stay
        ):
            yield n
        else:
            stay.append((low, high, shape))


def _length_m(element: Element, axis: int) -> float:
    return float(np.ptp(element.mesh.bounds_m[:, axis]))


def _stretched(mesh: TriangleMesh, axis: int) -> Hashable:
    """Return the corners of a mesh that is made one metre long, from the origin."""
    points_m = mesh.vertices_m.copy()
    low, high = mesh.bounds_m[:, axis]
    points_m[:, axis] = (points_m[:, axis] - low) / max(high - low, _SAME_M)
    return _corners(TriangleMesh(points_m, mesh.faces))


def _corners(mesh: TriangleMesh) -> Hashable:
    """Return the corners of a mesh, whatever their order."""
    return np.unique(_rounded(mesh.vertices_m[np.unique(mesh.faces)]), axis=0).tobytes()


def _rounded(points_m: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.round(points_m / _SAME_M) + 0.0  # no negative zero
