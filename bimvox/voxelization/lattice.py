"""Metres to lattice coordinates.

The lattice is anchored in the world: cell (i, j, k) covers ``origin_m + h * [i, i + 1)`` and so on, whatever the
bounds of the part. Coordinates are in cells, rounded to 2^-24 of a cell (6 nm at 0.1 m), so that moving a part by whole
cells changes no bit of the kernels' input.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.errors import InputError

TOLERANCE_M = 1e-4
"""A part meets a cell if it reaches into it by more than this, so that faces on a border do not spill over."""

_TOLERANCE_LIMIT_VOX = 0.01
STEPS_PER_CELL = float(2**24)
"""Steps per cell that lattice coordinates are rounded to."""

_LARGEST_VOX = float(2**28)


def tolerance_vox(voxel_size_m: float) -> float:
    """Return ``TOLERANCE_M`` in cells, at most a hundredth of a cell."""
    return min(TOLERANCE_M / voxel_size_m, _TOLERANCE_LIMIT_VOX)


@leaf_kernel
def rounded(point_m: float, origin_m: float, voxel_size_m: float) -> float:
    """Return a coordinate in cells, rounded; NaN if it is not finite or too far away."""
    vox = (point_m - origin_m) / voxel_size_m
    return float(np.rint(vox * STEPS_PER_CELL)) / STEPS_PER_CELL if abs(vox) < _LARGEST_VOX else np.nan


@kernel
def _all_rounded(
    points_m: NDArray[np.float64], origin_m: NDArray[np.float64], voxel_size_m: float
) -> NDArray[np.float64]:
    points = np.empty(points_m.shape, np.float64)
    for n in range(points_m.shape[0]):
        for axis in range(3):
            points[n, axis] = rounded(points_m[n, axis], origin_m[axis], voxel_size_m)
    return points


def require_size(voxel_size_m: float) -> None:
    """Raise InputError unless the cell size is a positive number."""
    if not (np.isfinite(voxel_size_m) and voxel_size_m > 0.0):
        raise InputError(f"the voxel size must be a positive number of metres, not {voxel_size_m}", hint="try 0.1")


def _refuse(voxel_size_m: float) -> InputError:
    return InputError(
        f"a vertex is not finite, or is more than {_LARGEST_VOX:,.0f} cells of {voxel_size_m:g} m from the origin",
        hint="move the model near its origin, or choose a larger cell",
    )


def to_lattice(points_m: ArrayLike, voxel_size_m: float, origin_m: ArrayLike) -> NDArray[np.float64]:
    """Return points in lattice coordinates (cells): (..., 3) metres -> (..., 3) float64, rounded to 2^-24 of a cell.

    Raises:
        InputError: If the cell size is not a positive number, or a coordinate is not finite or more than 2^28 cells
            from the origin.
    """
    require_size(voxel_size_m)
    points = np.ascontiguousarray(points_m, np.float64)
    found = _all_rounded(points.reshape(-1, 3), np.array(origin_m, np.float64), float(voxel_size_m))
    if np.isnan(found).any():
        raise _refuse(voxel_size_m)
    return found.reshape(points.shape)


@kernel
def lattice_bounds_of(
    vertices_m: NDArray[np.float64],
    faces: NDArray[np.int32],
    vertex_starts: NDArray[np.int64],
    face_starts: NDArray[np.int64],
    voxel_size_m: float,
    origin_m: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the (P, 2, 3) boxes around the triangles of several meshes in cells; NaN for an unusable mesh.

    The arguments are those of ``meshes.Meshes``.
    """
    bounds = np.empty((face_starts.size - 1, 2, 3), np.float64)
    for mesh in range(bounds.shape[0]):
        points = _all_rounded(vertices_m[vertex_starts[mesh] : vertex_starts[mesh + 1]], origin_m, voxel_size_m)
        for axis in range(3):
            bounds[mesh, 0, axis], bounds[mesh, 1, axis] = np.inf, -np.inf
        usable = face_starts[mesh] < face_starts[mesh + 1]
        for f in range(face_starts[mesh], face_starts[mesh + 1]):
            for corner in range(3):
                vertex = faces[f, corner]
                for axis in range(3):
                    at = points[vertex, axis]
                    bounds[mesh, 0, axis] = min(bounds[mesh, 0, axis], at)
                    bounds[mesh, 1, axis] = max(bounds[mesh, 1, axis], at)
                    usable = usable and at == at
        for axis in range(3):
            if not usable:
                bounds[mesh, 0, axis] = bounds[mesh, 1, axis] = np.nan
    return bounds


@kernel
def part_triangles(
    vertices_m: NDArray[np.float64],
    faces: NDArray[np.int32],
    voxel_size_m: float,
    origin_m: NDArray[np.float64],
    low: NDArray[np.int64],
) -> NDArray[np.float64]:
    """Return triangles in lattice coordinates, (F, 3, 3), relative to the cell ``low``."""
    points = _all_rounded(vertices_m, origin_m, voxel_size_m)
    for n in range(points.shape[0]):
        for axis in range(3):
            points[n, axis] -= low[axis]
    triangles = np.empty((faces.shape[0], 3, 3), np.float64)
    for f in range(faces.shape[0]):
        for corner in range(3):
            vertex = faces[f, corner]
            for axis in range(3):
                triangles[f, corner, axis] = points[vertex, axis]
    return triangles


@kernel
def cell_of_middle(
    bounds: NDArray[np.float64], low: NDArray[np.int64], high: NDArray[np.int64]
) -> tuple[int, int, int]:
    """Return the cell in the middle of a (2, 3) box, relative to the cell ``low`` and below ``high``."""
    cell = np.empty(3, np.int64)
    for axis in range(3):
        middle = int(np.floor((bounds[0, axis] + bounds[1, axis]) / 2.0)) - low[axis]
        cell[axis] = min(max(middle, 0), high[axis] - low[axis] - 1)
    return cell[0], cell[1], cell[2]


@kernel
def _triangles(
    vertices_m: NDArray[np.float64], faces: NDArray[np.int32], voxel_size_m: float, origin_m: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    triangles = np.empty((faces.shape[0], 3, 3), np.float64)
    bounds = np.empty((2, 3), np.float64)
    for axis in range(3):
        bounds[0, axis], bounds[1, axis] = np.inf, -np.inf
    points = _all_rounded(vertices_m, origin_m, voxel_size_m)
    for f in range(faces.shape[0]):
        for corner in range(3):
            vertex = faces[f, corner]
            for axis in range(3):
                at = points[vertex, axis]
                triangles[f, corner, axis] = at
                bounds[0, axis] = min(bounds[0, axis], at)
                bounds[1, axis] = max(bounds[1, axis], at)
                if at != at:
                    bounds[0, 0] = np.nan
                    return triangles, bounds
    return triangles, bounds


def lattice_triangles(
    vertices_m: NDArray[np.float64], faces: NDArray[np.int32], voxel_size_m: float, origin_m: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return triangles in lattice coordinates, (F, 3, 3), and the (2, 3) box around them; see ``to_lattice``.

    Raises:
        InputError: If there are no triangles, or as ``to_lattice`` does.
    """
    if len(faces) == 0:
        raise InputError("a mesh without triangles cannot be voxelized", hint="select elements with a body")
    require_size(voxel_size_m)
    triangles, bounds = _triangles(
        np.ascontiguousarray(vertices_m, np.float64),
        np.ascontiguousarray(faces, np.int32),
        float(voxel_size_m),
        np.array(origin_m, np.float64),
    )
    if bounds[0, 0] != bounds[0, 0]:
        raise _refuse(voxel_size_m)
    return triangles, bounds


def cell_range(
    low_vox: ArrayLike, high_vox: ArrayLike, voxel_size_m: float
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the half-open range of cells that something with these bounds meets.

    Faces on a border do not spill over. Something thinner than the tolerance on a border belongs to the cell above.

    Args:
        low_vox: (..., 3) lowest corner in lattice coordinates.
        high_vox: (..., 3) highest corner in lattice coordinates.
        voxel_size_m: Edge of a cell.
    """
    tolerance = tolerance_vox(voxel_size_m)
    low = np.floor(np.asarray(low_vox) + tolerance).astype(np.int64)
    high = np.ceil(np.asarray(high_vox) - tolerance).astype(np.int64)
    return low, np.maximum(high, low + 1)
