"""The summed-area table: how many cells of any box are occupied, in eight look-ups; and a shape as boxes.

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


@kernel
def update_table(table: NDArray[np.int32], below: NDArray[np.uint16], x0: int, y0: int, z0: int) -> None:
    """Update a summed-area table in place.

    Only entries beyond the lowest changed cell change: the nearer it is to the grid's far corner, the fewer.

    Args:
        table: (X + 1, Y + 1, Z + 1) int32, correct for all cells below (x0, y0, z0).
        below: (X, Y, Z + 1) uint16, how many cells of each column are occupied below each height.
        x0: No cell with a smaller x changed.
        y0: No cell with a smaller y changed.
        z0: No cell with a smaller z changed.
    """
    nx, ny, above = below.shape[0], below.shape[1], below.shape[2] - 1 - z0
    rows = np.empty((ny, above), np.int32)  # sums over x and z
    for j in range(y0, ny):
        for k in range(above):
            rows[j, k] = table[x0, j + 1, z0 + 1 + k] - table[x0, j, z0 + 1 + k]
    for i in range(x0, nx):
        for j in range(y0, ny):
            column, row = below[i, j, z0 + 1 :], rows[j]
            before, sums = table[i + 1, j, z0 + 1 :], table[i + 1, j + 1, z0 + 1 :]
            for k in range(above):  # without dependencies from one height to the next
                row[k] += np.int32(column[k])
                sums[k] = before[k] + row[k]


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
    """Return the (X, Y) int32 height map: one above the highest occupied cell of each column, 0 if it is empty."""
    nx, ny, nz = occupied.shape
    top = np.zeros((nx, ny), np.int32)
    for i in range(nx):
        for j in range(ny):
            for k in range(nz - 1, -1, -1):
                if occupied[i, j, k]:
                    top[i, j] = k + 1
                    break
    return top


@kernel
def boxes_of(cells: NDArray[np.bool_]) -> NDArray[np.int32]:
    """Return disjoint boxes that cover a shape; greedy: each grows from the first free cell along z, then x, then y.

    ``cells``: (X, Y, Z) boolean shape. Returns (B, 6) int32 half-open boxes ``x0 y0 z0 x1 y1 z1`` whose union is the
    shape and which do not overlap.
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
