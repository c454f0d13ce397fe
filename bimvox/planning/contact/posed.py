"""Whether a part in a pose, aside and tilted, meets what is around it, and whether it does on a straight step.

The part is seen along the direction in which it is guided as x, from its centre of mass; it is tilted about y. Its
triangles and those around it are the leaves of two trees of boxes. A box of the part is turned with it, so one tree
serves every pose. Two triangles meet unless an axis separates them; on a straight step the exact sweep decides.
What is met once is tested first the next time: most blocked poses meet the same triangles. The answer does not depend
on the order of the tests.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.planning.contact.sweep import contact, plane_of

LEVEL, ALONG, UP = 0, 1, 2
"""No step: a pose; a step along x; a step along z."""

_BITS = 10
_ROUNDING_M = 1e-9
_NOTHING_M = -1e9
_KEPT = 8
_DEEPEST = 128


class Group(NamedTuple):
    """Triangles that must not meet.

    Attributes:
        part_m: (F, 3, 3) float64 of the part at its place, seen as above.
        other_m: (G, 3, 3) float64 of what is around it.
        aside_m: (3,) by which the part is moved: the way out of a modelled clash.
    """

    part_m: NDArray[np.float64]
    other_m: NDArray[np.float64]
    aside_m: NDArray[np.float64]


class Posed(NamedTuple):
    """Groups as the kernels read them, and what they remember.

    Attributes:
        part_m: (F, 3, 3) triangles of all trees of the part.
        part_boxes_m: (N, 2, 3) middle and half size of each box.
        other_m: (G, 3, 3) triangles of all trees around it.
        other_boxes_m: (M, 2, 3).
        groups: (K, 6) int64, for both trees: first box, number of leaves, first triangle.
        aside_m: (K, 3).
        met: (3, W, 3) int64 group, triangle of the part and other triangle that met, by kind of step; -1: none yet.
        counted: (1,) int64 boxes and triangles compared so far.
    """

    part_m: NDArray[np.float64]
    part_boxes_m: NDArray[np.float64]
    other_m: NDArray[np.float64]
    other_boxes_m: NDArray[np.float64]
    groups: NDArray[np.int64]
    aside_m: NDArray[np.float64]
    met: NDArray[np.int64]
    counted: NDArray[np.int64]


def posed(groups: Sequence[Group]) -> Posed:
    """Return groups as the kernels read them."""
    parts, others = _Forest(), _Forest()
    rows = [(*parts.tree(group.part_m), *others.tree(group.other_m)) for group in groups]
    return Posed(
        *parts.whole(),
        *others.whole(),
        np.array(rows, np.int64).reshape(-1, 6),
        np.array([group.aside_m for group in groups]).reshape(-1, 3),
        np.full((3, _KEPT, 3), -1, np.int64),
        np.zeros(1, np.int64),
    )


class _Forest:
    """Trees of boxes over triangles, one after the other; one for equal arrays."""

    def __init__(self) -> None:
        self._known: dict[int, tuple[int, int, int]] = {}
        self._triangles_m, self._boxes_m = [np.zeros((0, 3, 3))], [np.zeros((0, 2, 3))]
        self._boxes = self._triangles = 0

    def tree(self, triangles_m: NDArray[np.float64]) -> tuple[int, int, int]:
        """Return the first box, the number of leaves and the first triangle of a tree."""
        if id(triangles_m) not in self._known:
            ordered_m = triangles_m[order_along_curve(triangles_m.mean(axis=1))]
            boxes_m = tree_boxes(ordered_m)
            self._known[id(triangles_m)] = (self._boxes, len(boxes_m) // 2, self._triangles)
            self._triangles_m.append(ordered_m)
            self._boxes_m.append(boxes_m)
            self._boxes, self._triangles = self._boxes + len(boxes_m), self._triangles + len(ordered_m)
        return self._known[id(triangles_m)]

    def whole(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return all triangles and all boxes."""
        return np.ascontiguousarray(np.concatenate(self._triangles_m)), np.concatenate(self._boxes_m)


def order_along_curve(middle_m: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return points along a curve that stays in one region before the next (Morton 1966)."""
    low = middle_m.min(axis=0)
    cells = ((middle_m - low) * ((1 << _BITS) - 1) / max(float(np.ptp(middle_m, axis=0).max()), 1e-9)).astype(np.int64)
    code = np.zeros(len(middle_m), np.int64)
    for bit in range(_BITS):
        for axis in range(3):
            code |= (cells[:, axis] >> bit & 1) << (3 * bit + axis)
    return np.argsort(code, kind="stable")


def tree_boxes(triangles_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (2 L, 2, 3) middle and half size of the boxes of a tree: the root is 1, the children of n 2 n, 2 n + 1."""
    leaves = 1 << (len(triangles_m) - 1).bit_length()
    low, high = np.full((leaves, 3), np.inf), np.full((leaves, 3), -np.inf)
    low[: len(triangles_m)], high[: len(triangles_m)] = triangles_m.min(axis=1), triangles_m.max(axis=1)
    levels = [(low, high)]
    while len(low) > 1:
        low, high = low.reshape(-1, 2, 3).min(axis=1), high.reshape(-1, 2, 3).max(axis=1)
        levels.append((low, high))
    nothing = np.full((1, 3), np.inf)
    low = np.concatenate([nothing, *(one for one, _ in levels[::-1])])
    high = np.concatenate([-nothing, *(one for _, one in levels[::-1])])
    is_empty = low > high
    low[is_empty], high[is_empty] = 0.0, 0.0
    half = np.where(is_empty, _NOTHING_M, (high - low) / 2.0 + _ROUNDING_M)
    return np.stack([(low + high) / 2.0, half], axis=1)


@kernel
def meets(shapes: Posed, pose: tuple[float, float, float], step: int, length_m: float) -> bool:
    """Return whether the part meets anything in a pose (height, aside, tilt), or on a step of a length from it."""
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    met, work = shapes.met[step], (np.empty((2, 3, 3)), np.empty((2, 9, 2)))
    for n in range(_KEPT):
        if met[n, 0] >= 0 and _pair_meets(shapes, met[n], (pose[0], pose[1], cos, sin), step, length_m, work):
            return True
    waiting, pair = np.empty((_DEEPEST, 2), np.int64), np.empty(3, np.int64)
    for g in range(shapes.groups.shape[0]):
        pair[0] = g
        if _group_meets(shapes, pair, (pose[0], pose[1], cos, sin), step, length_m, work, waiting):
            for n in range(_KEPT - 1, 0, -1):
                for k in range(3):
                    met[n, k] = met[n - 1, k]
            for k in range(3):
                met[0, k] = pair[k]
            return True
    return False


@kernel
def meets_between(
    shapes: Posed, start: tuple[float, float, float], end: tuple[float, float, float], count: int
) -> bool:
    """Return whether the part meets anything in ``count + 1`` poses from one to another.

    Those far from each other are tested first.
    """
    if meets(shapes, start, LEVEL, 0.0) or meets(shapes, end, LEVEL, 0.0):
        return True
    apart = 1
    while 2 * apart < count:
        apart *= 2
    while apart:
        for n in range(apart, count, 2 * apart):
            share = n / count
            pose = (
                start[0] + share * (end[0] - start[0]),
                start[1] + share * (end[1] - start[1]),
                start[2] + share * (end[2] - start[2]),
            )
            if meets(shapes, pose, LEVEL, 0.0):
                return True
        apart //= 2
    return False


@leaf_kernel
def _group_meets(
    shapes: Posed,
    pair: NDArray[np.int64],
    at: tuple[float, float, float, float],
    step: int,
    length_m: float,
    work: tuple[NDArray[np.float64], NDArray[np.float64]],
    waiting: NDArray[np.int64],
) -> bool:
    """Return whether the triangles of a group meet, and set ``pair`` to the two that do."""
    g = pair[0]
    up, aside, cos, sin = at
    own_boxes, own_leaves, own_first = shapes.groups[g, 0], shapes.groups[g, 1], shapes.groups[g, 2]
    boxes, leaves, first = shapes.groups[g, 3], shapes.groups[g, 4], shapes.groups[g, 5]
    x_m, y_m, z_m = shapes.aside_m[g, 0] + aside, shapes.aside_m[g, 1], shapes.aside_m[g, 2] + up
    far_x = length_m / 2.0 if step == ALONG else 0.0
    far_z = length_m / 2.0 if step == UP else 0.0
    steep = abs(sin)
    waiting[0, 0], waiting[0, 1] = 1, 1
    left = 1
    while left:
        left -= 1
        a, b = waiting[left, 0], waiting[left, 1]
        shapes.counted[0] += 1
        own, other = shapes.part_boxes_m[own_boxes + a], shapes.other_boxes_m[boxes + b]
        if abs(own[0, 1] + y_m - other[0, 1]) > own[1, 1] + other[1, 1]:
            continue
        x = cos * own[0, 0] - sin * own[0, 2] + x_m + far_x - other[0, 0]
        if abs(x) > cos * own[1, 0] + steep * own[1, 2] + far_x + other[1, 0]:
            continue
        z = sin * own[0, 0] + cos * own[0, 2] + z_m + far_z - other[0, 2]
        if abs(z) > steep * own[1, 0] + cos * own[1, 2] + far_z + other[1, 2]:
            continue
        # The same along the part as it is tilted: a long box that leans is in the way of little.
        if abs(cos * x + sin * z) > own[1, 0] + cos * (other[1, 0] + far_x) + steep * (other[1, 2] + far_z):
            continue
        if abs(cos * z - sin * x) > own[1, 2] + steep * (other[1, 0] + far_x) + cos * (other[1, 2] + far_z):
            continue
        if b < leaves:  # what is around first: the part is one long thing, and much of what is around is far from it
            waiting[left, 0], waiting[left, 1] = a, 2 * b
            waiting[left + 1, 0], waiting[left + 1, 1] = a, 2 * b + 1
            left += 2
        elif a < own_leaves:
            waiting[left, 0], waiting[left, 1] = 2 * a, b
            waiting[left + 1, 0], waiting[left + 1, 1] = 2 * a + 1, b
            left += 2
        else:
            pair[1], pair[2] = own_first + a - own_leaves, first + b - leaves
            if _pair_meets(shapes, pair, at, step, length_m, work):
                return True
    return False


@leaf_kernel
def _pair_meets(
    shapes: Posed,
    pair: NDArray[np.int64],
    at: tuple[float, float, float, float],
    step: int,
    length_m: float,
    work: tuple[NDArray[np.float64], NDArray[np.float64]],
) -> bool:
    """Return whether two triangles meet: (group, triangle of the part, other triangle)."""
    shapes.counted[0] += 1
    up, aside, cos, sin = at
    own, other, way = shapes.part_m[pair[1]], shapes.other_m[pair[2]], shapes.aside_m[pair[0]]
    first, second = work[0][0], work[0][1]
    for corner in range(3):
        x = cos * own[corner, 0] - sin * own[corner, 2] + way[0] + aside
        y = own[corner, 1] + way[1]
        z = sin * own[corner, 0] + cos * own[corner, 2] + way[2] + up
        if step == ALONG:  # the axis of a step comes last
            first[corner, 0], first[corner, 1], first[corner, 2] = y, z, x
            second[corner, 0], second[corner, 1] = other[corner, 1], other[corner, 2]
            second[corner, 2] = other[corner, 0]
        else:
            first[corner, 0], first[corner, 1], first[corner, 2] = x, y, z
            for k in range(3):
                second[corner, k] = other[corner, k]
    if step == LEVEL:
        return _are_together(first, second)
    least, most = contact(first, plane_of(first), second, length_m, work[1])
    return most >= least


@leaf_kernel
def _are_together(one: NDArray[np.float64], other: NDArray[np.float64]) -> bool:
    """Return whether no axis separates two triangles; they are together if they touch."""
    for k in range(3):
        if min(one[0, k], one[1, k], one[2, k]) > max(other[0, k], other[1, k], other[2, k]):
            return False
        if max(one[0, k], one[1, k], one[2, k]) < min(other[0, k], other[1, k], other[2, k]):
            return False
    n = _normal(one)
    m = _normal(other)
    if _is_apart(one, other, n) or _is_apart(one, other, m):
        return False
    for i in range(3):
        e = _edge(one, i)
        if _is_apart(one, other, _cross(e, n)):
            return False
        for j in range(3):
            if _is_apart(one, other, _cross(e, _edge(other, j))):
                return False
    for j in range(3):  # noqa: SIM110  (numba)
        if _is_apart(one, other, _cross(_edge(other, j), m)):
            return False
    return True


@leaf_kernel
def _is_apart(one: NDArray[np.float64], other: NDArray[np.float64], axis: tuple[float, float, float]) -> bool:
    """Return whether the shadows of two triangles on an axis are apart."""
    low, high, other_low, other_high = np.inf, -np.inf, np.inf, -np.inf
    for corner in range(3):
        own, far = 0.0, 0.0
        for k in range(3):
            own += axis[k] * (one[corner, k] - one[0, k])
            far += axis[k] * (other[corner, k] - one[0, k])
        low, high = min(low, own), max(high, own)
        other_low, other_high = min(other_low, far), max(other_high, far)
    return low > other_high or other_low > high


@leaf_kernel
def _edge(triangle: NDArray[np.float64], corner: int) -> tuple[float, float, float]:
    after = (corner + 1) % 3
    return (
        triangle[after, 0] - triangle[corner, 0],
        triangle[after, 1] - triangle[corner, 1],
        triangle[after, 2] - triangle[corner, 2],
    )


@leaf_kernel
def _normal(triangle: NDArray[np.float64]) -> tuple[float, float, float]:
    return _cross(_edge(triangle, 0), _edge(triangle, 1))


@leaf_kernel
def _cross(a: tuple[float, float, float], b: tuple[float, float, float]) -> tuple[float, float, float]:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
