"""The only converter between metres and cells, the labels of cells, and the limit on their number."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

# Rounding error, as a share of a cell: a coordinate this close below a cell border counts as on it, because sizes like
# 0.1 m have no exact binary value.
_SNAP = 1e-6

NO_CELLS = np.zeros((0, 3), np.int32)


@dataclass(frozen=True, slots=True)
class GridFrame:
    """Half-open, corner-origin cells: cell (i, j, k) covers ``origin_m + h * [i, i + 1)`` in x, and so on.

    Attributes:
        origin_m: Lowest corner of cell (0, 0, 0), metres.
        voxel_size_m: Edge of a cell, metres.
    """

    origin_m: tuple[float, float, float]
    voxel_size_m: float

    def cell_of(self, points_m: ArrayLike) -> NDArray[np.int64]:
        """Return the cell that holds each point: (..., 3) float -> (..., 3) int64."""
        scaled = (np.asarray(points_m, dtype=np.float64) - np.array(self.origin_m)) / self.voxel_size_m
        cells: NDArray[np.int64] = np.floor(scaled + _SNAP).astype(np.int64)
        return cells

    def corner_of(self, cells: ArrayLike) -> NDArray[np.float64]:
        """Return the lowest corner of each cell, metres: (..., 3) int -> (..., 3) float64."""
        return np.array(self.origin_m) + self.voxel_size_m * np.asarray(cells, dtype=np.float64)

    def in_words(self, cell: ArrayLike) -> str:
        """Return where the lowest corner of a cell is, for people: ``(12.3, 4.5, 6.0) m``."""
        return f"({', '.join(f'{round(value, 1) + 0.0:.1f}' for value in self.corner_of(cell).tolist())}) m"

    def centre_of(self, cells: ArrayLike) -> NDArray[np.float64]:
        """Return the centre of each cell, metres: (..., 3) int -> (..., 3) float64."""
        return self.corner_of(np.asarray(cells, dtype=np.float64) + 0.5)

    def cells_over(self, low_m: ArrayLike, high_m: ArrayLike) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the half-open cell box [low, high) that covers a box in metres, without spilling over borders."""
        scaled = (np.asarray(high_m, dtype=np.float64) - np.array(self.origin_m)) / self.voxel_size_m
        low = self.cell_of(low_m)
        return low, np.maximum(np.ceil(scaled - _SNAP).astype(np.int64), low + 1)


def whole_cells(distance_m: float, voxel_size_m: float) -> int:
    """Return the smallest number of cells that together are not shorter than a distance."""
    return int(np.ceil(distance_m / voxel_size_m - 1e-9))


class Label(IntEnum):
    """The label of a cell; fits uint8.

    ``voxelize`` sets AIR, GROUND, STRUCTURE and COMPONENT; the areas (in the slab's layer) and obstructions are set
    when the site is built.
    """

    AIR = 0
    GROUND = 1
    CONSTRUCTION_AREA = 2
    YARD = 3
    STRUCTURE = 4
    OBSTRUCTION = 5
    COMPONENT = 6


CELL_LIMIT = 500_000_000
"""Most cells of a grid that is created or read, unless the caller allows more.

In bricks an office takes about 0.4 bytes per cell; a grid that differs in every cell takes 1 to 4.
"""
