"""The compiled loops over bricks; :mod:`bimvox.grid.bricks` describes the arrays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel

BRICK = 8
"""Edge of a brick, cells."""


@kernel
def read_owners(
    index: NDArray[np.int32],
    cells: NDArray[np.unsignedinteger],
    low: NDArray[np.int64],
    out: NDArray[np.int32],
) -> None:
    """Fill ``out`` with the owners in a box of its shape that starts at ``low``, inside the grid."""
    for i in range(out.shape[0]):
        x = low[0] + i
        for j in range(out.shape[1]):
            y = low[1] + j
            k = 0
            while k < out.shape[2]:
                z = low[2] + k
                stop = min(out.shape[2], k + BRICK - z % BRICK)
                at = index[x // BRICK, y // BRICK, z // BRICK]
                if at < 0:
                    for n in range(k, stop):
                        out[i, j, n] = -at - 2
                else:
                    for n in range(k, stop):
                        out[i, j, n] = np.int32(cells[at, x % BRICK, y % BRICK, (low[2] + n) % BRICK]) - 1
                k = stop


@kernel
def read_mapped(
    index: NDArray[np.int32],
    cells: NDArray[np.unsignedinteger],
    low: NDArray[np.int64],
    table: NDArray[np.generic],
    out: NDArray[np.generic],
) -> bool:
    """Fill ``out`` with ``table[owner + 1]`` for :func:`read_owners`; return whether every owner is in the table."""
    for i in range(out.shape[0]):
        x = low[0] + i
        for j in range(out.shape[1]):
            y = low[1] + j
            k = 0
            while k < out.shape[2]:
                z = low[2] + k
                stop = min(out.shape[2], k + BRICK - z % BRICK)
                at = index[x // BRICK, y // BRICK, z // BRICK]
                if at < 0:
                    if -at > table.size:
                        return False
                    for n in range(k, stop):
                        out[i, j, n] = table[-at - 1]
                else:
                    for n in range(k, stop):
                        value = cells[at, x % BRICK, y % BRICK, (low[2] + n) % BRICK]
                        if value >= table.size:
                            return False
                        out[i, j, n] = table[value]
                k = stop
    return True


@kernel
def read_layers(
    index: NDArray[np.int32],
    cells: NDArray[np.unsignedinteger],
    low: int,
    table: NDArray[np.generic],
    out: NDArray[np.generic],
) -> None:
    """Fill ``out``, indexed [z, y, x], with ``table[owner + 1]`` of horizontal cell layers in one layer of bricks.

    ``low`` is the z index of the first layer; ``table`` has a row for every owner.
    """
    layer = low // BRICK
    for b in range(index.shape[1]):
        for a in range(index.shape[0]):
            at = index[a, b, layer]
            for k in range(out.shape[0]):
                for y in range(b * BRICK, min(b * BRICK + BRICK, out.shape[1])):
                    for x in range(a * BRICK, min(a * BRICK + BRICK, out.shape[2])):
                        value = -at - 1 if at < 0 else np.int64(cells[at, x % BRICK, y % BRICK, low % BRICK + k])
                        out[k, y, x] = table[value]


@kernel
def labels_agree(owners: NDArray[np.int32], labels: NDArray[np.uint8], of_owner: NDArray[np.uint8]) -> bool:
    """Return whether every cell has the label ``of_owner[owner + 1]``."""
    for i in range(owners.shape[0]):
        for j in range(owners.shape[1]):
            for k in range(owners.shape[2]):
                if labels[i, j, k] != of_owner[owners[i, j, k] + 1]:
                    return False
    return True


@kernel
def enter_owners(
    owners: NDArray[np.int32],
    low: NDArray[np.int64],
    index: NDArray[np.int32],
    cells: NDArray[np.unsignedinteger],
    row: int,
    parts: int,
) -> int:
    """Store a dense box of whole bricks that starts at the brick ``low``; return the next free row of ``cells``.

    Return -1, with some of the bricks stored, if an owner is neither -1 nor below ``parts``.
    """
    nx, ny, nz = owners.shape
    for x0 in range(0, nx, BRICK):
        x1 = min(x0 + BRICK, nx)
        for y0 in range(0, ny, BRICK):
            y1 = min(y0 + BRICK, ny)
            for z0 in range(0, nz, BRICK):
                z1 = min(z0 + BRICK, nz)
                first = owners[x0, y0, z0]
                same = True
                for x in range(x0, x1):
                    for y in range(y0, y1):
                        for z in range(z0, z1):
                            owner = owners[x, y, z]
                            if owner < -1 or owner >= parts:
                                return -1
                            same &= owner == first
                at = -2 - first
                if not same:
                    at = row
                    row += 1
                    cells[at] = 0
                    for x in range(x0, x1):
                        for y in range(y0, y1):
                            for z in range(z0, z1):
                                cells[at, x - x0, y - y0, z - z0] = owners[x, y, z] + 1
                index[low[0] + x0 // BRICK, low[1] + y0 // BRICK, low[2] + z0 // BRICK] = at
    return row


@kernel
def count_owners(
    index: NDArray[np.int32],
    cells: NDArray[np.unsignedinteger],
    shape: tuple[int, int, int],
    counts: NDArray[np.int64],
) -> None:
    """Add the number of cells of every owner to ``counts``; owner n has index n + 1."""
    for a in range(index.shape[0]):
        nx = min(BRICK, shape[0] - a * BRICK)
        for b in range(index.shape[1]):
            ny = min(BRICK, shape[1] - b * BRICK)
            for c in range(index.shape[2]):
                nz = min(BRICK, shape[2] - c * BRICK)
                at = index[a, b, c]
                if at < 0:
                    counts[-at - 1] += nx * ny * nz
                else:
                    for x in range(nx):
                        for y in range(ny):
                            for z in range(nz):
                                counts[cells[at, x, y, z]] += 1


@kernel
def list_occupied(owners: NDArray[np.int32], x0: int, cells: NDArray[np.int32], found: NDArray[np.int32]) -> int:
    """Write the cells of a dense slab that have an owner, and the owners; return how many."""
    row = 0
    for i in range(owners.shape[0]):
        for j in range(owners.shape[1]):
            for k in range(owners.shape[2]):
                if owners[i, j, k] >= 0:
                    cells[row, 0], cells[row, 1], cells[row, 2] = x0 + i, j, k
                    found[row] = owners[i, j, k]
                    row += 1
    return row


@kernel
def owners_at(
    index: NDArray[np.int32],
    cells: NDArray[np.unsignedinteger],
    points: NDArray[np.int32],
    out: NDArray[np.int32],
) -> None:
    """Fill ``out`` with the owners of single cells inside the grid."""
    for n in range(points.shape[0]):
        x, y, z = points[n, 0], points[n, 1], points[n, 2]
        at = index[x // BRICK, y // BRICK, z // BRICK]
        out[n] = -at - 2 if at < 0 else np.int32(cells[at, x % BRICK, y % BRICK, z % BRICK]) - 1


@kernel
def sort_boxed_cells(
    index: NDArray[np.int32],
    cells: NDArray[np.unsignedinteger],
    shape: tuple[int, int, int],
    boxes: NDArray[np.int32],
    box_parts: NDArray[np.int32],
    owned: NDArray[np.int64],
    lent_parts: NDArray[np.int32],
    lent_places: NDArray[np.int64],
) -> int:
    """Count the cells in each part's boxes that it owns; list the part and the position of the others.

    Return the number of others, or -1 if the list is too short.
    """
    row = 0
    for n in range(boxes.shape[0]):
        part = box_parts[n]
        for x in range(boxes[n, 0], boxes[n, 3]):
            for y in range(boxes[n, 1], boxes[n, 4]):
                for z in range(boxes[n, 2], boxes[n, 5]):
                    at = index[x // BRICK, y // BRICK, z // BRICK]
                    owner = -at - 2 if at < 0 else np.int64(cells[at, x % BRICK, y % BRICK, z % BRICK]) - 1
                    if owner == part:
                        owned[part] += 1
                    elif row == lent_parts.size:
                        return -1
                    else:
                        lent_parts[row] = part
                        lent_places[row] = (np.int64(x) * shape[1] + y) * shape[2] + z
                        row += 1
    return row
