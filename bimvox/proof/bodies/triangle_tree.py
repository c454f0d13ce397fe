"""A tree of boxes over triangles, and ray queries on it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import inline_kernel, kernel, leaf_kernel

_LEAF = 4
_SAME_M = 1e-7


def tree_over(
    low: NDArray[np.float64], high: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.int64]]:
    """Return the order of the triangles, and boxes and spans of the nodes: halved along the longest side."""
    order = np.arange(len(low))
    boxes, spans = np.empty((2 * len(low) + 1, 2, 3)), np.zeros((2 * len(low) + 1, 3), np.int64)
    count = _split(order, low + high, low, high, boxes, spans)
    return order, boxes[:count].copy(), spans[:count].copy()


@kernel
def _split(
    order: NDArray[np.int64],
    middle: NDArray[np.float64],
    low: NDArray[np.float64],
    high: NDArray[np.float64],
    boxes: NDArray[np.float64],
    spans: NDArray[np.int64],
) -> int:
    """Fill boxes and spans in depth-first order, and sort the triangles into their leaves."""
    waiting = np.empty((128, 3), np.int64)  # first, one after the last, the parent whose right child this is
    waiting[0, 0], waiting[0, 1], waiting[0, 2] = 0, order.shape[0], -1
    near, far, spare = np.empty(3), np.empty(3), np.empty(order.shape[0], np.int64)
    left, count = 1, 0
    while left:
        left -= 1
        first, last, parent = waiting[left, 0], waiting[left, 1], waiting[left, 2]
        node, count = count, count + 1
        if parent >= 0:
            spans[parent, 2] = node
        spans[node, 0], spans[node, 1] = first, last
        for k in range(3):
            boxes[node, 0, k], boxes[node, 1, k] = np.inf, -np.inf
            near[k], far[k] = np.inf, -np.inf
        for n in range(first, last):
            for k in range(3):
                boxes[node, 0, k] = min(boxes[node, 0, k], low[order[n], k])
                boxes[node, 1, k] = max(boxes[node, 1, k], high[order[n], k])
                near[k], far[k] = min(near[k], middle[order[n], k]), max(far[k], middle[order[n], k])
        if last - first <= _LEAF:
            continue
        axis = 0
        for k in range(1, 3):
            if far[k] - near[k] > far[axis] - near[axis]:
                axis = k
        _sort(order, first, last, middle, axis, spare)
        half = (first + last) // 2
        waiting[left, 0], waiting[left, 1], waiting[left, 2] = half, last, node
        waiting[left + 1, 0], waiting[left + 1, 1], waiting[left + 1, 2] = first, half, -1
        left += 2
    return count


@leaf_kernel
def _sort(
    order: NDArray[np.int64],
    first: int,
    last: int,
    middle: NDArray[np.float64],
    axis: int,
    spare: NDArray[np.int64],
) -> None:
    """Sort a span of triangles along an axis; equal ones keep their order (merge sort; NumPy takes 2 s to compile)."""
    width = 1
    while width < last - first:
        for begin in range(first, last, 2 * width):
            half, end = min(begin + width, last), min(begin + 2 * width, last)
            one, other = begin, half
            for n in range(begin, end):
                takes_one = other == end or (one < half and middle[order[one], axis] <= middle[order[other], axis])
                if takes_one:
                    spare[n] = order[one]
                    one += 1
                else:
                    spare[n] = order[other]
                    other += 1
        for n in range(first, last):
            order[n] = spare[n]
        width *= 2


@kernel
def crossed(
    corners: NDArray[np.float64],
    normals: NDArray[np.float64],
    boxes: NDArray[np.float64],
    spans: NDArray[np.int64],
    start: NDArray[np.float64],
    ray: NDArray[np.float64],
    own: int,
) -> tuple[int, int, float]:
    """Return how many other triangles a ray crosses, the sum of their signs, and the distance to the nearest."""
    waiting = np.empty(64, np.int64)
    waiting[0], left = 0, 1
    crossings, winding, nearest = 0, 0, np.inf
    while left:
        left -= 1
        node = waiting[left]
        enters, leaves = 0.0, np.inf
        for k in range(3):
            if ray[k] != 0.0:
                one = (boxes[node, 0, k] - _SAME_M - start[k]) / ray[k]
                other = (boxes[node, 1, k] + _SAME_M - start[k]) / ray[k]
                enters, leaves = max(enters, min(one, other)), min(leaves, max(one, other))
            elif start[k] < boxes[node, 0, k] - _SAME_M or start[k] > boxes[node, 1, k] + _SAME_M:
                leaves = -1.0
        if enters > leaves:
            continue
        if spans[node, 2]:
            waiting[left], waiting[left + 1] = spans[node, 2], node + 1
            left += 2
            continue
        for f in range(spans[node, 0], spans[node, 1]):
            if f == own:
                continue
            slope = normals[f, 0] * ray[0] + normals[f, 1] * ray[1] + normals[f, 2] * ray[2]
            if abs(slope) < 1e-9:
                continue
            above = 0.0
            for k in range(3):
                above += normals[f, k] * (corners[f, 0, k] - start[k])
            way = above / slope
            if way <= _SAME_M:
                continue
            x, y, z = start[0] + way * ray[0], start[1] + way * ray[1], start[2] + way * ray[2]
            if _is_over(corners[f], normals[f], x, y, z):
                crossings += 1
                winding += 1 if slope > 0.0 else -1
                nearest = min(nearest, way)
    return crossings, winding, nearest


@leaf_kernel
def nearest_both_ways(
    body: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]],
    own: int,
    starts: NDArray[np.float64],
    slowness: NDArray[np.float64],
    waiting: NDArray[np.int64],
    crossings: NDArray[np.int64],
    nearest: NDArray[np.float64],
) -> None:
    """Write what ``crossed`` finds along the normal of triangle ``own`` and against it, from each of several points.

    The rays are parallel and go down the tree together: nodes that none of them enters are left out.

    Args:
        body: Corners, normals, boxes and spans, as for ``crossed``.
        own: The triangle, which does not count.
        starts: (P, 3) the points, metres.
        slowness: (3,) 1 over each component of the normal, 0 for 0.
        waiting: Room for 64 nodes.
        crossings: (P, 2) receives how many triangles each ray crosses, ahead and behind.
        nearest: (P, 2) receives the distance to the nearest of them, metres; infinite if there is none.
    """
    corners, normals, boxes, spans = body
    x, y, z = normals[own, 0], normals[own, 1], normals[own, 2]
    for p in range(starts.shape[0]):
        crossings[p, 0], crossings[p, 1], nearest[p, 0], nearest[p, 1] = 0, 0, np.inf, np.inf
    waiting[0], left = 0, 1
    while left:
        left -= 1
        node = waiting[left]
        p = 0
        while p < starts.shape[0] and not _enters(boxes, node, starts, p, slowness):
            p += 1
        if p == starts.shape[0]:
            continue
        if spans[node, 2]:
            waiting[left], waiting[left + 1] = spans[node, 2], node + 1
            left += 2
            continue
        for f in range(spans[node, 0], spans[node, 1]):
            slope = normals[f, 0] * x + normals[f, 1] * y + normals[f, 2] * z
            if f == own or abs(slope) < 1e-9:
                continue
            for n in range(p, starts.shape[0]):
                if n > p and not _enters(boxes, node, starts, n, slowness):
                    continue
                above = 0.0
                for k in range(3):
                    above += normals[f, k] * (corners[f, 0, k] - starts[n, k])
                way = above / slope
                if abs(way) <= _SAME_M:
                    continue
                if not _is_over(
                    corners[f], normals[f], starts[n, 0] + way * x, starts[n, 1] + way * y, starts[n, 2] + way * z
                ):
                    continue
                side = 0 if way > 0.0 else 1
                crossings[n, side] += 1
                nearest[n, side] = min(nearest[n, side], abs(way))


@inline_kernel
def _enters(
    boxes: NDArray[np.float64], node: int, starts: NDArray[np.float64], p: int, slowness: NDArray[np.float64]
) -> bool:
    """Return whether a line through a point meets the box of a node."""
    enters, leaves = -np.inf, np.inf
    for k in range(3):
        if slowness[k] != 0.0:
            one = (boxes[node, 0, k] - _SAME_M - starts[p, k]) * slowness[k]
            other = (boxes[node, 1, k] + _SAME_M - starts[p, k]) * slowness[k]
            enters, leaves = max(enters, min(one, other)), min(leaves, max(one, other))
        elif starts[p, k] < boxes[node, 0, k] - _SAME_M or starts[p, k] > boxes[node, 1, k] + _SAME_M:
            return False
    return enters <= leaves


@inline_kernel
def _is_over(triangle: NDArray[np.float64], normal: NDArray[np.float64], x: float, y: float, z: float) -> bool:
    """Return whether a point in a triangle's plane is on the triangle."""
    for k in range(3):
        a, b = triangle[k], triangle[(k + 1) % 3]
        ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        vx, vy, vz = x - a[0], y - a[1], z - a[2]
        side = normal[0] * (uy * vz - uz * vy) + normal[1] * (uz * vx - ux * vz) + normal[2] * (ux * vy - uy * vx)
        if side < 0.0:
            return False
    return True
