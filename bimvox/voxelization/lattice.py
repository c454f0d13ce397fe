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
def all_rounded(
    points_m: NDArray[np.float64], origin_m: NDArray[np.float64], voxel_size_m: float
) -> NDArray[np.float64]:
    """Return (N, 3) points in cells, each coordinate as by `rounded`."""
    points = np.empty(points_m.shape, np.float64)
    for n in range(points_m.shape[0]):
        for axis in range(3):
            points[n, axis] = rounded(points_m[n, axis], origin_m[axis], voxel_size_m)
    return points


def require_size(voxel_size_m: float) -> None:
    """Raise InputError unless the cell size is a positive number."""
    if not (np.isfinite(voxel_size_m) and voxel_size_m > 0.0):
        raise InputError(f"the voxel size must be a positive number of metres, not {voxel_size_m}", hint="try 0.1")


@kernel
def part_triangles(
    vertices_m: NDArray[np.float64],
    faces: NDArray[np.int32],
    voxel_size_m: float,
    origin_m: NDArray[np.float64],
    low: NDArray[np.int64],
) -> NDArray[np.float64]:
    """Return triangles in lattice coordinates, (F, 3, 3), relative to the cell ``low``."""
    points = all_rounded(vertices_m, origin_m, voxel_size_m)
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


def lattice_triangles(
    vertices_m: NDArray[np.float64], faces: NDArray[np.int32], voxel_size_m: float, origin_m: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return triangles in lattice coordinates (cells), (F, 3, 3) float64, and the (2, 3) box around them.

    Raises:
        InputError: If there are no triangles, the cell size is not a positive number, or a coordinate is not finite or
            more than 2^28 cells from the origin.
    """
    if len(faces) == 0:
        raise InputError("a mesh without triangles cannot be voxelized", hint="select elements with a body")
    require_size(voxel_size_m)
    vertices = np.ascontiguousarray(vertices_m, np.float64)
    triangles = all_rounded(vertices, np.array(origin_m, np.float64), float(voxel_size_m))[faces]
    bounds = np.stack([triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))])
    if np.isnan(bounds).any():
        raise InputError(
            f"a vertex is not finite, or is more than {_LARGEST_VOX:,.0f} cells of {voxel_size_m:g} m from the origin",
            hint="move the model near its origin, or choose a larger cell",
        )
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
