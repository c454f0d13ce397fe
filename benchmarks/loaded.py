"""On import, loads everything that ``bimvox voxelize`` uses: a process forked afterwards starts immediately."""

import gc
import importlib

import numpy as np

from bimvox.bim.building import TriangleMesh
from bimvox.voxelization.part import voxelize_mesh

for name in (
    "bimvox.bim.ifc.reader",
    "bimvox.grid.storage",
    "bimvox_cli.main",
    "bimvox_pipeline.voxelize",
    "zarr.codecs",
):
    importlib.import_module(name)
# A tetrahedron compiles the kernels, or loads them from numba's cache.
voxelize_mesh(TriangleMesh(np.eye(4, 3), np.array([[2, 1, 0], [0, 1, 3], [1, 2, 3], [2, 0, 3]], np.int32)), 0.3)
gc.freeze()  # loaded objects stay: tracing them again would only copy memory in every fork
