"""Queries on a solid: whether a point is inside, whether its skin contains a triangle, whether surfaces cross."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.proof.bodies.triangle_tree import crossed

if TYPE_CHECKING:
    from bimvox.proof.bodies.solid import Solid

_ROUNDING_M = 1e-6
_RAYS = np.array([[0.5341, 0.2287, 0.8139], [-0.8243, 0.4571, 0.3343], [0.2951, -0.9103, -0.2903]])


@kernel
def is_inside(solid: Solid, point: NDArray[np.float64]) -> bool:
    """Return whether a point, (3,) metres, is inside, by the majority of three rays."""
    votes, way = 0, np.empty(3)
    for ray in range(3):
        for k in range(3):
            way[k] = _RAYS[ray, k]
        crossings, winding, _ = crossed(solid.corners_m, solid.normals, solid.boxes_m, solid.spans, point, way, -1)
        if (solid.is_matched and winding != 0) or (not solid.is_matched and crossings % 2 == 1):
            votes += 1
        if ray == 1 and votes != 1:
            break
    return votes >= 2


@kernel
def in_skin(solid: Solid, points: NDArray[np.float64]) -> bool:
    """Return whether the skin of one triangle contains all points, (P, 3), and, as it is convex, all between them."""
    waiting = np.empty(64, np.int64)
    waiting[0], left, reach = 0, 1, 2.0 * solid.deepest_m * solid.deepest_m
    while left:
        left -= 1
        node = waiting[left]
        away = 0.0
        for k in range(3):
            out = max(solid.boxes_m[node, 0, k] - points[0, k], points[0, k] - solid.boxes_m[node, 1, k], 0.0)
            away += out * out
        if away > reach:
            continue
        if solid.spans[node, 2]:
            waiting[left], waiting[left + 1] = solid.spans[node, 2], node + 1
            left += 2
            continue
        for f in range(solid.spans[node, 0], solid.spans[node, 1]):
            n = 0
            while n < points.shape[0] and _holds(solid, f, solid.skins_m[f], points[n]):
                n += 1
            if n == points.shape[0]:
                return True
    return False


@leaf_kernel
def _holds(solid: Solid, f: int, skin: float, point: NDArray[np.float64]) -> bool:
    """Return whether the skin of a triangle contains a point: near its plane, and near its outline in that plane."""
    normal, triangle = solid.normals[f], solid.corners_m[f]
    off = 0.0
    for k in range(3):
        off += normal[k] * (point[k] - triangle[0, k])
    if abs(off) > skin:
        return False
    x, y, z = point[0] - off * normal[0], point[1] - off * normal[1], point[2] - off * normal[2]
    return bool(from_triangle(triangle, x, y, z) <= skin * skin)


@leaf_kernel
def from_triangle(triangle: NDArray[np.float64], x: float, y: float, z: float) -> float:
    """Return the square of the distance of a point from a triangle (Ericson, Real-Time Collision Detection, 5.1.5)."""
    a0, a1, a2 = triangle[0, 0], triangle[0, 1], triangle[0, 2]
    u0, u1, u2 = triangle[1, 0] - a0, triangle[1, 1] - a1, triangle[1, 2] - a2
    v0, v1, v2 = triangle[2, 0] - a0, triangle[2, 1] - a1, triangle[2, 2] - a2
    p0, p1, p2 = x - a0, y - a1, z - a2
    d1, d2 = u0 * p0 + u1 * p1 + u2 * p2, v0 * p0 + v1 * p1 + v2 * p2
    if d1 <= 0.0 and d2 <= 0.0:
        return float(p0 * p0 + p1 * p1 + p2 * p2)
    uu, uv, vv = u0 * u0 + u1 * u1 + u2 * u2, u0 * v0 + u1 * v1 + u2 * v2, v0 * v0 + v1 * v1 + v2 * v2
    d3, d4, d5, d6 = d1 - uu, d2 - uv, d1 - uv, d2 - vv
    along, across = 0.0, 0.0
    vc, vb, va = d1 * d4 - d3 * d2, d5 * d2 - d1 * d6, d3 * d6 - d5 * d4
    if d3 >= 0.0 and d4 <= d3:
        along, across = 1.0, 0.0
    elif d6 >= 0.0 and d5 <= d6:
        along, across = 0.0, 1.0
    elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        along, across = d1 / (d1 - d3), 0.0
    elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        along, across = 0.0, d2 / (d2 - d6)
    elif va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        across = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        along = 1.0 - across
    else:
        total = va + vb + vc
        along, across = vb / total, vc / total
    q0, q1, q2 = p0 - along * u0 - across * v0, p1 - along * u1 - across * v1, p2 - along * u2 - across * v2
    return float(q0 * q0 + q1 * q1 + q2 * q2)


@kernel
def crosses_surface(
    solid: Solid, triangle: NDArray[np.float64], low: NDArray[np.float64], high: NDArray[np.float64]
) -> bool:
    """Return whether a triangle ((3, 3) metres), moved by any offset in a box, crosses the surface.

    Touching does not count. For one offset (``low`` equal to ``high``) the answer is exact. For a box, only "no" is.
    """
    waiting = np.empty(64, np.int64)
    waiting[0], left = 0, 1
    while left:
        left -= 1
        node = waiting[left]
        apart = False
        for k in range(3):
            one, other, another = triangle[0, k], triangle[1, k], triangle[2, k]
            apart |= solid.boxes_m[node, 0, k] > max(one, other, another) + high[k]
            apart |= solid.boxes_m[node, 1, k] < min(one, other, another) + low[k]
        if apart:
            continue
        if solid.spans[node, 2]:
            waiting[left], waiting[left + 1] = solid.spans[node, 2], node + 1
            left += 2
            continue
        for f in range(solid.spans[node, 0], solid.spans[node, 1]):
            if not _are_apart(triangle, solid.corners_m[f], low, high):
                return True
    return False


@kernel
def surfaces_cross(solid: Solid, other: Solid, low: NDArray[np.float64], high: NDArray[np.float64]) -> bool:
    """Return whether the surfaces of two solids, the other moved by any offset in a box, cross; as for a triangle."""
    waiting = np.empty((256, 2), np.int64)
    waiting[0, 0], waiting[0, 1], left = 0, 0, 1
    while left:
        left -= 1
        node, there = waiting[left, 0], waiting[left, 1]
        apart = False
        for k in range(3):
            apart |= solid.boxes_m[node, 0, k] > other.boxes_m[there, 1, k] + high[k]
            apart |= solid.boxes_m[node, 1, k] < other.boxes_m[there, 0, k] + low[k]
        if apart:
            continue
        wide, wide_there = solid.spans[node, 1] - solid.spans[node, 0], other.spans[there, 1] - other.spans[there, 0]
        if solid.spans[node, 2] and (wide >= wide_there or not other.spans[there, 2]):
            waiting[left, 0], waiting[left, 1] = solid.spans[node, 2], there
            waiting[left + 1, 0], waiting[left + 1, 1] = node + 1, there
            left += 2
            continue
        if other.spans[there, 2]:
            waiting[left, 0], waiting[left, 1] = node, other.spans[there, 2]
            waiting[left + 1, 0], waiting[left + 1, 1] = node, there + 1
            left += 2
            continue
        for g in range(other.spans[there, 0], other.spans[there, 1]):
            for f in range(solid.spans[node, 0], solid.spans[node, 1]):
                if not _are_apart(other.corners_m[g], solid.corners_m[f], low, high):
                    return True
    return False


@leaf_kernel
def _are_apart(
    one: NDArray[np.float64], other: NDArray[np.float64], low_m: NDArray[np.float64], high_m: NDArray[np.float64]
) -> bool:
    """Return whether a plane separates two triangles, the first moved by any offset in a box.

    The plane is along one of them, or along an edge of each (11 directions).
    """
    for k in range(3):
        if min(one[0, k], one[1, k], one[2, k]) + low_m[k] >= max(other[0, k], other[1, k], other[2, k]) - _ROUNDING_M:
            return True
        if max(one[0, k], one[1, k], one[2, k]) + high_m[k] <= min(other[0, k], other[1, k], other[2, k]) + _ROUNDING_M:
            return True
    for way in range(11):
        if way < 2:
            triangle = one if way == 0 else other
            ax, ay, az = _edge(triangle, 0)
            bx, by, bz = _edge(triangle, 1)
        else:
            ax, ay, az = _edge(one, (way - 2) // 3)
            bx, by, bz = _edge(other, (way - 2) % 3)
        x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        length = np.sqrt(x * x + y * y + z * z)
        if length < 1e-14:
            continue
        low, high, other_low, other_high = np.inf, -np.inf, np.inf, -np.inf
        for k in range(3):
            at = x * one[k, 0] + y * one[k, 1] + z * one[k, 2]
            there = x * other[k, 0] + y * other[k, 1] + z * other[k, 2]
            low, high = min(low, at), max(high, at)
            other_low, other_high = min(other_low, there), max(other_high, there)
        low += min(x * low_m[0], x * high_m[0]) + min(y * low_m[1], y * high_m[1]) + min(z * low_m[2], z * high_m[2])
        high += max(x * low_m[0], x * high_m[0]) + max(y * low_m[1], y * high_m[1]) + max(z * low_m[2], z * high_m[2])
        slack = _ROUNDING_M * length
        if low >= other_high - slack or high <= other_low + slack:
            return True
    return False


@leaf_kernel
def _edge(triangle: NDArray[np.float64], k: int) -> tuple[float, float, float]:
    n = (k + 1) % 3
    return (triangle[n, 0] - triangle[k, 0], triangle[n, 1] - triangle[k, 1], triangle[n, 2] - triangle[k, 2])
