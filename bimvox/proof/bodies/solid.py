"""A part's triangles prepared for the proof: a tree over them, the thickness under each, and queries on the solid.

The *skin* of a part is the layer under its surface that another part may overlap; the rest of its inside is its *core*.
The skin of a triangle extends perpendicularly to both sides, and equally far beyond its outline. Its depth is the
contact tolerance if the part is thick there. If the part is thin, it is 45 % of the thickness, so that every member of
a profile or a frame has a core. The thickness is measured by rays from points on the triangle to the first triangle
opposite.

A point is inside a part by the majority of three slanted rays: by the sum of signed crossings if every edge of the
mesh is matched, otherwise by their parity. Open meshes have no inside if the rays disagree. A flat sheet, such as the
pane of a railing, has none: it is taken with both its sides, so that no ray through it changes sides.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.compiled import kernel, leaf_kernel
from bimvox.kept import kept
from bimvox.proof.bodies.triangle_tree import crossed, nearest_both_ways, tree_over

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
    return bool(_from_triangle(triangle, x, y, z) <= skin * skin)


@leaf_kernel
def _from_triangle(triangle: NDArray[np.float64], x: float, y: float, z: float) -> float:
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


FINEST_M = 5e-4
"""Least depth of a skin; pieces of a surface with shorter edges are not divided further."""
_SHARE_OF_THICKNESS = 0.45
_APART_M = 0.25
_MOST_PARTS = 4
_NO_AREA_M2 = 1e-12
_SHEETS_APART_M = 0.01
"""Faces that are drawn closer to each other may be meant as one shell."""


class Solid(NamedTuple):
    """A part's triangles, in the order of the tree's leaves.

    Attributes:
        corners_m: (F, 3, 3) float64 triangles with an area.
        normals: (F, 3) float64 unit normals.
        skins_m: (F,) float64 depth of the skin of each triangle.
        deepest_m: The largest skin depth.
        boxes_m: (N, 2, 3) float64 lowest and highest corner of each node of the tree.
        spans: (N, 3) int64 first triangle, one after the last, and right child (the left one follows its parent); the
            right child of a leaf is 0.
        core_m: (2, 3) float64 a box around the core.
        is_matched: Whether every edge is used equally often in both directions.
        thickness_m: Mean thickness.
        seed_m: (K, 3) float64 a point of the core; empty if no core was found.
        ends_m: (E, 3) float64 points on the surface: of every connected piece, those furthest along each axis.
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
    """Return a mesh prepared for the proof.

    Args:
        mesh: The part's triangles.
        tolerance_m: Depth of the skin if the part is thick.
    """
    mean_m, mesh = _mean_thickness_m(mesh), _with_both_sides(mesh)
    tree, (low, high) = _tree_of(mesh), mesh.bounds_m
    if not len(tree.corners_m):
        none = np.zeros((0, 3))
        return Solid(*tree[:2], tree.areas_m2, 0.0, *tree[3:5], np.zeros((2, 3)), False, 0.0, none, none)
    skins = np.maximum(np.minimum(tolerance_m, _SHARE_OF_THICKNESS * tree.thick_m), FINEST_M) + _ROUNDING_M
    least = float(skins.min()) - _ROUNDING_M
    solid = Solid(
        tree.corners_m,
        tree.normals,
        skins,
        float(skins.max()),
        tree.boxes_m,
        tree.spans,
        np.stack([low + least, high - least]),
        are_edges_matched(corner_numbers(mesh)),
        mean_m,
        np.zeros((0, 3)),
        _ends(tree.corners_m, tree.faces),
    )
    return solid._replace(seed_m=_seed(solid, tree.thick_m, tree.outward))


@kept
def _with_both_sides(mesh: TriangleMesh) -> TriangleMesh:
    """Return a mesh with the other side of every flat sheet that it holds.

    A sheet is an open piece in one plane, apart from all other open pieces: with these, it could bound a body.
    """
    faces, triangles = corner_numbers(mesh), mesh.triangles_m
    if not len(faces) or are_edges_matched(faces):
        return mesh
    pieces = pieces_of(faces)
    is_open = [own for own in (pieces == piece for piece in np.unique(pieces)) if not are_edges_matched(faces[own])]
    boxes_m = np.array([(triangles[own].min(axis=(0, 1)), triangles[own].max(axis=(0, 1))) for own in is_open])
    again = []
    for own, (low, high) in zip(is_open, boxes_m, strict=True):
        near = (boxes_m[:, 0] <= high + _SHEETS_APART_M) & (boxes_m[:, 1] >= low - _SHEETS_APART_M)
        points_m = triangles[own].reshape(-1, 3) - triangles[own].mean(axis=(0, 1))
        across = np.linalg.svd(points_m, full_matrices=False)[2][-1]
        if near.all(axis=1).sum() == 1 and np.ptp(points_m @ across) <= _ROUNDING_M:
            again.append(mesh.faces[own][:, ::-1])
    return TriangleMesh(mesh.vertices_m, np.concatenate([mesh.faces, *again])) if again else mesh


def _mean_thickness_m(mesh: TriangleMesh) -> float:
    tree = _tree_of(mesh)
    return float(np.average(tree.thick_m, weights=tree.areas_m2)) if len(tree.areas_m2) else 0.0


class _Tree(NamedTuple):
    """What does not depend on the tolerance: triangles with an area, in the order of the tree's leaves.

    Attributes:
        corners_m: As in ``Solid``, like the next three.
        normals: Unit normals.
        areas_m2: (F,) float64.
        boxes_m: Of the nodes.
        spans: Of the nodes.
        thick_m: (F,) float64 thickness of the part under each triangle.
        faces: (F, 3) int64 numbers of the corners.
        outward: 1.0 if the mesh faces outward, -1.0 if inward.
    """

    corners_m: NDArray[np.float64]
    normals: NDArray[np.float64]
    areas_m2: NDArray[np.float64]
    boxes_m: NDArray[np.float64]
    spans: NDArray[np.int64]
    thick_m: NDArray[np.float64]
    faces: NDArray[np.int64]
    outward: float


@kept
def _tree_of(mesh: TriangleMesh) -> _Tree:
    triangles = mesh.triangles_m
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    areas = np.linalg.norm(normals, axis=1) / 2.0
    proper = areas > _NO_AREA_M2
    triangles, areas = np.ascontiguousarray(triangles[proper]), areas[proper]
    normals = normals[proper] / (2.0 * areas[:, None])
    order, boxes, spans = tree_over(triangles.min(axis=1), triangles.max(axis=1))
    triangles, normals, areas = triangles[order], normals[order], areas[order]
    if not len(triangles):
        return _Tree(triangles, normals, areas, boxes, spans, areas, np.zeros((0, 3), np.int64), 1.0)
    (low, high), outward = mesh.bounds_m, _outward(mesh)
    thick = np.minimum(_thicknesses(triangles, normals, boxes, spans, outward), float((high - low).min()))
    return _Tree(triangles, normals, areas, boxes, spans, thick, corner_numbers(mesh)[proper][order], outward)


def _outward(mesh: TriangleMesh) -> float:
    """Return 1.0 if the mesh faces outward, -1.0 if inward."""
    return 1.0 if mesh.signed_volume_m3 >= 0.0 else -1.0


@kept
def corner_numbers(mesh: TriangleMesh) -> NDArray[np.int64]:
    """Return (F, 3) the numbers of each triangle's corners; corners closer than 0.1 um have the same number."""
    return point_numbers(mesh.vertices_m.round(7))[mesh.faces]


def point_numbers(points: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return (N,) numbers of (N, 3) points, in the order of their coordinates; equal points have the same number."""
    order, numbers = np.lexsort(points.T[::-1]), np.zeros(len(points), np.int64)
    numbers[order[1:]] = np.cumsum((points[order[1:]] != points[order[:-1]]).any(axis=1))
    return numbers


def are_edges_matched(faces: NDArray[np.int64]) -> bool:
    """Return whether every edge is used equally often in both directions."""
    first, second = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    key = np.minimum(first, second) * (int(faces.max()) + 1) + np.maximum(first, second)
    _, edge = np.unique(key, return_inverse=True)
    return not np.bincount(edge.reshape(-1), weights=np.sign(second - first)).any()


def _ends(triangles: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return (E, 3) middles of the triangles furthest along each axis, both ways, of every connected piece."""
    pieces = pieces_of(faces)
    middles = triangles.mean(axis=1)
    found = []
    for axis in range(3):
        order = np.lexsort((middles[:, axis], pieces))
        begins = np.flatnonzero(np.diff(pieces[order], prepend=-1))
        found += [order[begins], order[np.append(begins[1:], len(order)) - 1]]
    ends: NDArray[np.float64] = middles[np.unique(np.concatenate(found))]
    return ends


@kernel
def pieces_of(faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return (F,) the number of the connected piece of each triangle: its lowest corner."""
    most = 0
    for f in range(faces.shape[0]):
        most = max(most, faces[f, 0], faces[f, 1], faces[f, 2])
    root = np.empty(most + 1, np.int64)
    for n in range(most + 1):
        root[n] = n
    for f in range(faces.shape[0]):
        for k in range(2):
            one, other = faces[f, k], faces[f, k + 1]
            while root[one] != one:
                root[one] = root[root[one]]
                one = root[one]
            while root[other] != other:
                root[other] = root[root[other]]
                other = root[other]
            root[max(one, other)] = min(one, other)
    for n in range(root.shape[0]):
        root[n] = root[root[n]]
    pieces = np.empty(faces.shape[0], np.int64)
    for f in range(faces.shape[0]):
        pieces[f] = root[faces[f, 0]]
    return pieces


@kernel
def _thicknesses(
    corners: NDArray[np.float64],
    normals: NDArray[np.float64],
    boxes: NDArray[np.float64],
    spans: NDArray[np.int64],
    outward: float,
) -> NDArray[np.float64]:
    """Return (F,) the least thickness of the part at points spread over each triangle; infinite if no ray hits."""
    thick, body = np.empty(corners.shape[0]), (corners, normals, boxes, spans)
    slowness, waiting, points = np.empty(3), np.empty(64, np.int64), np.empty((_MOST_PARTS * (_MOST_PARTS + 1) // 2, 3))
    crossings, nearest = np.empty((points.shape[0], 2), np.int64), np.empty((points.shape[0], 2))
    for f in range(corners.shape[0]):
        for k in range(3):
            slowness[k] = 1.0 / normals[f, k] if normals[f, k] != 0.0 else 0.0
        thick[f], longest = np.inf, 0.0
        for side in range(3):
            squared = 0.0
            for k in range(3):
                squared += (corners[f, (side + 1) % 3, k] - corners[f, side, k]) ** 2
            longest = max(longest, np.sqrt(squared))
        parts, count = int(min(max(np.ceil(longest / _APART_M), 2), _MOST_PARTS)), 0
        for i in range(parts):
            for j in range(parts - i):
                u, v = (i + 1.0 / 3.0) / parts, (j + 1.0 / 3.0) / parts
                for k in range(3):
                    a, b, c = corners[f, 0, k], corners[f, 1, k], corners[f, 2, k]
                    points[count, k] = a + u * (b - a) + v * (c - a)
                count += 1
        nearest_both_ways(body, f, points[:count], slowness, waiting, crossings, nearest)
        for n in range(count):
            # A ray into the part leaves it again: an odd number of crossings. Abutting shells are odd both ways.
            inward = np.inf
            if crossings[n, 0] % 2 == 1:
                inward = nearest[n, 0]
            if crossings[n, 1] % 2 == 1:
                inward = min(inward, nearest[n, 1])
            if crossings[n, 0] % 2 == 0 and crossings[n, 1] % 2 == 0:
                inward = nearest[n, 1] if outward > 0.0 else nearest[n, 0]
            thick[f] = min(thick[f], inward)
    return thick


def _seed(solid: Solid, thick: NDArray[np.float64], outward: float) -> NDArray[np.float64]:
    """Return (K, 3) a point halfway through the part, under the first triangle for which it is in the core."""
    middles = solid.corners_m.mean(axis=1) - outward * solid.normals * thick[:, None] / 2.0
    for n in range(min(len(middles), 64)):
        if is_inside(solid, middles[n]) and not in_skin(solid, middles[n : n + 1]):
            return np.asarray(middles[n : n + 1], np.float64)
    return np.zeros((0, 3))
