"""Open3D: the surface of all triangles together."""

from __future__ import annotations

import ctypes
from importlib import resources
from typing import Any

import numpy as np

from benchmarks.voxelize.case import Scene, Window
from benchmarks.voxelize.tool import Masks

try:
    import open3d
except ImportError:
    # Its wheel needs libusb (for cameras) to load, from the system or from another wheel.
    import libusb_package

    ctypes.CDLL(str(resources.files(libusb_package) / "libusb-1.0.so"), mode=ctypes.RTLD_GLOBAL)
    import open3d


class Open3dSurface:
    """`VoxelGrid.create_from_triangle_mesh_within_bounds` on the lattice of the scene."""

    def __init__(self, scene: Scene) -> None:
        self._mesh = open3d.geometry.TriangleMesh(
            open3d.utility.Vector3dVector(scene.vertices_m), open3d.utility.Vector3iVector(scene.faces)
        )
        self._h = scene.voxel_size_m
        self._bounds = scene.low * self._h, scene.high * self._h
        self._grid: Any = None

    def run(self) -> None:
        """Voxelize the merged mesh."""
        make = open3d.geometry.VoxelGrid.create_from_triangle_mesh_within_bounds
        self._grid = make(self._mesh, self._h, *self._bounds)

    def forget(self) -> None:
        """Drop the grid."""
        self._grid = None

    def cells_in(self, window: Window) -> Masks:
        """Ask for the centres of the window's cells."""
        cells = np.indices(window.shape).reshape(3, -1).T + window.low
        centres = open3d.utility.Vector3dVector((cells + 0.5) * self._h)
        return np.array(self._grid.check_if_included(centres), np.bool_).reshape(window.shape)

    def solid_cells(self) -> int | None:
        """Not counted."""
        return None
