"""All cells that a part meets: those it owns, and shared ones that another part owns because it fills more of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.grid.voxel_grid import VoxelGrid


@kernel
def _expand(boxes: NDArray[np.int32], shape: tuple[int, int, int], out: NDArray[np.int64]) -> None:
    """Fill ``out`` with the cells in disjoint boxes, as positions in a C-ordered array of that shape."""
    row = 0
    for n in range(boxes.shape[0]):
        for i in range(boxes[n, 0], boxes[n, 3]):
            for j in range(boxes[n, 1], boxes[n, 4]):
                start = (i * shape[1] + j) * shape[2]
                for k in range(boxes[n, 2], boxes[n, 5]):
                    out[row] = start + k
                    row += 1


def part_boxes(grid: VoxelGrid, index: int) -> NDArray[np.int32]:
    """Return the disjoint boxes of the cells that one part meets: (B, 6) int32.

    Raises:
        IndexError: If the part does not exist.
    """
    if not 0 <= index < len(grid.parts):
        raise IndexError(f"part {index} of a grid with {len(grid.parts)} parts")
    first, stop = np.searchsorted(grid.box_parts, (index, index + 1))
    return grid.boxes[first:stop]


def part_cells(grid: VoxelGrid, index: int) -> NDArray[np.int32]:
    """Return all cells that one part meets, owned or shared: (N, 3) int32, ascending."""
    boxes = part_boxes(grid, index)
    places = np.empty(int(np.prod(boxes[:, 3:] - boxes[:, :3], axis=1, dtype=np.int64).sum()), np.int64)
    _expand(boxes, grid.shape, places)
    places.sort()
    return np.stack(np.unravel_index(places, grid.shape), axis=1).astype(np.int32)


def all_part_cells(grid: VoxelGrid) -> list[NDArray[np.int32]]:
    """Return all cells that each part meets: per part (N, 3) int32, ascending."""
    return [part_cells(grid, index) for index in range(len(grid.parts))]
