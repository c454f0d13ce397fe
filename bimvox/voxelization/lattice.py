"""Metres to lattice coordinates, and the limits on the number of cells.

The lattice is anchored in the world: cell (i, j, k) covers ``origin_m + h * [i, i + 1)`` and so on, whatever the
bounds of the part. Coordinates are in cells, rounded to 2^-24 of a cell (6 nm at 0.1 m), so that moving a part by whole
cells changes no bit of the kernels' input.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.errors import GridTooLargeError, InputError

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


def lattice_triangles(
    vertices_m: NDArray[np.float64], faces: NDArray[np.int32], voxel_size_m: float, origin_m: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return triangles in lattice coordinates (cells), (F, 3, 3) float64, and the (2, 3) box around them.

    Raises InputError: if there are no triangles, the cell size is not a positive number, or a coordinate is not finite
    or more than 2^28 cells from the origin.
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


DEFAULT_CELL_LIMIT = 20_000_000
"""Most cells of a grid whose cell size is the default one."""

_ROUND_SIZES_M = (0.05, 0.1, 0.2, 0.25, 0.5)


def round_voxel_sizes_m() -> Iterator[float]:
    """Yield the offered cell sizes, ascending: 0.05, 0.1, 0.2, 0.25, 0.5, then 1, 2, 4 ... metres."""
    yield from _ROUND_SIZES_M
    size = 1.0
    while True:
        yield size
        size *= 2.0


def cell_count(bounds_m: ArrayLike, voxel_size_m: float) -> int:
    """Return how many cells of a lattice anchored at 0 cover the (2, 3) metre box."""
    bounds_vox = np.asarray(bounds_m, dtype=np.float64) / voxel_size_m
    low, high = cell_range(bounds_vox[0], bounds_vox[1], voxel_size_m)
    a, b, c = (int(n) for n in high - low)
    return a * b * c


def default_voxel_size_m(bounds_m: ArrayLike, cell_limit: int = DEFAULT_CELL_LIMIT) -> float:
    """Return the smallest round cell size that keeps the (2, 3) metre box within ``cell_limit`` cells."""
    return next(size for size in round_voxel_sizes_m() if cell_count(bounds_m, size) <= max(cell_limit, 8))


def require_fit(low: ArrayLike, high: ArrayLike, voxel_size_m: float, cell_limit: int) -> None:
    """Check the half-open cell box [low, high) against the limit before anything is allocated.

    Raises GridTooLargeError: if it has more cells; the error names a cell size that fits.
    """
    low_vox, high_vox = np.asarray(low), np.asarray(high)
    a, b, c = (int(n) for n in high_vox - low_vox)
    if a * b * c > cell_limit:
        bounds_m = np.stack([low_vox, high_vox]) * voxel_size_m
        raise GridTooLargeError(a * b * c, cell_limit, voxel_size_m, default_voxel_size_m(bounds_m, cell_limit))


SAMPLES = 16
"""Vertical lines per cell."""

# One line in each of 16 strips in x, in each of 16 strips in y, and in each of the 4 x 4 blocks: a "rotated grid". It
# measures a wall along an axis to 1/16 of a cell, a plain 4 x 4 grid to 1/4. Found by complete search over the patterns
# that a quarter turn maps to themselves, for the largest minimum distance.
_STRIPS = (2, 6, 15, 11, 3, 7, 14, 10, 5, 1, 8, 12, 4, 0, 9, 13)

# Faces of buildings lie on round numbers. Each line is offset from the middle of its strip by an odd amount (in 2^-20
# of a cell), so that it does not run along such faces. The half step of the lattice (2^-25 of a cell) keeps every line
# off every vertex, so there are no ties.
_OFFSETS = (1237, -2411, 3083, -1699, 2777, -3301, 1511, -2053)


def _position(strip: int) -> float:
    mirrored = strip >= SAMPLES // 2
    at = min(strip, SAMPLES - 1 - strip)
    value = (at + 0.5) / SAMPLES + _OFFSETS[at] / 2.0**20 + 2.0**-25
    return 1.0 - value if mirrored else value


_LINES = np.array([(_position(x), _position(y)) for x, y in enumerate(_STRIPS)]).T.copy()


def sample_lines() -> NDArray[np.float64]:
    """Return the (2, 16) float64 positions, x and y, in the unit square; a quarter turn about its centre permutes them.

    Do not write to the array.
    """
    return _LINES
