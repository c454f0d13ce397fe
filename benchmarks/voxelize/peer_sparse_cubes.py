"""sparse-cubes (GPL, only run here): solids as sorted lists of cells, part by part."""

from __future__ import annotations

import warnings

import numpy as np
import sparsecubes
from numpy.typing import NDArray

from benchmarks.voxelize.case import Scene, Window
from benchmarks.voxelize.tool import Masks, mask_of


class SparseCubesParts:
    """`sparsecubes.voxelize` with its defaults (surface and parity fill)."""

    def __init__(self, scene: Scene) -> None:
        # Its cells are centred on multiples of the spacing, ours start there.
        self._meshes = [(mesh.vertices_m - scene.voxel_size_m / 2, mesh.faces) for mesh in scene.parts]
        self._h = scene.voxel_size_m
        self._cells: list[NDArray[np.int64]] = []

    def run(self) -> None:
        """Voxelize every part."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            self._cells = [sparsecubes.voxelize(mesh, spacing=self._h) for mesh in self._meshes]

    def forget(self) -> None:
        """Drop the cells."""
        self._cells = []

    def cells_in(self, window: Window) -> Masks:
        """Look into the parts' lists."""
        masks = []
        for part in window.parts.tolist():
            cells = self._cells[part]
            first, last = np.searchsorted(cells[:, 0], (window.low[0], window.high[0]))
            masks.append(mask_of(cells[first:last], window))
        return np.array(masks, np.bool_).reshape(len(masks), *window.shape)

    def solid_cells(self) -> int | None:
        """Not counted."""
        return None
