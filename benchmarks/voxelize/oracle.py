"""The truth: which cells a closed part fills, by boolean volumes of manifold3d.

It shares only the size of the tolerance with the voxelizer. A part is cut to a window, and the piece is halved
repeatedly until a box of cells is empty, full, or one cell.
"""

from __future__ import annotations

from enum import IntEnum

import manifold3d
import numpy as np
from numpy.typing import NDArray

from benchmarks.voxelize.case import Scene, Window
from bimvox.bim.building import TriangleMesh
from bimvox.voxelization.lattice import tolerance_vox

MARGIN_M = 1e-6
"""If a part enters a cell by the tolerance, plus or minus this, rounding decides: both answers are right."""

# Volumes in cells: above the first a cell is full, below the second it is empty.
_FULL = 1.0 - 1e-9
_NOTHING = 1e-20


class Truth(IntEnum):
    """How much of a cell a part fills."""

    EMPTY = 0
    """It enters the cell by no more than the tolerance."""
    BOUNDARY = 1
    """It fills some of it."""
    INSIDE = 2
    """It fills all of it."""
    EITHER = 3
    """Too close to the tolerance to say, or the part is not closed."""


def solid_of(mesh: TriangleMesh, voxel_size_m: float, origin: NDArray[np.int64]) -> manifold3d.Manifold | None:
    """Return a mesh as a solid in cells from ``origin``, or None if it is not a closed solid facing outward."""
    corners, faces = np.unique(mesh.vertices_m, axis=0, return_inverse=True)
    faces = faces.reshape(-1)[mesh.faces]
    whole = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    vertices = np.ascontiguousarray(corners / voxel_size_m - origin)
    solid = manifold3d.Manifold(manifold3d.Mesh64(vertices, np.ascontiguousarray(faces[whole], np.uint64)))
    good = solid.status() == manifold3d.Error.NoError and not solid.is_empty() and solid.volume() > 0.0
    return solid if good else None


def window_truth(scene: Scene, window: Window) -> NDArray[np.uint8]:
    """Return how much of a window's cells each part fills: (P, A, B, C) uint8, values of ``Truth``."""
    truth = np.zeros((len(window.parts), *window.shape), np.uint8)
    for n, part in enumerate(window.parts.tolist()):
        solid = solid_of(scene.parts[part], scene.voxel_size_m, window.low)
        if solid is None:
            truth[n] = Truth.EITHER
        else:
            whole = _cut(solid, np.zeros(3), np.array(window.shape, np.float64))
            _fill(whole, (0, 0, 0), window.shape, truth[n], scene.voxel_size_m)
    return truth


def union_truth(truth: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return how much of the cells all parts together fill: (P, A, B, C) -> (A, B, C)."""
    out = np.full(truth.shape[1:], Truth.EMPTY, np.uint8)
    for state in (Truth.EITHER, Truth.BOUNDARY, Truth.INSIDE):
        out[(truth == state).any(axis=0)] = state
    return out


def _cut(solid: manifold3d.Manifold, low: NDArray[np.float64], high: NDArray[np.float64]) -> manifold3d.Manifold:
    return solid ^ manifold3d.Manifold.cube(tuple(high - low)).translate(tuple(low))


def _fill(
    piece: manifold3d.Manifold,
    low: tuple[int, int, int],
    high: tuple[int, int, int],
    truth: NDArray[np.uint8],
    voxel_size_m: float,
) -> None:
    """Decide the cells of the box [low, high); ``piece`` is the part cut to that box."""
    size = tuple(b - a for a, b in zip(low, high, strict=True))
    box = tuple(slice(a, b) for a, b in zip(low, high, strict=True))
    if piece.is_empty():
        return
    cells = size[0] * size[1] * size[2]
    if piece.volume() >= cells * _FULL:
        truth[box] = Truth.INSIDE
    elif cells == 1:
        truth[box] = _one_cell(piece, np.array(low, np.float64), voxel_size_m)
    else:
        axis = size.index(max(size))
        middle = low[axis] + size[axis] // 2
        normal = tuple(float(n == axis) for n in range(3))
        above, below = piece.split_by_plane(normal, float(middle))
        stop, start = list(high), list(low)
        stop[axis] = start[axis] = middle
        _fill(below, low, (stop[0], stop[1], stop[2]), truth, voxel_size_m)
        _fill(above, (start[0], start[1], start[2]), high, truth, voxel_size_m)


def _one_cell(piece: manifold3d.Manifold, low: NDArray[np.float64], voxel_size_m: float) -> Truth:
    tolerance, margin = tolerance_vox(voxel_size_m), MARGIN_M / voxel_size_m
    if _holds(_cut(piece, low + (tolerance + margin), low + (1.0 - tolerance - margin))):
        return Truth.BOUNDARY
    if _holds(_cut(piece, low + (tolerance - margin), low + (1.0 - tolerance + margin))):
        return Truth.EITHER
    return Truth.EMPTY


def _holds(piece: manifold3d.Manifold) -> bool:
    return not piece.is_empty() and piece.volume() > _NOTHING
