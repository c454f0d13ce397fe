from __future__ import annotations

import numpy as np
import pytest

from bimvox.grid.frame import GridFrame
from bimvox.grid.labels import Label
from bimvox.grid.part_cells import all_part_cells, part_cells
from bimvox.grid.voxel_grid import Part, VoxelGrid


def grid_of(met: list[set[tuple[int, int, int]]], shape: tuple[int, int, int]) -> VoxelGrid:
    """A grid of parts that meet these cells; the highest index owns a shared cell."""
    owners = np.full(shape, -1, np.int32)
    rows = []
    for cell in np.ndindex(shape):
        parts = [index for index, cells in enumerate(met) if cell in cells]
        if parts:
            owners[cell] = parts[-1]
        if len(parts) > 1:
            rows += [(cell, part) for part in parts]
    return VoxelGrid(
        frame=GridFrame((0.0, 0.0, 0.0), 1.0),
        labels=np.where(owners >= 0, Label.COMPONENT, Label.AIR).astype(np.uint8),
        owners=owners,
        parts=tuple(
            Part(str(n), str(n), "Mesh", "", "component", Label.COMPONENT, len(c), 0.0, 0.0, "winding")
            for n, c in enumerate(met)
        ),
        shared_cells=np.array([row[0] for row in rows], np.int32).reshape(-1, 3),
        shared_parts=np.array([row[1] for row in rows], np.int32),
        shared_fractions=np.full(len(rows), 0.5, np.float32),
    )


def test_owned_and_shared_cells_are_both_met() -> None:
    rng = np.random.default_rng(0)
    shape = (5, 4, 6)
    met = [set(map(tuple, rng.integers(0, shape, (n * 9, 3)).tolist())) for n in range(6)]
    grid = grid_of(met, shape)
    together = all_part_cells(grid)
    assert len(together) == 6
    for index, cells in enumerate(met):
        assert together[index].dtype == np.int32
        assert together[index].tolist() == [list(cell) for cell in sorted(cells)]
        np.testing.assert_array_equal(part_cells(grid, index), together[index])
    assert together[0].shape == (0, 3)


def test_a_part_that_does_not_exist_is_an_error() -> None:
    with pytest.raises(IndexError, match="part 1"):
        part_cells(grid_of([{(0, 0, 0)}], (1, 1, 1)), 1)
