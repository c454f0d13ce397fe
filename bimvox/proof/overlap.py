"""How the proof decides whether two solids overlap too deep.

Two parts overlap by no more than the tolerance if no point of the thinner one is in the core of the thicker one: its
inside without its skin (see ``solid``). The surface of the thinner part is searched for such a point, piece by piece:

- a piece that the skin of one triangle contains is good, whatever its size: a triangle's skin is convex;
- a piece that does not cross the other surface is completely inside or outside; outside is good;
- inside, a point that is not in the skin of any triangle is a hit;
- every other piece is halved, until its longest edge is shorter than ``FINEST_M``.

So the result does not depend on the position of samples. The search may only miss a tip of the surface that reaches
less than ``FINEST_M`` into the core. If the other part encloses the whole core, a point of the core, its seed, shows
it. A search that does not end within ``_MOST_PIECES`` for a triangle counts as an overlap.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.proof.solid import FINEST_M, Solid
from bimvox.proof.solid_queries import crosses_surface, in_skin, is_inside, surfaces_cross

_MOST_PIECES = 1_000_000


def overlap_m(thick: Solid, thin: Solid, offset_m: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Return a point at which a solid reaches into the core of another; None if there is none.

    Args:
        thick: The solid whose skin may be overlapped.
        thin: The other one.
        offset_m: (3,) position of the other one, relative to its mesh.

    Returns:
        (3,) metres, in the frame of ``thick``; None if there is none.
    """
    found, point = _search(thick, thin, offset_m)
    return point if found else None


@kernel
def _search(thick: Solid, thin: Solid, offset: NDArray[np.float64]) -> tuple[bool, NDArray[np.float64]]:
    low, high = thick.core_m[0], thick.core_m[1]
    for n in range(thick.seed_m.shape[0]):
        if is_inside(thin, thick.seed_m[n] - offset):
            return True, thick.seed_m[n].copy()
    if not surfaces_cross(thick, thin, offset) and not _reaches_in(thick, thin, offset):
        return False, np.zeros(3)
    nodes = np.empty(64, np.int64)
    nodes[0], left = 0, 1
    while left and thin.spans.shape[0] and thick.spans.shape[0]:
        left -= 1
        node = nodes[left]
        apart = False
        for k in range(3):
            apart |= thin.boxes_m[node, 0, k] + offset[k] > high[k] or thin.boxes_m[node, 1, k] + offset[k] < low[k]
        if apart:
            continue
        if thin.spans[node, 2]:
            nodes[left], nodes[left + 1] = thin.spans[node, 2], node + 1
            left += 2
            continue
        for f in range(thin.spans[node, 0], thin.spans[node, 1]):
            found, point = _search_triangle(thick, thin.corners_m[f], offset)
            if found:
                return True, point
    return False, np.zeros(3)


@kernel
def _reaches_in(thick: Solid, thin: Solid, offset: NDArray[np.float64]) -> bool:
    """Return whether an end of the thin solid is inside the thick one; decisive if their surfaces do not cross."""
    low, high = thick.boxes_m[0, 0], thick.boxes_m[0, 1]
    for n in range(thin.ends_m.shape[0]):
        point, apart = thin.ends_m[n] + offset, False
        for k in range(3):
            apart |= point[k] > high[k] or point[k] < low[k]
        if not apart and is_inside(thick, point):
            return True
    return False


@kernel
def _search_triangle(
    thick: Solid, triangle: NDArray[np.float64], offset: NDArray[np.float64]
) -> tuple[bool, NDArray[np.float64]]:
    low, high = thick.core_m[0], thick.core_m[1]
    pieces = np.empty((128, 3, 3))
    for k in range(3):
        pieces[0, k] = triangle[k] + offset
    left, middle, looked = 1, np.empty(3), 0
    a, b, c = np.empty(3), np.empty(3), np.empty(3)
    while left:
        left -= 1
        looked += 1
        a[:], b[:], c[:] = pieces[left, 0], pieces[left, 1], pieces[left, 2]
        apart = False
        for k in range(3):
            apart |= min(a[k], b[k], c[k]) > high[k] or max(a[k], b[k], c[k]) < low[k]
            middle[k] = (a[k] + b[k] + c[k]) / 3.0
        if apart or in_skin(thick, middle, a, b, c):
            continue
        if not crosses_surface(thick, a, b, c):
            if not is_inside(thick, middle):
                continue
            if not in_skin(thick, middle, middle, middle, middle):
                return True, middle
        ab, bc, ca = _square(a, b), _square(b, c), _square(c, a)
        if max(ab, bc, ca) < FINEST_M * FINEST_M:
            continue
        if looked > _MOST_PIECES:
            return True, middle
        if bc >= ab and bc >= ca:
            a[:], b[:], c[:] = pieces[left, 1], pieces[left, 2], pieces[left, 0]
        elif ca >= ab:
            a[:], b[:], c[:] = pieces[left, 2], pieces[left, 0], pieces[left, 1]
        for k in range(3):
            half = 0.5 * (a[k] + b[k])
            pieces[left, 0, k], pieces[left, 1, k], pieces[left, 2, k] = a[k], half, c[k]
            pieces[left + 1, 0, k], pieces[left + 1, 1, k], pieces[left + 1, 2, k] = half, b[k], c[k]
        left += 2
    return False, middle


@kernel
def _square(one: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    x, y, z = one[0] - other[0], one[1] - other[1], one[2] - other[2]
    return float(x * x + y * y + z * z)
