"""Repair triangles (finite, not degenerate, outward) and measure the volume of the solid inside."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.bim.connected import connected_labels

OPEN_FILL = 0.5
"""Share of its bounding box that an open shell is assumed to fill, because its volume is undefined."""
SMALL_GAP = 0.05
"""Largest sum of area vectors, as a share of the area, of a shell with only small holes."""
WELD = 1e-7
"""Vertices closer than this share of the extent are merged: the resolution of single precision."""
WELD_MOST_M = 1e-3
"""Vertices farther apart than this are never merged: a stray piece far away must not coarsen the others."""
BALANCE = 1e-6
"""Largest sum of area vectors, as a share of the area, of a surface that counts as bounding a solid."""
SHEET_M = 0.01
"""Assumed thickness of an open flat sheet, metres."""


@dataclass(frozen=True, slots=True, eq=False)
class Shells:
    """The connected pieces of a mesh.

    Attributes:
        of_face: (F,) int64 shell of each face, numbered by first face.
        closed: (S,) bool, whether every directed edge has its opposite.
        bounded: (S,) bool, closed, or its area vectors cancel out: a solid whose faces meet without sharing vertices.
        volume_m3: (S,) float64 signed volume; valid for bounded shells only.
        about_middle_m3: (S,) float64 signed volume about the centre of the shell's box: a good estimate for a shell
            with small holes.
        gap: (S,) float64, the sum of the area vectors as a share of the area: 0 for a closed shell, 1 for a flat sheet.
        low_m: (S, 3) float64 lowest corner.
        high_m: (S, 3) float64 highest corner.
    """

    of_face: NDArray[np.int64]
    closed: NDArray[np.bool_]
    bounded: NDArray[np.bool_]
    volume_m3: NDArray[np.float64]
    about_middle_m3: NDArray[np.float64]
    gap: NDArray[np.float64]
    low_m: NDArray[np.float64]
    high_m: NDArray[np.float64]


def weld(mesh: TriangleMesh) -> TriangleMesh:
    """Return the mesh with vertices merged that are equal in single precision, without unused ones.

    STL and many exports repeat vertices for each face, rounded to single precision. Merged vertices get the exact
    position of the first.
    """
    is_used = np.zeros(len(mesh.vertices_m), dtype=bool)
    is_used[mesh.faces] = True
    used = np.flatnonzero(is_used)
    vertices = mesh.vertices_m[used] + 0.0
    step_m = min(max(WELD * float(np.ptp(vertices, axis=0).max()), 1e-12), WELD_MOST_M)
    steps = np.round((vertices - vertices.min(axis=0)) / step_m).astype(np.int64)
    # Two numbers below 2**31 fit one integer: first x and y, then their rank and z.
    x, y, z = (axis if axis.max() < 1 << 31 else np.unique(axis, return_inverse=True)[1] for axis in steps.T)
    _, column = np.unique((x << 31) | y, return_inverse=True)
    _, first, index = np.unique((column << 31) | z, return_index=True, return_inverse=True)
    of_vertex = np.zeros(len(mesh.vertices_m), dtype=np.int32)
    of_vertex[used] = index
    return TriangleMesh(vertices[first], of_vertex[mesh.faces])


def wind_consistently(mesh: TriangleMesh) -> tuple[TriangleMesh, int]:
    """Return the mesh with faces turned so that neighbours agree which side is out, and how many were turned.

    Each piece follows its first face; only edges with exactly two faces make neighbours. A piece with only one side
    (a Moebius strip) is not changed.
    """
    count, faces = len(mesh.faces), mesh.faces.astype(np.int64)
    a, b = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).T
    edge = np.minimum(a, b) * len(mesh.vertices_m) + np.maximum(a, b)
    order = np.argsort(edge, kind="stable")
    _, start, uses = np.unique(edge[order], return_index=True, return_counts=True)
    one, other = order[start[uses == 2]], order[start[uses == 2] + 1]
    clash = a[one] == a[other]
    if not clash.any():
        return mesh, 0
    # Two nodes per face, unchanged and turned; neighbours that clash are joined crosswise.
    one, other = one % count, other % count
    near, far = np.where(clash, other + count, other), np.where(clash, other, other + count)
    label = connected_labels(2 * count, np.concatenate([one, one + count]), np.concatenate([near, far]))
    as_is, turned = label[:count], label[count:]
    turn = turned < as_is
    wound = np.where(turn[:, None], mesh.faces[:, ::-1], mesh.faces)
    return TriangleMesh(mesh.vertices_m, np.ascontiguousarray(wound)), int(turn.sum())


def shells_of(mesh: TriangleMesh) -> Shells:
    """Return the pieces of a mesh that are connected by shared vertices; it needs at least one face."""
    faces = mesh.faces.astype(np.int64)
    count = len(mesh.vertices_m)
    a, b = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).T
    labels = connected_labels(count, a, b)[faces[:, 0]]
    _, first, inverse = np.unique(labels, return_index=True, return_inverse=True)
    rank = np.empty(len(first), dtype=np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    of_face = rank[inverse.reshape(-1)]
    number = len(first)

    # An edge walked once each way is closed; any other is a border (or an edge with a third face).
    edges, where = np.unique(np.minimum(a, b) * count + np.maximum(a, b), return_inverse=True)
    balance = np.bincount(where.reshape(-1), weights=np.sign(b - a), minlength=len(edges))
    shell_of_edge = np.empty(len(edges), dtype=np.int64)
    shell_of_edge[where.reshape(-1)] = np.tile(of_face, 3)
    closed = np.bincount(shell_of_edge[balance != 0], minlength=number) == 0

    corners = mesh.triangles_m - mesh.vertices_m[faces[0, 0]]
    crosses = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    leak = np.stack([np.bincount(of_face, weights=crosses[:, axis], minlength=number) for axis in range(3)], axis=1)
    area = np.bincount(of_face, weights=np.linalg.norm(crosses, axis=1), minlength=number)
    gap = np.linalg.norm(leak, axis=1) / area
    bounded = closed | (gap <= BALANCE)
    six_volumes = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
    low, high = np.full((number, 3), np.inf), np.full((number, 3), -np.inf)
    np.minimum.at(low, of_face, mesh.triangles_m.min(axis=1))
    np.maximum.at(high, of_face, mesh.triangles_m.max(axis=1))
    volume = np.bincount(of_face, weights=six_volumes, minlength=number) / 6.0
    middle = (low + high) / 2 - mesh.vertices_m[faces[0, 0]]
    about_middle = volume - np.einsum("ij,ij->i", middle, leak) / 6.0
    return Shells(of_face, closed, bounded, volume, about_middle, gap, low, high)


def drop_bad_faces(mesh: TriangleMesh) -> tuple[TriangleMesh, int]:
    """Return the mesh without faces that have a missing or infinite corner, or no area; and how many were dropped."""
    in_range = ((mesh.faces >= 0) & (mesh.faces < len(mesh.vertices_m))).all(axis=1)
    faces = mesh.faces[in_range]
    corners = mesh.vertices_m[faces]
    finite = np.isfinite(corners).all(axis=(1, 2))
    faces, corners = faces[finite], corners[finite]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    kept = faces[np.linalg.norm(cross, axis=1) > 0.0]
    return TriangleMesh(mesh.vertices_m, kept), len(mesh.faces) - len(kept)


def turn_outward(mesh: TriangleMesh) -> tuple[TriangleMesh, Shells, bool]:
    """Return the mesh with faces that look outward, its shells, and whether anything was turned.

    A shell inside the box of another one is a cavity, which looks inward. If the whole mesh is inside out, all shells
    are flipped, including cavities.
    """
    mesh, turned = wind_consistently(mesh)
    shells = shells_of(mesh)
    volume = shells.volume_m3
    flip = np.zeros(len(volume), dtype=bool)
    if shells.bounded.all() and volume.sum() < 0:
        flip[:] = True
        volume = -volume
    for shell in np.flatnonzero(shells.bounded & (volume < 0)):
        inside = (shells.low_m <= shells.low_m[shell]).all(axis=1) & (shells.high_m >= shells.high_m[shell]).all(axis=1)
        inside[shell] = False
        if not inside.any():
            flip[shell] = not flip[shell]
    if not flip.any():
        return mesh, shells, turned > 0
    faces = np.where(flip[shells.of_face][:, None], mesh.faces[:, ::-1], mesh.faces)
    outward = replace(shells, volume_m3=np.where(flip, -shells.volume_m3, shells.volume_m3))
    return TriangleMesh(mesh.vertices_m, np.ascontiguousarray(faces)), outward, True


def solid_volume_m3(mesh: TriangleMesh, shells: Shells) -> tuple[float, bool]:
    """Return the volume of solid in a mesh, and whether it is exact (every shell closed).

    If an unbounded shell has only small holes (a bent tube without lids), its volume about the centre of its box
    counts. Otherwise ``OPEN_FILL`` of its box counts, but at least a sheet ``SHEET_M`` thick.
    """
    total = abs(float(shells.volume_m3[shells.bounded].sum()))
    if shells.bounded.all() and total > 0.0:
        return total, bool(shells.closed.all())
    corners = mesh.triangles_m
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.bincount(shells.of_face, weights=np.linalg.norm(cross, axis=1) / 2.0, minlength=len(shells.closed))
    box = np.prod(shells.high_m - shells.low_m, axis=1)
    enclosed = np.minimum(np.abs(shells.about_middle_m3), box)
    # A surface modelled with both its sides has no gap either, but its volume is 0.
    nearly_closed = (shells.gap <= SMALL_GAP) & (enclosed > 1e-6 * area**1.5)
    guess = np.where(nearly_closed, enclosed, np.maximum(OPEN_FILL * box, SHEET_M * area))
    return total + float(guess[~shells.bounded].sum() if not shells.bounded.all() else guess.sum()), False
