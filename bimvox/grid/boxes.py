"""Represent a voxel shape as a short list of disjoint boxes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel


@kernel
def boxes_of(cells: NDArray[np.bool_]) -> NDArray[np.int32]:
    """Return disjoint boxes that cover a shape; greedy: each grows from the first free cell along z, then x, then y.

    Args:
        cells: (X, Y, Z) boolean shape.

    Returns:
        (B, 6) int32 half-open boxes ``x0 y0 z0 x1 y1 z1`` whose union is the shape and which do not overlap.
    """
    nx, ny, nz = cells.shape
    left, count = np.empty(cells.shape, np.bool_), 0
    for i in range(nx):
        for j in range(ny):
            for k in range(nz):
                left[i, j, k] = cells[i, j, k]
                count += cells[i, j, k]
    boxes = np.empty((max(1, count), 6), np.int32)
    count = 0
    for i in range(nx):
        for j in range(ny):
            for k in range(nz):
                if not left[i, j, k]:
                    continue
                k1 = k + 1
                while k1 < nz and left[i, j, k1]:
                    k1 += 1
                i1 = i + 1
                while i1 < nx and _is_full(left, i1, i1 + 1, j, k, k1):
                    i1 += 1
                j1 = j + 1
                while j1 < ny and _is_full(left, i, i1, j1, k, k1):
                    j1 += 1
                for x in range(i, i1):
                    for y in range(j, j1):
                        for z in range(k, k1):
                            left[x, y, z] = False
                boxes[count, 0], boxes[count, 1], boxes[count, 2] = i, j, k
                boxes[count, 3], boxes[count, 4], boxes[count, 5] = i1, j1, k1
                count += 1
    return boxes[:count].copy()


@leaf_kernel
def _is_full(cells: NDArray[np.bool_], i0: int, i1: int, j: int, k0: int, k1: int) -> bool:
    for i in range(i0, i1):
        for k in range(k0, k1):
            if not cells[i, j, k]:
                return False
    return True
