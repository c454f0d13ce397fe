"""All the cells that a part meets: the ones it owns, and the ones it shares with a part that fills more of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.grid.voxel_grid import VoxelGrid


@kernel
def _gather(
    owners: NDArray[np.int32],
    shared_cells: NDArray[np.int32],
    shared_parts: NDArray[np.int32],
    only: int,
    cursor: NDArray[np.int64],
    out: NDArray[np.int32],
    count_only: bool,
) -> None:
    """Walk the grid once with the (sorted) shared rows alongside; ``cursor`` (per part) is moved on."""
    row = 0
    for i in range(owners.shape[0]):
        for j in range(owners.shape[1]):
            for k in range(owners.shape[2]):
                owner = owners[i, j, k]
                if owner < 0:
                    continue
                shared = False
                while (
                    row < shared_parts.size
                    and shared_cells[row, 0] == i
                    and shared_cells[row, 1] == j
                    and shared_cells[row, 2] == k
                ):
                    shared = True
                    part = shared_parts[row]
                    row += 1
                    if only < 0 or part == only:
                        if not count_only:
                            out[cursor[part], 0], out[cursor[part], 1], out[cursor[part], 2] = i, j, k
                        cursor[part] += 1
                if not shared and (only < 0 or owner == only):
                    if not count_only:
                        out[cursor[owner], 0], out[cursor[owner], 1], out[cursor[owner], 2] = i, j, k
                    cursor[owner] += 1


def part_cells(grid: VoxelGrid, index: int) -> NDArray[np.int32]:
    """Return all the cells that one part meets, owned or shared: (N, 3) int32 in ascending order.

    Reads the whole grid; for many parts use ``all_part_cells``.
    """
    if not 0 <= index < len(grid.parts):
        raise IndexError(f"part {index} of a grid with {len(grid.parts)} parts")
    return _cells(grid, index)[index]


def all_part_cells(grid: VoxelGrid) -> list[NDArray[np.int32]]:
    """Return all the cells that each part meets, in one pass over the grid: per part (N, 3) int32, ascending."""
    return _cells(grid, -1)


def _cells(grid: VoxelGrid, only: int) -> list[NDArray[np.int32]]:
    counts = np.zeros(len(grid.parts), np.int64)
    nothing = np.empty((0, 3), np.int32)
    _gather(grid.owners, grid.shared_cells, grid.shared_parts, only, counts, nothing, True)
    stops = np.cumsum(counts)
    out = np.empty((int(counts.sum()), 3), np.int32)
    _gather(grid.owners, grid.shared_cells, grid.shared_parts, only, stops - counts, out, False)
    return [out[stop - count : stop] for count, stop in zip(counts, stops, strict=True)]
