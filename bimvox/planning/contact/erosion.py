"""Erosion of a mesh by the contact tolerance: the surface is moved inward.

Two parts overlap by at most ``depth_m`` if one of them, its surface moved inward by that much, does not meet the other.
The thicker part of the pair is eroded, up to a share of its thickness (a thin plate would turn inside out); the other
part takes the rest, up to the same share. Every vertex moves so that each face around it shifts by ``depth_m`` along
its normal (a mitred offset): for a vertex with unit normals n_f, the least-squares solution of ``n_f . d = -depth_m``,
exact if at most three planes meet.

No face moves by more than that share of the thickness under it (:mod:`bimvox.planning.contact.local_thickness`): turned
inside out, a sliver, a spike or a thin body would be larger than it is. A vertex moves by the least of what its faces
allow. An open shell with more than small holes has no inside, so it stays as it is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.bim.connected import connected_labels
from bimvox.planning.contact.local_thickness import thicknesses_m

_SHARE_OF_THICKNESS = 0.45
_SMALL_GAP = 0.05
"""Largest sum of area vectors, as a share of the area, of a shell that has an inside."""
_LONGEST_MITRE = 3.0  # times the depth; without a limit, sharp edges would move their vertices far away


def thickness_m(mesh: TriangleMesh) -> float:
    """Return the mean thickness of a solid, 2 V / A (exact for a large plate), at most its box's smallest edge."""
    a, b, c = np.moveaxis(mesh.triangles_m, 1, 0)
    area_m2 = float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()) / 2.0
    low, high = mesh.bounds_m
    smallest = float((high - low).min())
    return min(smallest, 2.0 * abs(mesh.signed_volume_m3) / area_m2) if area_m2 > 0.0 else smallest


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

    Args:
        vertices_m: (V, 3) all vertices.
        faces: (F, 3) numbers of their corners.
        areas: (F, 3) area vectors, times 2.
        of_mesh: How the whole mesh faces.
    """
    first, second = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    piece = connected_labels(len(vertices_m), first, second)[faces[:, 0]]
    _, edge = np.unique(np.minimum(first, second) * len(vertices_m) + np.maximum(first, second), return_inverse=True)
    is_open = np.bincount(edge.reshape(-1), weights=np.sign(second - first)) != 0
    found = np.full(len(faces), of_mesh)
    for number in np.unique(piece[is_open[edge].reshape(-1, 3).any(axis=1)]):
        own = piece == number
        triangles = vertices_m[faces[own]]
        middle = (triangles.min(axis=(0, 1)) + triangles.max(axis=(0, 1))) / 2.0
        gap = np.linalg.norm(areas[own].sum(axis=0)) / np.linalg.norm(areas[own], axis=1).sum()
        volume = np.einsum("ij,ij->", triangles[:, 0] - middle, areas[own])
        found[own] = np.sign(volume) if gap <= _SMALL_GAP else 0.0
    return found
