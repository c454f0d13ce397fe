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

Positions along a path are searched together: a piece at every position in a box of offsets is good if one skin contains
it at the corners of that box, or if it crosses no surface anywhere in the box. If a search of many positions finds a
piece that is not good, or does not end soon, each half of them is searched.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.proof.bodies.solid import FINEST_M, Solid, crosses_surface, in_skin, is_inside, surfaces_cross

_MOST_PIECES = 1_000_000
_MOST_PIECES_TOGETHER = 512


def overlaps_m(thick: Solid, thin: Solid, offsets_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a point at which a solid reaches into the core of another, for each position of it; NaN if none.

    Args:
        thick: The solid whose skin may be overlapped.
        thin: The other one.
        offsets_m: (N, 3) positions of the other one, relative to its mesh; neighbours are searched together.

    Returns:
        (N, 3) metres, in the frame of ``thick``.
    """
    points: NDArray[np.float64] = _search_all(thick, thin, np.ascontiguousarray(offsets_m, np.float64))
    return points


@kernel
def _search_all(thick: Solid, thin: Solid, offsets: NDArray[np.float64]) -> NDArray[np.float64]:
    points, seed = np.empty(offsets.shape), np.empty(3)
    for n in range(offsets.shape[0]):
        for k in range(3):
            points[n, k] = np.nan
        for s in range(thick.seed_m.shape[0]):
            for k in range(3):
                seed[k] = thick.seed_m[s, k] - offsets[n, k]
            if is_inside(thin, seed):
                _copy(thick.seed_m[s], points[n])
    waiting, reaching = np.empty((64, 2), np.int64), np.empty(offsets.shape[0], np.bool_)
    waiting[0, 0], waiting[0, 1], left = 0, offsets.shape[0], min(1, offsets.shape[0])
    low, high, point = np.empty(3), np.empty(3), np.empty(3)
    while left:
        left -= 1
        first, last = waiting[left, 0], waiting[left, 1]
        for k in range(3):
            low[k] = high[k] = offsets[first, k]
            for n in range(first, last):
                low[k], high[k] = min(low[k], offsets[n, k]), max(high[k], offsets[n, k])
        alone = last - first == 1
        crossing = surfaces_cross(thick, thin, low, high)
        any_reaches = False
        for n in range(first, last):
            reaching[n] = not crossing and _reaches_in(thick, thin, offsets[n])
            any_reaches |= reaching[n]
        if not crossing and not any_reaches:
            continue
        most = _MOST_PIECES if crossing and alone else _MOST_PIECES_TOGETHER
        if not _search(thick, thin, low, high, most, point):
            continue
        if alone and crossing:
            _copy(point, points[first])
            continue
        if not crossing:
            for n in range(first, last):
                if reaching[n] and _search(thick, thin, offsets[n], offsets[n], _MOST_PIECES, point):
                    _copy(point, points[n])
            continue
        half = (first + last) // 2
        waiting[left, 0], waiting[left, 1], waiting[left + 1, 0], waiting[left + 1, 1] = first, half, half, last
        left += 2
    return points


@kernel
def _search(
    thick: Solid,
    thin: Solid,
    low: NDArray[np.float64],
    high: NDArray[np.float64],
    most: int,
    point: NDArray[np.float64],
) -> bool:
    """Return whether the thin solid's surface, moved by any offset in a box, may reach the core; write a point there.

    For a single offset the answer is exact. For a box, only "no" is.
    """
    nodes = np.empty(64, np.int64)
    nodes[0], left = 0, 1
    while left and thin.spans.shape[0] and thick.spans.shape[0]:
        left -= 1
        node = nodes[left]
        apart = False
        for k in range(3):
            apart |= thin.boxes_m[node, 0, k] + low[k] > thick.core_m[1, k]
            apart |= thin.boxes_m[node, 1, k] + high[k] < thick.core_m[0, k]
        if apart:
            continue
        if thin.spans[node, 2]:
            nodes[left], nodes[left + 1] = thin.spans[node, 2], node + 1
            left += 2
            continue
        for f in range(thin.spans[node, 0], thin.spans[node, 1]):
            if _search_triangle(thick, thin.corners_m[f], low, high, most, point):
                return True
    return False


@kernel
def _reaches_in(thick: Solid, thin: Solid, offset: NDArray[np.float64]) -> bool:
    """Return whether an end of the thin solid is inside the thick one; decisive if their surfaces do not cross."""
    low, high, point = thick.boxes_m[0, 0], thick.boxes_m[0, 1], np.empty(3)
    for n in range(thin.ends_m.shape[0]):
        apart = False
        for k in range(3):
            point[k] = thin.ends_m[n, k] + offset[k]
            apart |= point[k] > high[k] or point[k] < low[k]
        if not apart and is_inside(thick, point):
            return True
    return False


@kernel
def _search_triangle(
    thick: Solid,
    triangle: NDArray[np.float64],
    low: NDArray[np.float64],
    high: NDArray[np.float64],
    most: int,
    point: NDArray[np.float64],
) -> bool:
    pieces, swept, is_clear = np.empty((128, 3, 3)), np.empty((25, 3)), np.zeros(128, np.bool_)
    for corner in range(3):
        _copy(triangle[corner], pieces[0, corner])
    left, looked = 1, 0
    a, b, c = np.empty(3), np.empty(3), np.empty(3)
    while left:
        left -= 1
        looked += 1
        apart = False
        for k in range(3):
            a[k], b[k], c[k] = pieces[left, 0, k], pieces[left, 1, k], pieces[left, 2, k]
            apart |= min(a[k], b[k], c[k]) + low[k] > thick.core_m[1, k]
            apart |= max(a[k], b[k], c[k]) + high[k] < thick.core_m[0, k]
            swept[0, k] = (a[k] + b[k] + c[k]) / 3.0 + low[k]
        if apart or in_skin(thick, swept[: _sweep(swept, pieces[left], low, high)]):
            continue
        if is_clear[left] or not crosses_surface(thick, pieces[left], low, high):
            if not is_inside(thick, swept[0]):
                continue
            if not in_skin(thick, swept[:1]):
                _copy(swept[0], point)
                return True
            is_clear[left] = True
        ab, bc, ca = _square(a, b), _square(b, c), _square(c, a)
        is_small = max(ab, bc, ca) < FINEST_M * FINEST_M
        if looked > most or (is_small and (high[0] > low[0] or high[1] > low[1] or high[2] > low[2])):
            _copy(swept[0], point)
            return True
        if is_small:
            continue
        if bc >= ab and bc >= ca:
            a, b, c = b, c, a
        elif ca >= ab:
            a, b, c = c, a, b
        for k in range(3):
            half = 0.5 * (a[k] + b[k])
            pieces[left, 0, k], pieces[left, 1, k], pieces[left, 2, k] = a[k], half, c[k]
            pieces[left + 1, 0, k], pieces[left + 1, 1, k], pieces[left + 1, 2, k] = half, b[k], c[k]
        is_clear[left + 1] = is_clear[left]
        left += 2
    return False


@leaf_kernel
def _copy(point: NDArray[np.float64], to: NDArray[np.float64]) -> None:
    for k in range(3):
        to[k] = point[k]


@leaf_kernel
def _sweep(
    swept: NDArray[np.float64], piece: NDArray[np.float64], low: NDArray[np.float64], high: NDArray[np.float64]
) -> int:
    """Write a piece's corners, moved to each corner of a box of offsets, after the first point; return how many."""
    count = 1
    for corner in range(8):
        again = False
        for k in range(3):
            again |= corner >> k & 1 == 1 and high[k] == low[k]
        if again:
            continue
        for n in range(3):
            for k in range(3):
                swept[count, k] = piece[n, k] + (high[k] if corner >> k & 1 else low[k])
            count += 1
    return count


@leaf_kernel
def _square(one: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    x, y, z = one[0] - other[0], one[1] - other[1], one[2] - other[2]
    return float(x * x + y * y + z * z)
