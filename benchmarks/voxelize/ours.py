"""bimvox itself: the whole building, end to end, as `bimvox voxelize` calls it."""

from __future__ import annotations

import numpy as np

from benchmarks.voxelize.case import Scene, Window
from benchmarks.voxelize.solids import cube
from benchmarks.voxelize.tool import Masks, mask_of
from bimvox.grid.voxel_grid import VoxelGrid, all_part_cells
from bimvox.voxelization.building import voxelize_building


class Bimvox:
    """One labelled grid with owners, shares and the table of parts."""

    def __init__(self, scene: Scene) -> None:
        # Loads compiled code now, as other libraries do when they are imported.
        voxelize_building(cube(1.0), 0.25)
        self._building = scene.building()
        self._voxel_size_m = scene.voxel_size_m
        self._low = scene.low
        self._cells: list[np.ndarray[tuple[int, int], np.dtype[np.int32]]] | None = None
        self._grid: VoxelGrid | None = None

    def run(self) -> None:
        """Voxelize the building."""
        self._grid = voxelize_building(self._building, self._voxel_size_m)

    def forget(self) -> None:
        """Drop the grid."""
        self._grid = self._cells = None

    def cells_in(self, window: Window) -> Masks:
        """Return what each part meets, owned or shared."""
        if self._cells is None:
            self._cells = all_part_cells(self._require())
        masks = []
        for part in window.parts.tolist():
            # Cells ascend, so those of the window's layers of x are contiguous.
            cells = self._cells[part]
            first, last = np.searchsorted(cells[:, 0], (window.low[0] - self._low[0], window.high[0] - self._low[0]))
            masks.append(mask_of(cells[first:last] + self._low, window))
        return np.array(masks, np.bool_).reshape(len(masks), *window.shape)

    def solid_cells(self) -> int | None:
        """Return the cells that are not air."""
        counts = self._require().counts()
        return sum(number for label, number in counts.items() if label != "air")

    def _require(self) -> VoxelGrid:
        if self._grid is None:
            raise RuntimeError("run it first")
        return self._grid
