"""The kernels that turn entered parts into bricks of owners and a sorted list of shared cells."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.grid.bricks import BRICK
from bimvox.voxelization.bits import NONE
from bimvox.voxelization.sweep import FULL

_DIGIT = 13


@kernel
def settle(
    index: NDArray[np.int32],
    cells: NDArray[Any],
    shape: tuple[int, int, int],
    out: NDArray[Any],
    words: NDArray[np.uint64],
    out_words: NDArray[np.uint64],
) -> int:
    """Copy the bricks with several owners to ``out``, in order, and mark the others in ``index``.

    ``words`` and ``out_words`` are the same memory as ``cells`` and ``out``, or empty if their types differ.

    Returns:
        The number of bricks in ``out``.
    """
    used = 0
    per_brick = words.size // max(cells.size // BRICK**3, 1)
    for bx in range(index.shape[0]):
        x1 = min(BRICK, shape[0] - bx * BRICK)
        for by in range(index.shape[1]):
            y1 = min(BRICK, shape[1] - by * BRICK)
            for bz in range(index.shape[2]):
                brick = index[bx, by, bz]
                if brick < 0:
                    continue
                z1 = min(BRICK, shape[2] - bz * BRICK)
                base, to = brick * BRICK**3, used * BRICK**3
                owner = cells[base]
                others = 0
                if x1 * y1 * z1 == BRICK**3 and per_brick > 0:
                    base, to = brick * per_brick, used * per_brick
                    first = words[base]
                    differ = NONE
                    for n in range(per_brick):
                        differ |= words[base + n] ^ first
                        out_words[to + n] = words[base + n]
                    base = brick * BRICK**3
                    for n in range(1, BRICK):
                        others |= cells[base + n] ^ owner
                    others |= int(differ != NONE)
                elif x1 * y1 * z1 == BRICK**3:
                    for n in range(BRICK**3):
                        others |= cells[base + n] ^ owner
                        out[to + n] = cells[base + n]
                else:
                    # Cells outside the grid have no owner.
                    for n in range(BRICK**3):
                        out[to + n] = 0
                    for x in range(x1):
                        for y in range(y1):
                            for n in range((x * BRICK + y) * BRICK, (x * BRICK + y) * BRICK + z1):
                                others |= cells[base + n] ^ owner
                                out[to + n] = cells[base + n]
                if others == 0:
                    index[bx, by, bz] = -np.int64(owner) - 1
                else:
                    index[bx, by, bz] = used
                    used += 1
    return used


@kernel
def sorted_rows(
    ranks: NDArray[np.int64], parts: NDArray[np.int32], shares: NDArray[np.uint16], shape: tuple[int, int, int]
) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.float32]]:
    """Return cells (R, 3), parts and shares of rows sorted by rank; rows of one rank keep their order (radix sort)."""
    count = ranks.size
    order, other = np.empty(count, np.int64), np.empty(count, np.int64)
    for n in range(count):
        order[n] = n
    sorted_ranks, other_ranks = ranks, np.empty(count, np.int64)
    spare = np.empty(count, np.int64)
    starts = np.empty((1 << _DIGIT) + 1, np.int64)
    highest = shape[0] * shape[1] * shape[2]
    shift = 0
    while highest >> shift > 0:
        for n in range(starts.size):
            starts[n] = 0
        for n in range(count):
            starts[(sorted_ranks[n] >> shift & (1 << _DIGIT) - 1) + 1] += 1
        for n in range(1 << _DIGIT):
            starts[n + 1] += starts[n]
        for n in range(count):
            rank = sorted_ranks[n]
            digit = rank >> shift & (1 << _DIGIT) - 1
            at = starts[digit]
            other[at], other_ranks[at] = order[n], rank
            starts[digit] = at + 1
        order, other = other, order
        # The arguments stay unchanged.
        sorted_ranks, other_ranks = other_ranks, spare if shift == 0 else sorted_ranks
        shift += _DIGIT
    cells, owners = np.empty((count, 3), np.int32), np.empty(count, np.int32)
    fractions = np.empty(count, np.float32)
    i = j = base = 0
    for n in range(count):
        row, rank = order[n], sorted_ranks[n]
        if not base <= rank < base + shape[2]:
            column = rank // shape[2]
            i, j, base = column // shape[1], column % shape[1], column * shape[2]
        cells[n, 0], cells[n, 1], cells[n, 2] = i, j, rank - base
        owners[n] = parts[row]
        fractions[n] = np.float32(shares[row]) / np.float32(FULL)
    return cells, owners, fractions
