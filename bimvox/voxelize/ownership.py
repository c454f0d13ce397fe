"""Who owns a cell that several parts meet: the part that fills most of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.grid.labels import Label
from bimvox.grid.voxel_grid import NO_OWNER
from bimvox.voxelize.part import PartVoxels

# A share in `best` is stored as it is while one part meets the cell, and as -1 - share once the cell's first part has
# its row in the list of shared cells.


@kernel
def _count_rows(owners: NDArray[np.int32], best: NDArray[np.float32], cells: NDArray[np.bool_]) -> int:
    rows = 0
    for i in range(cells.shape[0]):
        for j in range(cells.shape[1]):
            for k in range(cells.shape[2]):
                if cells[i, j, k] and owners[i, j, k] != NO_OWNER:
                    rows += 2 if best[i, j, k] >= 0.0 else 1
    return rows


@kernel
def _claim(
    labels: NDArray[np.uint8],
    owners: NDArray[np.int32],
    best: NDArray[np.float32],
    cells: NDArray[np.bool_],
    fractions: NDArray[np.float32],
    part: int,
    label: int,
    row_cells: NDArray[np.int32],
    row_parts: NDArray[np.int32],
    row_fractions: NDArray[np.float32],
) -> None:
    """Enter one part into the views of the grid under its box; rows get cells relative to that box."""
    row = 0
    for i in range(cells.shape[0]):
        for j in range(cells.shape[1]):
            for k in range(cells.shape[2]):
                if not cells[i, j, k]:
                    continue
                share = fractions[i, j, k]
                owner = owners[i, j, k]
                if owner == NO_OWNER:
                    owners[i, j, k] = part
                    labels[i, j, k] = label
                    best[i, j, k] = share
                    continue
                held = best[i, j, k]
                if held >= 0.0:
                    row_cells[row, 0], row_cells[row, 1], row_cells[row, 2] = i, j, k
                    row_parts[row] = owner
                    row_fractions[row] = held
                    row += 1
                else:
                    held = -1.0 - held
                row_cells[row, 0], row_cells[row, 1], row_cells[row, 2] = i, j, k
                row_parts[row] = part
                row_fractions[row] = share
                row += 1
                if share > held:
                    owners[i, j, k] = part
                    labels[i, j, k] = label
                    held = share
                best[i, j, k] = np.float32(-1.0) - held


class Ownership:
    """Collects parts, in the order of their indices, into labels, owners and the list of shared cells.

    Args:
        low: (3,) lattice cell of the grid's cell (0, 0, 0).
        high: (3,) one past its highest cell.
    """

    def __init__(self, low: NDArray[np.int64], high: NDArray[np.int64]) -> None:
        shape = tuple(int(n) for n in high - low)
        self._low = low
        self.labels = np.zeros(shape, np.uint8)
        self.owners = np.full(shape, NO_OWNER, np.int32)
        self._best = np.zeros(shape, np.float32)
        self._cells: list[NDArray[np.int32]] = [np.empty((0, 3), np.int32)]
        self._parts: list[NDArray[np.int32]] = [np.empty(0, np.int32)]
        self._fractions: list[NDArray[np.float32]] = [np.empty(0, np.float32)]

    def add(self, index: int, voxels: PartVoxels, label: Label) -> None:
        """Enter the next part: it takes air, and cells of which it fills more than their owner so far."""
        start = voxels.low - self._low
        box = tuple(slice(int(a), int(a + n)) for a, n in zip(start, voxels.cells.shape, strict=True))
        owners, best = self.owners[box], self._best[box]
        rows = _count_rows(owners, best, voxels.cells)
        cells = np.empty((rows, 3), np.int32)
        parts = np.empty(rows, np.int32)
        fractions = np.empty(rows, np.float32)
        _claim(
            self.labels[box], owners, best, voxels.cells, voxels.fractions, index, int(label), cells, parts, fractions
        )
        if rows:
            self._cells.append(cells + start.astype(np.int32))
            self._parts.append(parts)
            self._fractions.append(fractions)

    def shared(self) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.float32]]:
        """Return the rows of the cells met by several parts, sorted by cell, then part: cells, parts, shares."""
        cells = np.concatenate(self._cells)
        parts = np.concatenate(self._parts)
        fractions = np.concatenate(self._fractions)
        order = np.lexsort((parts, np.ravel_multi_index(tuple(cells.T), self.owners.shape)))
        return cells[order], parts[order], fractions[order]
