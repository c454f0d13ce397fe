"""A part's triangles prepared for the proof: a tree over them, the thickness under each, and points inside.

The *skin* of a part is the layer under its surface that another part may overlap; the rest of its inside is its *core*.
The skin of a triangle extends perpendicularly to both sides, and equally far beyond its outline. Its depth is the
contact tolerance if the part is thick there. If the part is thin, it is 45 % of the thickness, so that every member of
a profile or a frame has a core. The thickness is measured by rays from points on the triangle to the first triangle
opposite.

A point is inside a part by the majority of three slanted rays: by the sum of signed crossings if every edge of the
mesh is matched, otherwise by their parity. Sheets and open meshes have no inside if the rays disagree.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.compiled import kernel
from bimvox.kept import kept
from bimvox.proof.bodies.solid_queries import in_skin, is_inside
from bimvox.proof.bodies.triangle_tree import nearest_both_ways, tree_over

FINEST_M = 5e-4
"""Least depth of a skin; pieces of a surface with shorter edges are not divided further."""
_ROUNDING_M = 1e-6
_SHARE_OF_THICKNESS = 0.45
_APART_M = 0.25
_MOST_PARTS = 4
_NO_AREA_M2 = 1e-12


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
        is_matched(corner_numbers(mesh)),
        float(np.average(tree.thick_m, weights=tree.areas_m2)),
        np.zeros((0, 3)),
        _ends(tree.corners_m, tree.faces),
    )
    return solid._replace(seed_m=_seed(solid, tree.thick_m, tree.outward))


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


def is_matched(faces: NDArray[np.int64]) -> bool:
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
