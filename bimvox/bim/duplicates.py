"""Parts that are drawn twice in the same place: a copy of a storey, a part of two files that were joined."""

from __future__ import annotations

from collections.abc import Hashable

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import BUILT, Building, Role, TriangleMesh

_SAME_M = 1e-3


def without_duplicates(building: Building) -> Building:
    """Return a building in which of parts with the same corners one is built, with a note; the others are fittings.

    The first in the file stays, but a part that is already in place before one that is lifted.
    """
    boxes: dict[Hashable, list[int]] = {}
    for n, element in enumerate(building.elements):
        if element.role in BUILT:
            boxes.setdefault(_rounded(element.mesh.bounds_m).tobytes(), []).append(n)
    twins: set[int] = set()
    for alike in boxes.values():
        places: dict[Hashable, int] = {}
        # What is already in place comes before what is lifted.
        for n in sorted(alike, key=lambda n: building.elements[n].role is Role.COMPONENT) if len(alike) > 1 else ():
            if places.setdefault(_corners(building.elements[n].mesh), n) != n:
                twins.add(n)
    if not twins:
        return building
    what = "parts are duplicates of others" if len(twins) > 1 else "part is a duplicate of another"
    return building.with_role(twins, Role.FITTING, f"{len(twins)} {what} in the same place, so left out")


def _corners(mesh: TriangleMesh) -> Hashable:
    """Return the corners of a mesh, whatever their order."""
    return np.unique(_rounded(mesh.vertices_m[np.unique(mesh.faces)]), axis=0).tobytes()


def _rounded(points_m: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.round(points_m / _SAME_M) + 0.0  # no negative zero
