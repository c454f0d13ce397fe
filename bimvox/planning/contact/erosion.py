"""Erosion of a mesh by the contact tolerance: the surface is moved inward, as far as the part is thick there.

Two parts overlap by at most ``depth_m`` if one of them, its surface moved inward by that much, does not meet the other.
The thicker part of the pair is eroded, up to a share of its thickness (a thin plate would turn inside out); the other
part takes the rest, up to the same share. Every vertex moves so that each face around it shifts by ``depth_m`` along
its normal (a mitred offset): for a vertex with unit normals n_f, the least-squares solution of ``n_f . d = -depth_m``,
exact if at most three planes meet.

No face moves by more than that share of the thickness under it (:mod:`bimvox.planning.contact.erosion`): turned
inside out, a sliver, a spike or a thin body would be larger than it is. A vertex moves by the least of what its faces
allow. An open shell with more than small holes has no inside, so it stays as it is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.bim.mesh.repair import connected_labels
from bimvox.compiled import kernel
from bimvox.planning.contact.posed import order_along_curve, tree_boxes
from bimvox.planning.contact.sweep import overlap_area, projected_overlap

# How thick a part is under each of its triangles: the depth by which a face can be moved in without meeting another.
#
# The thickness under a triangle is the least distance, along its inward normal, of a triangle that faces the other way
# and lies behind it. It is exact: where the two overlap in projection, the distance is linear, so it is least at a
# corner of the overlap. Of two triangles that share a corner (the sides of a wedge or a spike), the greatest distance
# counts: the least one is 0 at their common edge, but a mitre moves that edge along.
#
# A triangle that others in its plane cover, which face it, is an inner boundary (layers of a wall, a sheet with two
# sides). It is not a surface of the part.

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
    ordered_m, result = triangles_m[order], np.empty(len(order))
    result[order] = _thicknesses(ordered_m, inward[order], corners[order], tree_boxes(ordered_m), reach_m)
    return result


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
            # Look along the normal of a triangle, and ask the tree of boxes for those that lie opposite.
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
                # The other triangle must face this one, and overlap it as seen along the normal.
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
                # The gap between both, at the corners of the overlap.
                least, most = np.inf, -np.inf
                for c in range(size):
                    along = x * (polygon[c, 0] - other[0, 0]) + y * (polygon[c, 1] - other[0, 1])
                    gap = other[0, 2] - along / z
                    least, most = min(least, gap), max(most, gap)
                # First pass: a triangle that others cover, in its own plane, is an inner boundary.
                if is_second == 0:
                    if abs(least) <= _SAME_M and abs(most) <= _SAME_M:
                        uncovered -= area
                    continue
                if is_inner[g] or most <= _SAME_M:
                    continue
                # Second pass: the thickness. Triangles with a common corner meet there, so only their largest gap
                # counts.
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


_SHARE_OF_THICKNESS = 0.45
_SMALL_GAP = 0.05
"""Largest sum of area vectors, as a share of the area, of a shell that has an inside."""
_LONGEST_MITRE = 3.0  # times the depth; without a limit, sharp edges would move their vertices far away


def pair_depths_m(
    first: int, second: int, thicknesses_m: Sequence[float] | Mapping[int, float], tolerance_m: float
) -> tuple[float, float]:
    """Return how far the surfaces of two numbered solids are moved inward to test their contact.

    Symmetric in the two solids; of equally thick ones, the lower number is eroded first. They may overlap by
    ``tolerance_m``.
    """
    if (thicknesses_m[first], -first) < (thicknesses_m[second], -second):
        other_m, own_m = pair_depths_m(second, first, thicknesses_m, tolerance_m)
        return own_m, other_m
    depth_m = min(tolerance_m, _SHARE_OF_THICKNESS * thicknesses_m[first])
    return depth_m, min(tolerance_m - depth_m, _SHARE_OF_THICKNESS * thicknesses_m[second])


def eroded_triangles_m(mesh: TriangleMesh, depth_m: float) -> NDArray[np.float64]:
    """Return the mesh's triangles with the surface moved inward.

    Args:
        mesh: Closed for an exact result; its orientation does not matter.
        depth_m: Depth, metres; less where the part is thin.

    Returns:
        (F, 3, 3) float64 triangles.
    """
    vertices, inverse = np.unique(mesh.vertices_m.round(7), axis=0, return_inverse=True)
    faces = inverse.reshape(-1)[mesh.faces]
    triangles = vertices[faces]
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    proper = lengths > 1e-12
    faces, lengths, normals = faces[proper], lengths[proper], normals[proper] / lengths[proper, None]
    outward = _outward(vertices, faces, normals * lengths[:, None], 1.0 if mesh.signed_volume_m3 >= 0.0 else -1.0)
    normals *= outward[:, None]
    squares = np.zeros((len(vertices), 3, 3))
    sums = np.zeros((len(vertices), 3))
    outer = normals[:, :, None] * normals[:, None, :]
    for corner in range(3):
        np.add.at(squares, faces[:, corner], outer)
        np.add.at(sums, faces[:, corner], normals)
    reach_m = depth_m / _SHARE_OF_THICKNESS
    thick_m = np.where(outward, thicknesses_m(vertices[faces], -normals, faces, reach_m), 0.0)
    depths_m = np.full(len(vertices), depth_m)
    np.minimum.at(depths_m, faces, _SHARE_OF_THICKNESS * thick_m[:, None])
    shift = -np.einsum("vij,vj->vi", np.linalg.pinv(squares, rcond=1e-3, hermitian=True), sums)
    shift *= depths_m[:, None]
    length = np.linalg.norm(shift, axis=1)
    longest = _LONGEST_MITRE * depths_m
    too_long = length > longest
    shift[too_long] *= (longest[too_long] / length[too_long])[:, None]
    moved: NDArray[np.float64] = (vertices + shift)[faces]
    return moved


def _outward(
    vertices_m: NDArray[np.float64], faces: NDArray[np.int64], areas: NDArray[np.float64], of_mesh: float
) -> NDArray[np.float64]:
    """Return (F,) whether each triangle faces outward (1), inward (-1), or bounds nothing (0).

    A connected piece that is closed faces as the whole mesh does: turned the other way, it is a cavity, which grows.
    One with small holes faces by itself.

    ``vertices_m``: (V, 3) all vertices; ``faces``: (F, 3) numbers of their corners; ``areas``: (F, 3) area vectors,
    times 2; ``of_mesh``: how the whole mesh faces.
    """
    first, second = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    piece = connected_labels(len(vertices_m), first, second)[faces[:, 0]]
    _, edge = np.unique(np.minimum(first, second) * len(vertices_m) + np.maximum(first, second), return_inverse=True)
    is_open = np.bincount(edge.reshape(-1), weights=np.sign(second - first)) != 0
    result = np.full(len(faces), of_mesh)
    for number in np.unique(piece[is_open[edge].reshape(-1, 3).any(axis=1)]):
        own = piece == number
        triangles = vertices_m[faces[own]]
        middle = (triangles.min(axis=(0, 1)) + triangles.max(axis=(0, 1))) / 2.0
        gap = np.linalg.norm(areas[own].sum(axis=0)) / np.linalg.norm(areas[own], axis=1).sum()
        volume = np.einsum("ij,ij->", triangles[:, 0] - middle, areas[own])
        result[own] = np.sign(volume) if gap <= _SMALL_GAP else 0.0
    return result
