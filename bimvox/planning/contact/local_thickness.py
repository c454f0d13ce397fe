"""How thick a part is under each of its triangles: the depth by which a face can be moved in without meeting another.

The thickness under a triangle is the least distance, along its inward normal, of a triangle that faces the other way
and lies behind it. It is exact: where the two overlap in projection, the distance is linear, so it is least at a corner
of the overlap. Of two triangles that share a corner (the sides of a wedge or a spike), the greatest distance counts:
the least one is 0 at their common edge, but a mitre moves that edge along.

A triangle that others in its plane cover, which face it, is an inner boundary (layers of a wall, a sheet with two
sides). It is not a surface of the part.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.planning.contact.posed import order_along_curve, tree_boxes
from bimvox.planning.contact.sweep import overlap_area, projected_overlap

_SAME_M = 1e-6
_NO_AREA_M2 = 1e-10
_COVERED = 0.99
_MOST_TRIANGLES = 20_000
"""Of larger meshes nothing is measured: that takes up to seconds, and what fine meshes are of is seldom thin."""
_OPPOSITE = 0.05
"""Least cosine between a normal and the inward one of a triangle behind which it lies."""


def thicknesses_m(
    triangles_m: NDArray[np.float64], inward: NDArray[np.float64], corners: NDArray[np.int64], reach_m: float
) -> NDArray[np.float64]:
    """Return (F,) the thickness of a part under each triangle; infinite beyond a reach, and of very fine meshes.

    Args:
        triangles_m: (F, 3, 3) triangles with an area.
        inward: (F, 3) their unit normals, into the part.
        corners: (F, 3) numbers of their corners; the same number for the same point.
        reach_m: Greater thicknesses do not matter.
    """
    if not 0 < len(triangles_m) <= _MOST_TRIANGLES:
        return np.full(len(triangles_m), np.inf)
    order = order_along_curve(triangles_m.mean(axis=1))
    ordered_m, found = triangles_m[order], np.empty(len(order))
    found[order] = _thicknesses(ordered_m, inward[order], corners[order], tree_boxes(ordered_m), reach_m)
    return found


@kernel
def _thicknesses(
    triangles: NDArray[np.float64],
    inward: NDArray[np.float64],
    corners: NDArray[np.int64],
    boxes: NDArray[np.float64],
    reach: float,
) -> NDArray[np.float64]:
    count, leaves = triangles.shape[0], boxes.shape[0] // 2
    waiting = np.empty(128, np.int64)
    thick, is_inner = np.full(count, np.inf), np.zeros(count, np.bool_)
    one, other = np.empty((3, 3)), np.empty((3, 3))
    polygon, clipped, frame = np.empty((9, 2)), np.empty((9, 2)), np.empty((3, 3))
    for is_second in range(2):  # first the inner boundaries: they bound nothing
        near = reach if is_second else _SAME_M
        for f in range(count):
            if is_inner[f]:
                continue
            _frame_along(inward[f], frame)
            _seen(triangles[f], triangles[f, 0], frame, one)
            uncovered = _COVERED * overlap_area(one, 3)
            waiting[0], left = 1, 1
            while left:
                left -= 1
                node, apart = waiting[left], False
                for k in range(3):
                    away = abs(boxes[node, 0, k] - boxes[leaves + f, 0, k])
                    apart |= away > boxes[node, 1, k] + boxes[leaves + f, 1, k] + near
                if apart:
                    continue
                if node < leaves:
                    waiting[left], waiting[left + 1], left = 2 * node, 2 * node + 1, left + 2
                    continue
                g = node - leaves
                if g == f:
                    continue
                slope = inward[f, 0] * inward[g, 0] + inward[f, 1] * inward[g, 1] + inward[f, 2] * inward[g, 2]
                if slope > -_OPPOSITE:
                    continue
                _seen(triangles[g], triangles[f, 0], frame, other)
                # The plane of the other one, as heights over the first one's.
                x, y, z = 0.0, 0.0, 0.0
                for k in range(3):
                    x += inward[g, k] * frame[0, k]
                    y += inward[g, k] * frame[1, k]
                    z += inward[g, k] * frame[2, k]
                size = projected_overlap(one, other, polygon, clipped)
                area = overlap_area(polygon, size) if size > 2 else 0.0
                if area < _NO_AREA_M2:
                    continue
                least, most = np.inf, -np.inf
                for c in range(size):
                    along = x * (polygon[c, 0] - other[0, 0]) + y * (polygon[c, 1] - other[0, 1])
                    gap = other[0, 2] - along / z
                    least, most = min(least, gap), max(most, gap)
                if is_second == 0:
                    if abs(least) <= _SAME_M and abs(most) <= _SAME_M:
                        uncovered -= area
                    continue
                if is_inner[g] or most <= _SAME_M:
                    continue
                shared = False
                for i in range(3):
                    for j in range(3):
                        shared |= corners[f, i] == corners[g, j]
                thick[f] = min(thick[f], most if shared else max(least, 0.0))
            is_inner[f] |= is_second == 0 and uncovered <= 0.0
    return thick


@kernel
def _frame_along(normal: NDArray[np.float64], frame: NDArray[np.float64]) -> None:
    """Write three axes at right angles, the last along a unit vector."""
    least = 0
    for k in range(1, 3):
        if abs(normal[k]) < abs(normal[least]):
            least = k
    length = np.sqrt(1.0 - normal[least] * normal[least])
    for k in range(3):
        frame[0, k] = ((1.0 if k == least else 0.0) - normal[least] * normal[k]) / length
        frame[2, k] = normal[k]
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        frame[1, k] = normal[i] * frame[0, j] - normal[j] * frame[0, i]


@kernel
def _seen(
    triangle: NDArray[np.float64], origin: NDArray[np.float64], frame: NDArray[np.float64], seen: NDArray[np.float64]
) -> None:
    for corner in range(3):
        for axis in range(3):
            seen[corner, axis] = 0.0
            for k in range(3):
                seen[corner, axis] += frame[axis, k] * (triangle[corner, k] - origin[k])
