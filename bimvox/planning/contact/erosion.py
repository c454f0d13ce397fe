"""Erosion of a mesh by the contact tolerance: the surface is moved inward.

Two parts overlap by at most ``depth_m`` if one of them, its surface moved inward by that much, does not meet the other.
The thicker part of the pair is eroded, up to a share of its thickness (a thin plate would turn inside out); the other
part takes the rest, up to the same share. Every vertex moves so that each face around it shifts by ``depth_m`` along
its normal (a mitred offset): for a vertex with unit normals n_f, the least-squares solution of ``n_f . d = -depth_m``,
exact if at most three planes meet.

A part may consist of several bodies (a column with its bearing pads, an assembly with its anchors). Each is eroded by
no more than the same share of its own thickness: turned inside out, a thin body would be larger than it is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

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
        mesh: Closed for an exact result; its orientation does not matter. If a body of it is thinner in one place than
            twice the depth, faces pass each other; the result still lies within ``depth_m`` of the true surface.
        depth_m: Depth, metres; less for bodies that are thin.

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
    depths_m = _depths_m(vertices, faces, outward, depth_m)
    shift = -outward * np.einsum("vij,vj->vi", np.linalg.pinv(squares, rcond=1e-3, hermitian=True), sums)
    shift *= depths_m[:, None]
    length = np.linalg.norm(shift, axis=1)
    longest = _LONGEST_MITRE * depths_m
    too_long = length > longest
    shift[too_long] *= (longest[too_long] / length[too_long])[:, None]
    moved: NDArray[np.float64] = (vertices + shift)[faces[proper]]
    return moved


def _depths_m(
    vertices_m: NDArray[np.float64], faces: NDArray[np.int64], outward: float, depth_m: float
) -> NDArray[np.float64]:
    """Return (V,) how far each vertex's faces are moved: less if its body is thin.

    A piece of the surface turned the other way is a cavity, which grows; it has no thickness.
    """
    ends = np.concatenate([faces[:, :2], faces[:, 1:]]).T
    links = coo_array((np.ones(ends.shape[1], np.int8), tuple(ends)), shape=(len(vertices_m), len(vertices_m)))
    count, body = connected_components(links, directed=False)
    depths_m = np.full(count, depth_m)
    of_face = body[faces[:, 0]]
    for number in range(count) if count > 1 else ():
        own = faces[of_face == number]
        piece = TriangleMesh(*_alone(vertices_m, own))
        if len(own) and outward * piece.signed_volume_m3 >= 0.0:
            depths_m[number] = min(depth_m, _SHARE_OF_THICKNESS * thickness_m(piece))
    found: NDArray[np.float64] = depths_m[body]
    return found


def _alone(vertices_m: NDArray[np.float64], faces: NDArray[np.int64]) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Return the vertices that some faces use, and these faces with the vertices numbered anew."""
    used, numbers = np.unique(faces, return_inverse=True)
    return vertices_m[used], numbers.reshape(-1, 3).astype(np.int32)
