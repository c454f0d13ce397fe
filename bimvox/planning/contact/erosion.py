"""The contact tolerance as a shape: a part with its surface moved inward.

Two parts touch no deeper than ``depth_m`` when one of them, its surface moved inward by that much, does not meet the
other. Of a pair the thicker one is moved, no further than it bears (a thin plate would be turned inside out), and the
other one makes up for the rest as far as it bears that. Every vertex moves so that each face around it shifts by
``depth_m`` along its normal (a mitred offset): for a vertex with unit normals n_f, the least-squares solution of
``n_f . d = -depth_m``, exact where up to three planes meet.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh

_SHARE_OF_THICKNESS = 0.45
_LONGEST_MITRE = 3.0  # sharp edges would throw their vertices far away; a spike that long is none of the real surface


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

    The same for either order of the two; of equally thick ones the lower number goes first.

    Args:
        first: One solid.
        second: The other.
        thicknesses_m: Of both solids by their numbers, see :func:`thickness_m`.
        tolerance_m: How deep the two may touch.
    """
    if (thicknesses_m[first], -first) < (thicknesses_m[second], -second):
        other_m, own_m = pair_depths_m(second, first, thicknesses_m, tolerance_m)
        return own_m, other_m
    depth_m = min(tolerance_m, _SHARE_OF_THICKNESS * thicknesses_m[first])
    return depth_m, min(tolerance_m - depth_m, _SHARE_OF_THICKNESS * thicknesses_m[second])


def eroded_triangles_m(mesh: TriangleMesh, depth_m: float) -> NDArray[np.float64]:
    """Return the mesh's triangles with the surface moved inward.

    Args:
        mesh: A closed mesh for an exact result; its orientation does not matter. Where parts are thinner than twice the
            depth, faces pass each other, and the result still lies within ``depth_m`` of the true surface.
        depth_m: How far, metres.

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
