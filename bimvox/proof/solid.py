"""What the proof knows of a part's triangles: a tree over them, how thick the part is under each, and what is inside.

The *skin* of a part is the layer under its surface that another part may overlap; the rest inside it is its *core*.
The skin of a triangle reaches to either side of it, square to it, and as far beyond its outline. It is as deep as the
contact tolerance where the part is thick; where it is thin, 45 % of the thickness there, so that every member of a
profile or a frame keeps a core, however thin it is. The thickness is measured by rays from points on the triangle to
the first triangle opposite.

A point is inside a part if most of three slanted rays from it say so: by the sum of signed crossings if every edge of
the mesh is matched, otherwise by their parity. Sheets and open meshes have no inside where the rays disagree.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from bimvox.bim.building import TriangleMesh
from bimvox.compiled import kernel
from bimvox.proof.kept import kept

FINEST_M = 5e-4
"""A skin is this deep at least, and pieces of a surface with shorter edges are not divided any more."""
_ROUNDING_M = 1e-6
_SHARE_OF_THICKNESS = 0.45
_LEAF = 4
_APART_M = 0.25
_MOST_PARTS = 4
_NO_AREA_M2 = 1e-12
_SAME_M = 1e-7
_RAYS = np.array([[0.5341, 0.2287, 0.8139], [-0.8243, 0.4571, 0.3343], [0.2951, -0.9103, -0.2903]])


class Solid(NamedTuple):
    """A part's triangles, in the order of the tree's leaves.

    Attributes:
        corners_m: (F, 3, 3) float64 triangles with an area.
        normals: (F, 3) float64 unit normals.
        skins_m: (F,) float64 depth of the skin at each.
        deepest_m: The largest of these.
        boxes_m: (N, 2, 3) float64 lowest and highest corner of each node of the tree.
        spans: (N, 3) int64 first triangle, one after the last, and right child (the left one follows its parent); the
            right child of a leaf is 0.
        core_m: (2, 3) float64 a box around the core.
        is_matched: Whether every edge is used as often one way as the other.
        thickness_m: Mean thickness.
        seed_m: (K, 3) float64 a point of the core; none where no core was found.
        ends_m: (E, 3) float64 points on the surface: of every piece that hangs together those furthest along each axis.
    """

    corners_m: NDArray[np.float64]
    normals: NDArray[np.float64]
    skins_m: NDArray[np.float64]
    deepest_m: float
    boxes_m: NDArray[np.float64]
    spans: NDArray[np.int64]
    core_m: NDArray[np.float64]
    is_matched: bool
    thickness_m: float
    seed_m: NDArray[np.float64]
    ends_m: NDArray[np.float64]


@kept
def solid_of(mesh: TriangleMesh, tolerance_m: float) -> Solid:
    """Return what the proof knows of a mesh.

    Args:
        mesh: The part's triangles.
        tolerance_m: How deep the skin is where the part is thick.
    """
    triangles = mesh.triangles_m
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    areas = np.linalg.norm(normals, axis=1) / 2.0
    proper = areas > _NO_AREA_M2
    triangles, areas = np.ascontiguousarray(triangles[proper]), areas[proper]
    normals = normals[proper] / (2.0 * areas[:, None])
    low, high = mesh.bounds_m
    smallest_m = float((high - low).min())
    order, boxes, spans = _tree(triangles.min(axis=1), triangles.max(axis=1))
    triangles, normals, areas = triangles[order], normals[order], areas[order]
    if not len(triangles):
        nothing = np.zeros((0, 3))
        return Solid(triangles, normals, areas, 0.0, boxes, spans, np.zeros((2, 3)), False, 0.0, nothing, nothing)
    outward = 1.0 if mesh.signed_volume_m3 >= 0.0 else -1.0
    thick = np.minimum(_thicknesses(triangles, normals, boxes, spans, outward), smallest_m)
    skins = np.maximum(np.minimum(tolerance_m, _SHARE_OF_THICKNESS * thick), FINEST_M) + _ROUNDING_M
    least = float(skins.min()) - _ROUNDING_M
    solid = Solid(
        triangles,
        normals,
        skins,
        float(skins.max()),
        boxes,
        spans,
        np.stack([low + least, high - least]),
        _is_matched(mesh),
        float(np.average(thick, weights=areas)),
        np.zeros((0, 3)),
        _ends(triangles),
    )
    return solid._replace(seed_m=_seed(solid, thick, outward))


def _is_matched(mesh: TriangleMesh) -> bool:
    """Whether every edge is used as often in one direction as in the other; corners closer than 0.1 um are one."""
    _, number = np.unique(mesh.vertices_m.round(7), axis=0, return_inverse=True)
    faces = number.reshape(-1)[mesh.faces].astype(np.int64)
    first, second = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    key = np.minimum(first, second) * (len(mesh.vertices_m) + 1) + np.maximum(first, second)
    _, edge = np.unique(key, return_inverse=True)
    return not np.bincount(edge.reshape(-1), weights=np.sign(second - first)).any()


def _ends(triangles: NDArray[np.float64]) -> NDArray[np.float64]:
    """(E, 3) middles of the triangles that are furthest along each axis, either way, of every connected piece."""
    _, corner = np.unique(triangles.reshape(-1, 3).round(7), axis=0, return_inverse=True)
    first, second, third = corner.reshape(-1, 3).T
    count, ones = int(corner.max()) + 1, np.ones(2 * len(first))
    links = coo_matrix((ones, (np.r_[first, second], np.r_[second, third])), shape=(count, count))
    pieces = connected_components(links, directed=False)[1][first]
    middles = triangles.mean(axis=1)
    found = []
    for axis in range(3):
        order = np.lexsort((middles[:, axis], pieces))
        begins = np.flatnonzero(np.diff(pieces[order], prepend=-1))
        found += [order[begins], order[np.append(begins[1:], len(order)) - 1]]
    ends: NDArray[np.float64] = middles[np.unique(np.concatenate(found))]
    return ends


def _tree(
    low: NDArray[np.float64], high: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.int64]]:
    """Return the order of the triangles, boxes and spans of the nodes: halves along the longest side, to leaves."""
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
    left, count = 1, 0
    while left:
        left -= 1
        first, last, parent = waiting[left]
        node, count = count, count + 1
        if parent >= 0:
            spans[parent, 2] = node
        spans[node, 0], spans[node, 1] = first, last
        for k in range(3):
            boxes[node, 0, k], boxes[node, 1, k] = np.inf, -np.inf
        near, far = np.full(3, np.inf), np.full(3, -np.inf)
        for n in range(first, last):
            for k in range(3):
                boxes[node, 0, k] = min(boxes[node, 0, k], low[order[n], k])
                boxes[node, 1, k] = max(boxes[node, 1, k], high[order[n], k])
                near[k], far[k] = min(near[k], middle[order[n], k]), max(far[k], middle[order[n], k])
        if last - first <= _LEAF:
            continue
        axis = int(np.argmax(far - near))
        rank = np.argsort(middle[order[first:last], axis], kind="mergesort")
        sorted_order = order[first:last][rank]
        for n in range(first, last):
            order[n] = sorted_order[n - first]
        half = (first + last) // 2
        waiting[left, 0], waiting[left, 1], waiting[left, 2] = half, last, node
        waiting[left + 1, 0], waiting[left + 1, 1], waiting[left + 1, 2] = first, half, -1
        left += 2
    return count


@kernel
def _thicknesses(
    corners: NDArray[np.float64],
    normals: NDArray[np.float64],
    boxes: NDArray[np.float64],
    spans: NDArray[np.int64],
    outward: float,
) -> NDArray[np.float64]:
    """(F,) the least way through the part from points spread over each triangle; infinite where no ray hits."""
    thick = np.full(corners.shape[0], np.inf)
    for f in range(corners.shape[0]):
        a, b, c = corners[f, 0], corners[f, 1], corners[f, 2]
        longest = max(np.sqrt(((b - a) ** 2).sum()), np.sqrt(((c - b) ** 2).sum()), np.sqrt(((a - c) ** 2).sum()))
        parts = int(min(max(np.ceil(longest / _APART_M), 2), _MOST_PARTS))
        for i in range(parts):
            for j in range(parts - i):
                u, v = (i + 1.0 / 3.0) / parts, (j + 1.0 / 3.0) / parts
                point = a + u * (b - a) + v * (c - a)
                ahead, behind = (
                    _crossed(corners, normals, boxes, spans, point, normals[f], f),
                    _crossed(corners, normals, boxes, spans, point, -normals[f], f),
                )
                # The way into the part leaves it again: an odd number of crossings. Abutting shells are odd both ways.
                inward = np.inf
                if ahead[0] % 2 == 1:
                    inward = ahead[2]
                if behind[0] % 2 == 1:
                    inward = min(inward, behind[2])
                if ahead[0] % 2 == 0 and behind[0] % 2 == 0:
                    inward = behind[2] if outward > 0.0 else ahead[2]
                thick[f] = min(thick[f], inward)
    return thick


def _seed(solid: Solid, thick: NDArray[np.float64], outward: float) -> NDArray[np.float64]:
    """(K, 3) a point half way through the part, under the first triangle where that is in the core."""
    middles = solid.corners_m.mean(axis=1) - outward * solid.normals * thick[:, None] / 2.0
    for middle in middles[:64]:
        if is_inside(solid, middle) and not in_skin(solid, middle, middle, middle, middle):
            return np.asarray(middle[None], np.float64)
    return np.zeros((0, 3))


@kernel
def is_inside(solid: Solid, point: NDArray[np.float64]) -> bool:
    """Return whether a point, (3,) metres, is inside: what most of three rays say."""
    votes = 0
    for ray in range(3):
        crossings, winding, _ = _crossed(
            solid.corners_m, solid.normals, solid.boxes_m, solid.spans, point, _RAYS[ray], -1
        )
        if (solid.is_matched and winding != 0) or (not solid.is_matched and crossings % 2 == 1):
            votes += 1
        if ray == 1 and votes != 1:
            break
    return votes >= 2


@kernel
def _crossed(
    corners: NDArray[np.float64],
    normals: NDArray[np.float64],
    boxes: NDArray[np.float64],
    spans: NDArray[np.int64],
    start: NDArray[np.float64],
    ray: NDArray[np.float64],
    own: int,
) -> tuple[int, int, float]:
    """How many triangles but one's own a ray crosses, the sum of their signs, and the way to the nearest."""
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


@kernel
def _is_over(triangle: NDArray[np.float64], normal: NDArray[np.float64], x: float, y: float, z: float) -> bool:
    """Whether a point of a triangle's plane is on the triangle."""
    for k in range(3):
        a, b = triangle[k], triangle[(k + 1) % 3]
        ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        vx, vy, vz = x - a[0], y - a[1], z - a[2]
        side = normal[0] * (uy * vz - uz * vy) + normal[1] * (uz * vx - ux * vz) + normal[2] * (ux * vy - uy * vx)
        if side < 0.0:
            return False
    return True


@kernel
def in_skin(
    solid: Solid,
    middle: NDArray[np.float64],
    a: NDArray[np.float64],
    b: NDArray[np.float64],
    c: NDArray[np.float64],
) -> bool:
    """Return whether the skin of one triangle holds three points: it is convex, and holds everything between them.

    Args:
        solid: The solid.
        middle: (3,) a point between the three.
        a: (3,) metres.
        b: (3,)
        c: (3,)
    """
    waiting = np.empty(64, np.int64)
    waiting[0], left, reach = 0, 1, 2.0 * solid.deepest_m * solid.deepest_m
    while left:
        left -= 1
        node = waiting[left]
        away = 0.0
        for k in range(3):
            out = max(solid.boxes_m[node, 0, k] - middle[k], middle[k] - solid.boxes_m[node, 1, k], 0.0)
            away += out * out
        if away > reach:
            continue
        if solid.spans[node, 2]:
            waiting[left], waiting[left + 1] = solid.spans[node, 2], node + 1
            left += 2
            continue
        for f in range(solid.spans[node, 0], solid.spans[node, 1]):
            skin = solid.skins_m[f]
            if (
                _holds(solid, f, skin, middle)
                and _holds(solid, f, skin, a)
                and _holds(solid, f, skin, b)
                and _holds(solid, f, skin, c)
            ):
                return True
    return False


@kernel
def crosses_surface(solid: Solid, a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64]) -> bool:
    """Return whether a triangle, three (3,) points in metres, crosses the surface; touching it is not crossing."""
    waiting = np.empty(64, np.int64)
    waiting[0], left = 0, 1
    low, high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    one = np.empty((3, 3))
    one[0], one[1], one[2] = a, b, c
    while left:
        left -= 1
        node = waiting[left]
        apart = False
        for k in range(3):
            apart |= solid.boxes_m[node, 0, k] > high[k] or solid.boxes_m[node, 1, k] < low[k]
        if apart:
            continue
        if solid.spans[node, 2]:
            waiting[left], waiting[left + 1] = solid.spans[node, 2], node + 1
            left += 2
            continue
        for f in range(solid.spans[node, 0], solid.spans[node, 1]):
            if not _are_apart(one, solid.corners_m[f]):
                return True
    return False


@kernel
def surfaces_cross(solid: Solid, other: Solid, offset: NDArray[np.float64]) -> bool:
    """Return whether the surfaces of two solids, the other moved by (3,) metres, cross; touching is not crossing."""
    waiting = np.empty((256, 2), np.int64)
    waiting[0, 0], waiting[0, 1], left = 0, 0, 1
    moved = np.empty((3, 3))
    while left:
        left -= 1
        node, there = waiting[left]
        apart = False
        for k in range(3):
            apart |= solid.boxes_m[node, 0, k] > other.boxes_m[there, 1, k] + offset[k]
            apart |= solid.boxes_m[node, 1, k] < other.boxes_m[there, 0, k] + offset[k]
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
            for n in range(3):
                for k in range(3):
                    moved[n, k] = other.corners_m[g, n, k] + offset[k]
            for f in range(solid.spans[node, 0], solid.spans[node, 1]):
                if not _are_apart(moved, solid.corners_m[f]):
                    return True
    return False


@kernel
def _are_apart(one: NDArray[np.float64], other: NDArray[np.float64]) -> bool:
    """Whether a plane separates two triangles: along one of them, or along an edge of each (11 directions)."""
    for k in range(3):
        if min(one[0, k], one[1, k], one[2, k]) >= max(other[0, k], other[1, k], other[2, k]) - _ROUNDING_M:
            return True
        if max(one[0, k], one[1, k], one[2, k]) <= min(other[0, k], other[1, k], other[2, k]) + _ROUNDING_M:
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
        slack = _ROUNDING_M * length
        if low >= other_high - slack or high <= other_low + slack:
            return True
    return False


@kernel
def _edge(triangle: NDArray[np.float64], k: int) -> tuple[float, float, float]:
    n = (k + 1) % 3
    return (triangle[n, 0] - triangle[k, 0], triangle[n, 1] - triangle[k, 1], triangle[n, 2] - triangle[k, 2])


@kernel
def _holds(solid: Solid, f: int, skin: float, point: NDArray[np.float64]) -> bool:
    """Whether the skin of a triangle holds a point: near its plane, and near its outline in that plane."""
    normal, triangle = solid.normals[f], solid.corners_m[f]
    off = 0.0
    for k in range(3):
        off += normal[k] * (point[k] - triangle[0, k])
    if abs(off) > skin:
        return False
    x, y, z = point[0] - off * normal[0], point[1] - off * normal[1], point[2] - off * normal[2]
    return bool(from_triangle(triangle, x, y, z) <= skin * skin)


@kernel
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
