"""trimesh: the surface by subdividing triangles, or by rays."""

from __future__ import annotations

from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from benchmarks.voxelize.case import Scene, Window
from benchmarks.voxelize.tool import Masks, mask_of


class TrimeshSurface:
    """`Trimesh.voxelized` of all triangles together."""

    def __init__(self, scene: Scene, method: str) -> None:
        # Its cells are centred on multiples of the pitch, ours start there.
        self._mesh = trimesh.Trimesh(scene.vertices_m - scene.voxel_size_m / 2, scene.faces, process=False)
        self._h = scene.voxel_size_m
        self._method = method
        self._grid: Any = None
        self._cells: NDArray[np.int64] | None = None

    def run(self) -> None:
        """Voxelize the merged mesh."""
        self._grid = self._mesh.voxelized(self._h, method=self._method)

    def forget(self) -> None:
        """Drop the grid."""
        self._grid = self._cells = None

    def cells_in(self, window: Window) -> Masks:
        """Look into the list of cells."""
        if self._cells is None:
            first = np.rint(self._grid.translation / self._h).astype(np.int64)
            self._cells = self._grid.sparse_indices + first
        return mask_of(self._cells, window)

    def solid_cells(self) -> int | None:
        """Not counted."""
        return None
