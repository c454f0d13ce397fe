"""Coarser solids for pictures, because cells much smaller than a pixel cost time and are invisible."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.grid.frame import GridFrame
from bimvox.rendering.scene.scene import Scene

CELL_LIMIT = 60_000_000
_EDGE_LIMIT = 1600


def coarsened(scene: Scene) -> Scene:
    """Return the scene with cells joined 2 x 2 x 2, repeatedly, until it is drawn in seconds."""
    while scene.solids.size > CELL_LIMIT or max(scene.solids.shape) > _EDGE_LIMIT:
        frame = GridFrame(scene.frame.origin_m, 2.0 * scene.frame.voxel_size_m)
        scene = replace(scene, frame=frame, solids=_halved(scene.solids))
    return scene


@kernel
def _halved(solids: NDArray[np.unsignedinteger]) -> NDArray[np.unsignedinteger]:
    """Join 2 x 2 x 2 cells; the solid that fills most of them wins over empty cells, so that thin parts remain."""
    nx, ny, nz = solids.shape
    out = np.zeros(((nx + 1) // 2, (ny + 1) // 2, (nz + 1) // 2), solids.dtype)
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            for k in range(out.shape[2]):
                best, votes = 0, 0
                for a in range(8):
                    x, y, z = 2 * i + (a & 1), 2 * j + ((a >> 1) & 1), 2 * k + (a >> 2)
                    if x >= nx or y >= ny or z >= nz or solids[x, y, z] == 0:
                        continue
                    count = 0
                    for b in range(8):
                        p, q, r = 2 * i + (b & 1), 2 * j + ((b >> 1) & 1), 2 * k + (b >> 2)
                        if p < nx and q < ny and r < nz and solids[p, q, r] == solids[x, y, z]:
                            count += 1
                    if count > votes:
                        best, votes = solids[x, y, z], count
                out[i, j, k] = best
    return out
