"""Exact swept contact: the steps of a straight move in which one set of triangles meets another.

A part moves by t along an axis. Seen along that axis, two triangles can meet only where their projections overlap.
There the distance between them is linear: over the overlap polygon its least and greatest values are at corners. So
the pair touches in one closed interval of t, found without sampling. Faces parallel to the move have no projection;
solids cannot meet through them alone.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import inline_kernel, kernel, leaf_kernel

_NO_AREA_M2 = 1e-10
_TOUCH_M = 1e-6
_HALF_ROPE_M = 0.012
FAR_M = 10_000.0
_NOWHERE = np.zeros(3)


def blocked_steps(
    moving_m: NDArray[np.float64],
    fixed_m: NDArray[np.float64],
    axis: int,
    direction: int,
    step_m: float,
    count: int,
    shift_m: NDArray[np.float64] = _NOWHERE,
) -> NDArray[np.bool_]:
    """Return which steps of a straight move make the moving triangles meet the fixed ones.

    Args:
        moving_m: (A, 3, 3) triangles at the start of the move, but for ``shift_m``.
        fixed_m: (B, 3, 3) triangles.
        axis: 0, 1 or 2.
        direction: +1 or -1 along the axis.
        step_m: Length of a step.
        count: Number of steps.
        shift_m: (3,) added to the moving triangles.

    Returns:
        (count,) bool: step k covers the distances between ``k * step_m`` and ``(k + 1) * step_m``.
    """
    blocked = np.zeros(count, np.bool_)
    if len(moving_m) and len(fixed_m):
        _mark_blocked(moving_m, shift_m, fixed_m, (axis, direction), step_m, blocked)
    return blocked


def rope_meets(triangles_m: NDArray[np.float64], foot_m: NDArray[np.float64]) -> bool:
    """Return whether a rope straight up from a point, (3,) metres, meets any of (F, 3, 3) triangles.

    The rope is a square column of 24 mm, tested as a thin square that moves up.
    """
    x, y, z = foot_m
    a, b, c, d = ((x + sx * _HALF_ROPE_M, y + sy * _HALF_ROPE_M, z) for sx, sy in ((-1, -1), (1, -1), (1, 1), (-1, 1)))
    return bool(blocked_steps(np.array([[a, b, c], [a, c, d]]), triangles_m, 2, 1, FAR_M, 1)[0])


@kernel
def _mark_blocked(
    moving_m: NDArray[np.float64],
    shift_m: NDArray[np.float64],
    fixed_m: NDArray[np.float64],
    move: tuple[int, int],
    step_m: float,
    blocked: NDArray[np.bool_],
) -> None:
    """Mark the blocked steps of a move along (axis, direction)."""
    own, other = _bounds(moving_m, shift_m, move), _bounds(fixed_m, np.zeros(3), move)
    # Only triangles within the other part's outline and ahead of the move matter.
    outline = np.empty((2, 3))
    for k in range(2):
        outline[0, k], outline[1, k] = max(own[0, k], other[0, k]), min(own[1, k], other[1, k])
        if outline[0, k] >= outline[1, k]:
            return
    outline[0, 2], outline[1, 2] = -np.inf, np.inf
    moving = _within(moving_m, shift_m, move, outline)
    if moving.shape[0] == 0:
        return
    low, high = np.inf, -np.inf
    for f in range(moving.shape[0]):
        for corner in range(3):
            low, high = min(low, moving[f, corner, 2]), max(high, moving[f, corner, 2])
    outline[0, 2], outline[1, 2] = low, high + step_m * blocked.shape[0]
    fixed = _within(fixed_m, np.zeros(3), move, outline)
    _mark_pairs(moving, fixed, step_m, blocked)


@inline_kernel
def _seen_along(
    triangle: NDArray[np.float64], shift_m: NDArray[np.float64], move: tuple[int, int], corner: int, k: int
) -> float:
    """Return a coordinate with the axis of the move last, positive in the direction of the move."""
    axis, direction = move
    n = (axis + 1 + k) % 3
    found: float = triangle[corner, n] + shift_m[n]
    return -found if k == 2 and direction < 0 else found


@kernel
def _bounds(
    triangles_m: NDArray[np.float64], shift_m: NDArray[np.float64], move: tuple[int, int]
) -> NDArray[np.float64]:
    """Return (2, 3) lowest and highest coordinates as seen along the move."""
    result = np.empty((2, 3))
    result[0], result[1] = np.inf, -np.inf
    for n in range(triangles_m.shape[0]):
        for corner in range(3):
            for k in range(3):
                value = _seen_along(triangles_m[n], shift_m, move, corner, k)
                result[0, k], result[1, k] = min(result[0, k], value), max(result[1, k], value)
    return result


@kernel
def _within(
    triangles_m: NDArray[np.float64], shift_m: NDArray[np.float64], move: tuple[int, int], outline: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the (N, 3, 3) triangles, as seen along the move, whose boxes overlap a box."""
    found = np.empty_like(triangles_m)
    size = 0
    for n in range(triangles_m.shape[0]):
        for k in range(3):
            for corner in range(3):
                found[size, corner, k] = _seen_along(triangles_m[n], shift_m, move, corner, k)
            low, high = _span(found[size], k)
            if high <= outline[0, k] or low >= outline[1, k]:
                break
        else:
            size += 1
    return found[:size]


@kernel
def _mark_pairs(
    moving: NDArray[np.float64], fixed: NDArray[np.float64], step_m: float, blocked: NDArray[np.bool_]
) -> None:
    count = blocked.shape[0]
    corners = np.empty((2, 9, 2))
    for a in range(moving.shape[0]):
        plane = plane_of(moving[a])
        for b in range(fixed.shape[0]):
            least, most = contact(moving[a], plane, fixed[b], step_m * count, corners)
            if most < least:
                continue
            k0 = min(count - 1, int((least + _TOUCH_M) / step_m))
            k1 = max(k0, min(count - 1, int((most - _TOUCH_M) / step_m)))
            for k in range(k0, k1 + 1):
                blocked[k] = True
            if count == 1:
                return


@leaf_kernel
def contact(
    one: NDArray[np.float64],
    plane: tuple[float, float, float, float],
    other: NDArray[np.float64],
    far_m: float,
    corners: NDArray[np.float64],
) -> tuple[float, float]:
    """Return the interval of a move along z in which a triangle meets another; the second value is less if it is empty.

    Args:
        one: (3, 3) the triangle that moves.
        plane: ``plane_of`` it.
        other: (3, 3) the other one.
        far_m: Length of the move.
        corners: (2, 9, 2) for its own use.
    """
    nothing = 1.0, 0.0
    if plane[3] == 0.0:
        return nothing
    for k in range(2):
        low, high = _span(one, k)
        other_low, other_high = _span(other, k)
        if other_high <= low or other_low >= high:
            return nothing
    low, high = _span(one, 2)
    other_low, other_high = _span(other, 2)
    if other_high <= low or other_low >= high + far_m:
        return nothing
    over = plane_of(other)
    if over[3] == 0.0:
        return nothing
    polygon = corners[0]
    count = projected_overlap(one, other, polygon, corners[1])
    if count < 3 or overlap_area(polygon, count) < _NO_AREA_M2:
        return nothing
    least, most = np.inf, -np.inf
    for c in range(count):
        x, y = polygon[c, 0], polygon[c, 1]
        gap = (over[0] * x + over[1] * y + over[2]) - (plane[0] * x + plane[1] * y + plane[2])
        least, most = min(least, gap), max(most, gap)
    least, most = max(least, 0.0), min(most, far_m)
    if most <= _TOUCH_M or least >= far_m - _TOUCH_M:
        return nothing
    return least, most


@leaf_kernel
def _span(triangle: NDArray[np.float64], axis: int) -> tuple[float, float]:
    a, b, c = triangle[0, axis], triangle[1, axis], triangle[2, axis]
    return min(a, b, c), max(a, b, c)


@leaf_kernel
def plane_of(triangle: NDArray[np.float64]) -> tuple[float, float, float, float]:
    """Return (p, q, r, 1) with z = p x + q y + r on the triangle, or zeros if it is seen edge-on."""
    ux, uy, uz = triangle[1, 0] - triangle[0, 0], triangle[1, 1] - triangle[0, 1], triangle[1, 2] - triangle[0, 2]
    vx, vy, vz = triangle[2, 0] - triangle[0, 0], triangle[2, 1] - triangle[0, 1], triangle[2, 2] - triangle[0, 2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    if abs(nz) <= 1e-9 * (abs(nx) + abs(ny) + abs(nz)) or abs(nz) < 2.0 * _NO_AREA_M2:
        return 0.0, 0.0, 0.0, 0.0
    p, q = -nx / nz, -ny / nz
    return p, q, triangle[0, 2] - p * triangle[0, 0] - q * triangle[0, 1], 1.0


@leaf_kernel
def projected_overlap(
    one: NDArray[np.float64], other: NDArray[np.float64], polygon: NDArray[np.float64], clipped: NDArray[np.float64]
) -> int:
    """Clip one projected triangle by the other (Sutherland and Hodgman 1974) and return the polygon's corner count.

    The corners are written to ``polygon``.
    """
    for c in range(3):
        polygon[c, 0], polygon[c, 1] = one[c, 0], one[c, 1]
    size = 3
    turn = (other[1, 0] - other[0, 0]) * (other[2, 1] - other[0, 1]) - (other[1, 1] - other[0, 1]) * (
        other[2, 0] - other[0, 0]
    )
    for edge in range(3):
        ax, ay = other[edge, 0], other[edge, 1]
        bx, by = other[(edge + 1) % 3, 0], other[(edge + 1) % 3, 1]
        if turn < 0.0:
            ax, ay, bx, by = bx, by, ax, ay
        kept = 0
        for c in range(size):
            px, py = polygon[c, 0], polygon[c, 1]
            qx, qy = polygon[(c + 1) % size, 0], polygon[(c + 1) % size, 1]
            side_p = (bx - ax) * (py - ay) - (by - ay) * (px - ax)
            side_q = (bx - ax) * (qy - ay) - (by - ay) * (qx - ax)
            if side_p >= 0.0:
                clipped[kept, 0], clipped[kept, 1] = px, py
                kept += 1
            if (side_p > 0.0 and side_q < 0.0) or (side_p < 0.0 and side_q > 0.0):
                share = side_p / (side_p - side_q)
                clipped[kept, 0], clipped[kept, 1] = px + share * (qx - px), py + share * (qy - py)
                kept += 1
        size = kept
        for c in range(size):
            polygon[c, 0], polygon[c, 1] = clipped[c, 0], clipped[c, 1]
        if size < 3:
            return 0
    return size


@leaf_kernel
def overlap_area(polygon: NDArray[np.float64], corners: int) -> float:
    """Return the area of a convex polygon of so many corners."""
    twice = 0.0
    for c in range(corners):
        d = (c + 1) % corners
        twice += polygon[c, 0] * polygon[d, 1] - polygon[d, 0] * polygon[c, 1]
    return abs(twice) / 2.0
