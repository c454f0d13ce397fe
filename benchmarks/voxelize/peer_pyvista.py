"""PyVista (VTK): stencils of closed surfaces, sampled at the cells' centres."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyvista
from numpy.typing import NDArray

from benchmarks.voxelize.case import Scene, Window
from benchmarks.voxelize.tool import Masks, cut_out
from bimvox.bim.building import TriangleMesh
from bimvox.voxelization.lattice import cell_range


def _surface(mesh: TriangleMesh) -> Any:
    return pyvista.PolyData.from_regular_faces(mesh.vertices_m, mesh.faces)


def _volume(low: NDArray[np.int64], high: NDArray[np.int64], h: float) -> Any:
    """Return the image whose points are the centres of the cells [low, high)."""
    return pyvista.ImageData(dimensions=tuple(high - low), spacing=(h, h, h), origin=tuple((low + 0.5) * h))


def _mask(image: Any) -> NDArray[np.bool_]:
    dense: NDArray[np.bool_] = image.point_data["mask"].reshape(image.dimensions, order="F").astype(np.bool_)
    return dense


class PyvistaMask:
    """`voxelize_binary_mask` of all triangles together."""

    def __init__(self, scene: Scene) -> None:
        self._mesh = _surface(TriangleMesh(scene.vertices_m, scene.faces))
        self._low = scene.low
        self._reference = _volume(scene.low, scene.high, scene.voxel_size_m)
        self._image: Any = None

    def run(self) -> None:
        """Voxelize the merged mesh."""
        self._image = self._mesh.voxelize_binary_mask(reference_volume=self._reference)

    def forget(self) -> None:
        """Drop the image."""
        self._image = None

    def cells_in(self, window: Window) -> Masks:
        """Look into the image."""
        return cut_out(_mask(self._image), self._low, window)

    def solid_cells(self) -> int | None:
        """Not counted."""
        return None


class PyvistaParts:
    """`voxelize_binary_mask` part by part, each in the cells of its own bounds."""

    def __init__(self, scene: Scene) -> None:
        self._meshes = [_surface(mesh) for mesh in scene.parts]
        self._h = scene.voxel_size_m
        bounds = [mesh.bounds_m / self._h for mesh in scene.parts]
        self._ranges = [cell_range(box[0], box[1], self._h) for box in bounds]
        self._images: list[Any] = []

    def run(self) -> None:
        """Voxelize every part."""
        self._images = [
            mesh.voxelize_binary_mask(reference_volume=_volume(low, high, self._h))
            for mesh, (low, high) in zip(self._meshes, self._ranges, strict=True)
        ]

    def forget(self) -> None:
        """Drop the images."""
        self._images = []

    def cells_in(self, window: Window) -> Masks:
        """Look into the parts' images."""
        masks = [cut_out(_mask(self._images[part]), self._ranges[part][0], window) for part in window.parts.tolist()]
        return np.array(masks, np.bool_).reshape(len(masks), *window.shape)

    def solid_cells(self) -> int | None:
        """Not counted."""
        return None
