"""Metres to lattice coordinates: what "a cell" is to the voxelizer.

The lattice is anchored in the world: cell (i, j, k) covers ``origin_m + h * [i, i + 1)`` and so on, whatever the
bounds of the part. Coordinates are counted in cells and rounded to 2^-24 of a cell (6 nm at 0.1 m), so that moving a
part by whole cells changes no bit of what the kernels see.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.errors import InputError

TOLERANCE_M = 1e-4
"""A cell is met when the part reaches more than this far into it, so that faces lying on a border do not spill over."""

_TOLERANCE_LIMIT_VOX = 0.01
STEPS_PER_CELL = float(2**24)
"""Steps that lattice coordinates are rounded to."""

_LARGEST_VOX = float(2**28)


def tolerance_vox(voxel_size_m: float) -> float:
    """Return ``TOLERANCE_M`` in cells, but never more than a hundredth of a cell."""
    return min(TOLERANCE_M / voxel_size_m, _TOLERANCE_LIMIT_VOX)


def to_lattice(points_m: ArrayLike, voxel_size_m: float, origin_m: ArrayLike) -> NDArray[np.float64]:
    """Return points in lattice coordinates (cells): (..., 3) metres -> (..., 3) float64, rounded to 2^-24 of a cell.

    Raises:
        InputError: If the cell size is not a positive number, or a coordinate is not finite or more than 2^28 cells
            from the origin.
    """
    if not (np.isfinite(voxel_size_m) and voxel_size_m > 0.0):
        raise InputError(f"the voxel size must be a positive number of metres, not {voxel_size_m}")
    vox = (np.asarray(points_m, dtype=np.float64) - np.asarray(origin_m, dtype=np.float64)) / voxel_size_m
    if not np.all(np.abs(vox) < _LARGEST_VOX):
        raise InputError(
            f"a vertex is not finite, or more than {_LARGEST_VOX:.0f} cells of {voxel_size_m:g} m from the origin",
            hint="subtract the model's origin first, or choose a larger cell",
        )
    rounded: NDArray[np.float64] = np.rint(vox * STEPS_PER_CELL) / STEPS_PER_CELL
    return rounded


def cell_range(
    low_vox: ArrayLike, high_vox: ArrayLike, voxel_size_m: float
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the half-open range of cells that something with these bounds meets, borders not spilling over.

    Something thinner than the tolerance on a border belongs to the cell above (the half-open rule).

    Args:
        low_vox: (..., 3) lowest corner in lattice coordinates.
        high_vox: (..., 3) highest corner in lattice coordinates.
        voxel_size_m: Edge of a cell.
    """
    tolerance = tolerance_vox(voxel_size_m)
    low = np.floor(np.asarray(low_vox) + tolerance).astype(np.int64)
    high = np.ceil(np.asarray(high_vox) - tolerance).astype(np.int64)
    return low, np.maximum(high, low + 1)
