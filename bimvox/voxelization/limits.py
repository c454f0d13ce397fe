"""The limit on the number of cells, and the cell sizes that keep to it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike

from bimvox.errors import GridTooLargeError
from bimvox.voxelization.lattice import cell_range

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

    Raises:
        GridTooLargeError: If it has more cells; the error names a cell size that fits.
    """
    low_vox, high_vox = np.asarray(low), np.asarray(high)
    a, b, c = (int(n) for n in high_vox - low_vox)
    if a * b * c > cell_limit:
        bounds_m = np.stack([low_vox, high_vox]) * voxel_size_m
        raise GridTooLargeError(a * b * c, cell_limit, voxel_size_m, default_voxel_size_m(bounds_m, cell_limit))
