"""Erosion of a mesh by the contact tolerance: the surface is moved inward.

Two parts overlap by at most ``depth_m`` if one of them, its surface moved inward by that much, does not meet the other.
The thicker part of the pair is eroded, up to a share of its thickness (a thin plate would turn inside out); the other
part takes the rest, up to the same share. Every vertex moves so that each face around it shifts by ``depth_m`` along
its normal (a mitred offset): for a vertex with unit normals n_f, the least-squares solution of ``n_f . d = -depth_m``,
exact if at most three planes meet.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh

_SHARE_OF_THICKNESS = 0.45
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
        mesh: Closed for an exact result; its orientation does not matter. If the mesh is thinner than twice the depth,
            faces pass each other; the result still lies within ``depth_m`` of the true surface.
        depth_m: Depth, metres.

    Returns:
        (F, 3, 3) float64 triangles.
    """
    vertices, inverse = np.unique(mesh.vertices_m.round(7), axis=0, return_inverse=True)
    faces = inverse.reshape(-1)[mesh.faces]
    triangles = vertices[faces]
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    proper = lengths > 1e-12
    normals[proper] /= lengths[proper, None]
    normals[~proper] = 0.0
    outward = 1.0 if mesh.signed_volume_m3 >= 0.0 else -1.0
    squares = np.zeros((len(vertices), 3, 3))
    sums = np.zeros((len(vertices), 3))
    outer = normals[:, :, None] * normals[:, None, :]
    for corner in range(3):
        np.add.at(squares, faces[:, corner], outer)
        np.add.at(sums, faces[:, corner], normals)
    shift = -outward * depth_m * np.einsum("vij,vj->vi", np.linalg.pinv(squares, rcond=1e-3, hermitian=True), sums)
    length = np.linalg.norm(shift, axis=1)
    longest = _LONGEST_MITRE * depth_m
    too_long = length > longest
    shift[too_long] *= (longest / length[too_long])[:, None]
    moved: NDArray[np.float64] = (vertices + shift)[faces[proper]]
    return moved
