"""Repair triangles (finite, not degenerate, outward) and measure the volume of the solid inside."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh


def connected_labels(count: int, a: NDArray[np.int64], b: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return, for each of ``count`` nodes, the lowest node that it is connected to.

    Args:
        count: Number of nodes.
        a: (E,) one end of each edge.
        b: (E,) the other end.
    """
    root = np.arange(count, dtype=np.int64)
    while True:
        low, high = np.minimum(root[a], root[b]), np.maximum(root[a], root[b])
        if (low == high).all():
            return root
        np.minimum.at(root, high, low)
        while not np.array_equal(root, up := root[root]):
            root = up


SMALL_GAP = 0.05
"""Largest sum of area vectors, as a share of the area, of a shell with only small holes."""
LIDLESS_GAP = 0.25
"""The same of a solid that lacks a face. A channel bent of a sheet has 0.33, an angle 0.71, a sheet 1."""
FLAT = 0.02
"""How far the border of a shell may be from a plane, as a share of its size: the face that is missing is flat."""
THICK_M = 0.3
"""Largest ratio of volume to area of an open shell that is a solid; a room or a dome is a sheet around air."""
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
        enclosed_m3: (S,) float64 signed volume if each hole is closed from its border to the middle of all borders.
        is_flat: (S,) bool, whether the border lies in one plane.
        area_m2: (S,) float64.
        gap: (S,) float64, the sum of the area vectors as a share of the area: 0 for a closed shell, 1 for a flat sheet.
        low_m: (S, 3) float64 lowest corner.
        high_m: (S, 3) float64 highest corner.
    """

    of_face: NDArray[np.int64]
    closed: NDArray[np.bool_]
    bounded: NDArray[np.bool_]
    volume_m3: NDArray[np.float64]
    enclosed_m3: NDArray[np.float64]
    is_flat: NDArray[np.bool_]
    area_m2: NDArray[np.float64]
    gap: NDArray[np.float64]
    low_m: NDArray[np.float64]
    high_m: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Solid:
    """What a mesh encloses.

    Attributes:
        volume_m3: Volume of solid.
        exact: Whether that is exact: every shell is closed.
        sheet_m2: Area of the sheets in it, whose thickness is assumed to be ``SHEET_M``.
    """

    volume_m3: float
    exact: bool
    sheet_m2: float


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
    leak: NDArray[np.float64] = np.stack(
        [np.bincount(of_face, weights=crosses[:, axis], minlength=number) for axis in range(3)], axis=1
    )
    area = np.bincount(of_face, weights=np.linalg.norm(crosses, axis=1), minlength=number)
    gap = np.linalg.norm(leak, axis=1) / area
    bounded = closed | (gap <= BALANCE)
    six_volumes = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
    low, high = np.full((number, 3), np.inf), np.full((number, 3), -np.inf)
    np.minimum.at(low, of_face, mesh.triangles_m.min(axis=1))
    np.maximum.at(high, of_face, mesh.triangles_m.max(axis=1))
    volume = np.bincount(of_face, weights=six_volumes, minlength=number) / 6.0
    border = balance != 0
    middle, is_flat = _borders(mesh.vertices_m, np.divmod(edges[border], count), shell_of_edge[border], leak)
    middle = np.where(closed[:, None], (low + high) / 2, middle)
    enclosed = volume - np.einsum("ij,ij->i", middle - mesh.vertices_m[faces[0, 0]], leak) / 6.0
    return Shells(of_face, closed, bounded, volume, enclosed, is_flat, area / 2.0, gap, low, high)


def _borders(
    vertices_m: NDArray[np.float64],
    ends: tuple[NDArray[np.int64], NDArray[np.int64]],
    shell: NDArray[np.int64],
    leak: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return the middle of each shell's border (S, 3), and whether the border lies in one plane (S,).

    ``ends`` are the vertices at both ends of the borders' edges (E,), ``shell`` the shell of each; ``leak`` (S, 3), the
    sum of a shell's area vectors, is normal to the plane of a flat border.
    """
    one, other = vertices_m[ends[0]], vertices_m[ends[1]]
    length = np.linalg.norm(other - one, axis=1)
    total = np.maximum(np.bincount(shell, weights=length, minlength=len(leak)), 1e-300)
    moments = [np.bincount(shell, weights=length * axis, minlength=len(leak)) for axis in ((one + other) / 2.0).T]
    middle = np.stack(moments, axis=1) / total[:, None]
    normal = leak / np.maximum(np.linalg.norm(leak, axis=1), 1e-300)[:, None]
    size, off = np.zeros(len(leak)), np.zeros(len(leak))
    for end in (one, other):
        from_middle = end - middle[shell]
        np.maximum.at(size, shell, np.linalg.norm(from_middle, axis=1))
        np.maximum.at(off, shell, np.abs(np.einsum("ij,ij->i", from_middle, normal[shell])))
    return middle, off <= FLAT * size


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


def solid_of(shells: Shells) -> Solid:
    """Return the volume of solid in a mesh.

    An open shell is closed where it is a solid that lacks a face or has small holes (a bent tube without lids).
    Otherwise it is a sheet, ``SHEET_M`` thick.
    """
    total = abs(float(shells.volume_m3[shells.bounded].sum()))
    if shells.bounded.all() and total > 0.0:
        return Solid(total, bool(shells.closed.all()), 0.0)
    area = shells.area_m2
    enclosed = np.minimum(np.abs(shells.enclosed_m3), np.prod(shells.high_m - shells.low_m, axis=1))
    # A surface modelled with both its sides has no gap either, but its volume is 0.
    has_volume = enclosed > 1e-6 * area**1.5
    is_lidless = ((shells.gap <= LIDLESS_GAP) | shells.is_flat) & (enclosed <= THICK_M * area)
    is_solid = has_volume & ((shells.gap <= SMALL_GAP) | is_lidless)
    is_doubled = ~has_volume & (shells.gap <= SMALL_GAP)
    sheet_m2 = np.where(is_solid, 0.0, np.where(is_doubled, area / 2.0, area))
    guess_m3 = np.where(is_solid, enclosed, SHEET_M * sheet_m2)
    counted = np.full(len(area), True) if shells.bounded.all() else ~shells.bounded
    return Solid(total + float(guess_m3[counted].sum()), False, float(sheet_m2[counted].sum()))
