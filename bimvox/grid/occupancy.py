"""The summed-area table: how many cells of any box are occupied, in eight look-ups.

A 3-D integral image (Crow 1984, "Summed-area tables for texture mapping", in three dimensions): entry [i, j, k] holds
the number of occupied cells below i, j and k. A box is free when its sum is zero, whatever its size.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel


@kernel
def summed_area_table(occupied: NDArray[np.bool_]) -> NDArray[np.int32]:
    """Return the (X + 1, Y + 1, Z + 1) int32 table of an (X, Y, Z) boolean grid."""
    nx, ny, nz = occupied.shape
    table = np.zeros((nx + 1, ny + 1, nz + 1), np.int32)
    for i in range(nx):
        for j in range(ny):
            run = np.int32(0)
            for k in range(nz):
                run += np.int32(occupied[i, j, k])
                table[i + 1, j + 1, k + 1] = run + table[i, j + 1, k + 1] + table[i + 1, j, k + 1] - table[i, j, k + 1]
    return table


@leaf_kernel
def box_sum(table: NDArray[np.int32], x0: int, y0: int, z0: int, x1: int, y1: int, z1: int) -> int:
    """Return how many cells of the half-open box [x0, x1) x [y0, y1) x [z0, z1) are occupied; it must lie inside."""
    return int(
        table[x1, y1, z1]
        - table[x0, y1, z1]
        - table[x1, y0, z1]
        - table[x1, y1, z0]
        + table[x0, y0, z1]
        + table[x0, y1, z0]
        + table[x1, y0, z0]
        - table[x0, y0, z0]
    )


@kernel
def top_of_columns(occupied: NDArray[np.bool_]) -> NDArray[np.int32]:
    """Return the (X, Y) int32 height map: one above the highest occupied cell of each column, 0 where it is empty."""
    nx, ny, nz = occupied.shape
    top = np.zeros((nx, ny), np.int32)
    for i in range(nx):
        for j in range(ny):
            for k in range(nz - 1, -1, -1):
                if occupied[i, j, k]:
                    top[i, j] = k + 1
                    break
    return top
