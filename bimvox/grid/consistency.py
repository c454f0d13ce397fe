"""Checks that the tables of a grid agree with its cells."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.grid import brick_kernels as kernels
from bimvox.grid.voxel_grid import VoxelGrid


def contradiction(grid: VoxelGrid) -> str | None:
    """Return what is wrong in the tables of a grid, starting with the table's name; None if all agree.

    The table of shared cells is sorted by cell, then part. The owner of a shared cell is one of its rows, and no row
    has a larger share. The boxes of a part contain exactly the cells that it owns and shares.
    """
    owned = grid.owners.counts(len(grid.parts))[1:]
    return _in_shared(grid) or _in_boxes(grid, owned) or _in_parts(grid)


def _in_shared(grid: VoxelGrid) -> str | None:
    cells, parts, fractions = grid.shared_cells, grid.shared_parts, grid.shared_fractions
    if len(parts) == 0:
        return None
    if cells.min() < 0 or np.any(cells.max(axis=0) >= grid.shape):
        return "shared_cells: outside the grid"
    if parts.min() < 0 or parts.max() >= len(grid.parts):
        return f"shared_parts: out of range of the {len(grid.parts)} parts"
    if not np.all((fractions >= 0.0) & (fractions <= 1.0)):
        return "shared_fractions: must be from 0 to 1"
    places = np.ravel_multi_index(tuple(cells.T), grid.shape)
    same = places[1:] == places[:-1]
    if np.any(places[1:] < places[:-1]) or np.any(parts[1:][same] <= parts[:-1][same]):
        return "shared_cells: must be sorted by cell, then part, without repeats"
    first = np.flatnonzero(np.concatenate([[True], ~same]))
    if np.diff(first, append=len(parts)).min() < 2:
        return "shared_cells: a cell with one row is not shared"
    owns = parts == grid.owners.at(cells)
    if not np.all(np.add.reduceat(owns, first) == 1):
        return "shared_parts: the owner of a shared cell is not one of its parts"
    if np.any(np.maximum.reduceat(fractions, first) > fractions[owns]):
        return "shared_fractions: a part that does not own a cell fills more of it than its owner"
    return None


def _in_boxes(grid: VoxelGrid, owned: NDArray[np.int64]) -> str | None:
    boxes, parts = grid.boxes, grid.box_parts
    if len(parts):
        if boxes.min() < 0 or np.any(boxes[:, 3:].max(axis=0) > grid.shape) or np.any(boxes[:, 3:] <= boxes[:, :3]):
            return "boxes: outside the grid, or empty"
        if parts[0] < 0 or parts[-1] >= len(grid.parts) or np.any(parts[1:] < parts[:-1]):
            return f"box_parts: must ascend, within the {len(grid.parts)} parts"
    # Integers below 2^53 stay exact in the weights of bincount; far larger sums fail the comparison below.
    volumes = np.prod(boxes[:, 3:] - boxes[:, :3], axis=1, dtype=np.float64)
    held = np.bincount(parts, volumes, len(grid.parts))
    lent = grid.shared_parts != grid.owners.at(grid.shared_cells)
    lent_parts, lent_cells = grid.shared_parts[lent], grid.shared_cells[lent]
    met = owned + np.bincount(lent_parts, minlength=len(grid.parts))
    for index in np.flatnonzero(held != met)[:1]:
        return f"boxes: those of part {index} hold {held[index]:,.0f} cells, but it meets {met[index]:,}"
    found = np.zeros(len(grid.parts), np.int64)
    others, places = np.empty_like(lent_parts), np.empty(len(lent_parts), np.int64)
    index, cells = grid.owners.index, grid.owners.cells
    count = kernels.sort_boxed_cells(index, cells, grid.shape, boxes, parts, found, others, places)
    expected = np.ravel_multi_index(tuple(lent_cells.T), grid.shape)
    by_table, by_boxes = np.lexsort((expected, lent_parts)), np.lexsort((places, others))
    if (
        np.any(found != owned)
        or count != len(lent_parts)
        or np.any(others[by_boxes] != lent_parts[by_table])
        or np.any(places[by_boxes] != expected[by_table])
    ):
        return "boxes: they do not hold the cells that the parts own and share"
    for index in np.flatnonzero(met != [part.cells for part in grid.parts])[:1]:
        return f"parts[{index}].cells: {grid.parts[index].cells:,}, but it meets {met[index]:,}"
    return None


def _in_parts(grid: VoxelGrid) -> str | None:
    seen: set[str] = set()
    for index, part in enumerate(grid.parts):
        if part.id in seen:
            return f"parts[{index}].id: {part.id!r} occurs twice"
        if not part.solid_volume_m3 >= 0.0 or not part.mass_kg >= 0.0:
            return f"parts[{index}]: a volume or mass below 0"
        seen.add(part.id)
    return None
