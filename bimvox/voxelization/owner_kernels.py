"""The kernels that enter parts into bricks of owners and settle shared cells, for ``ownership.Ownership``."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import inline_kernel, kernel, leaf_kernel
from bimvox.grid.bricks import BRICK
from bimvox.voxelization.bits import NONE
from bimvox.voxelization.part import Batch
from bimvox.voxelization.sweep import FULL

# Set in a cell's mark, next to its owner's share, once its first part has a row in the list of shared cells.
_LISTED = 1 << 15
_SHARE = _LISTED - 1
AIR = -1
_WORDS_OF_SHARES = BRICK * 2 // 8


class OwnerBricks(NamedTuple):
    """Bricks of 8 x 8 x 8 cells while parts are entered.

    Attributes:
        brick_at: (BX, BY, BZ) int32, the brick there; ``AIR``, or -2 - p if the brick lies wholly inside part p.
        cells: (N,) unsigned, owner + 1 of every cell, 0 for air, brick after brick.
        cell_words: The same memory as uint64.
        marks: (N,) uint16, the owner's share, and whether the cell is in the list of shared cells.
        mark_words: The same memory as uint64.
        shape: Cells of the grid.
    """

    brick_at: NDArray[np.int32]
    cells: NDArray[Any]
    cell_words: NDArray[np.uint64]
    marks: NDArray[np.uint16]
    mark_words: NDArray[np.uint64]
    shape: tuple[int, int, int]


class SharedRows(NamedTuple):
    """Room for the list of shared cells, a row for each cell and part.

    Attributes:
        ranks: (R,) int64, index of the cell in the grid.
        parts: (R,) int32.
        shares: (R,) uint16, in 2^-14.
    """

    ranks: NDArray[np.int64]
    parts: NDArray[np.int32]
    shares: NDArray[np.uint16]


class EnterScratch(NamedTuple):
    """Scratch for entering a part.

    Attributes:
        whole: (bricks of a stack + 1,) int32.
        own: (2, 8) as ``OwnerBricks.cells``: the part's cells of a column in a brick, as owners and as a mask.
        own_words: The same memory as uint64.
        held: (8,) uint16, their shares.
        held_words: The same memory as uint64.
    """

    whole: NDArray[np.int32]
    own: NDArray[Any]
    own_words: NDArray[np.uint64]
    held: NDArray[np.uint16]
    held_words: NDArray[np.uint64]


class PartRuns(NamedTuple):
    """The cells of one part, see ``PartVoxels``.

    Attributes:
        start: Cell of the grid at the lowest corner of its box.
        size: Cells of its box.
        columns: (size[0] * size[1], 2) int32.
        runs: (R, 3) int32.
        shares: (S,) uint16.
    """

    start: tuple[int, int, int]
    size: tuple[int, int, int]
    columns: NDArray[np.int32]
    runs: NDArray[np.int32]
    shares: NDArray[np.uint16]


class PartQueue(NamedTuple):
    """Parts of a batch, or repeats of them, in the order in which they are entered.

    Attributes:
        first_index: Index of the first part.
        stop: One past the last part to enter.
        low: (3,) int64 lattice cell of the grid's cell (0, 0, 0).
        places: (P,) int64, the part of the batch that each part is like.
        lows: (P, 3) int64 lattice cell of the lowest corner of each part's box.
        batch: The voxels of the parts.
    """

    first_index: int
    stop: int
    low: NDArray[np.int64]
    places: NDArray[np.int64]
    lows: NDArray[np.int64]
    batch: Batch


class _Alike(NamedTuple):
    """The columns i0..i1, j0..j1 of the grid, half-open, inside one stack of bricks; all have runs first..stop."""

    i0: int
    i1: int
    j0: int
    j1: int
    first: int
    stop: int


@inline_kernel
def _enter_cell(bricks: OwnerBricks, shared: SharedRows, at: int, rank: int, part: int, share: int, rows: int) -> int:
    """Enter one cell of a part; returns the number of rows of the list of shared cells."""
    cells, marks = bricks.cells, bricks.marks
    row_ranks, row_parts, row_shares = shared
    owner = int(np.int64(cells[at]))
    if owner == 0:
        cells[at] = part + 1
        marks[at] = share
        return rows
    mark = int(np.int64(marks[at]))
    held = mark & _SHARE
    if mark & _LISTED == 0:
        row_ranks[rows], row_parts[rows], row_shares[rows] = rank, owner - 1, held
        rows += 1
    row_ranks[rows], row_parts[rows], row_shares[rows] = rank, part, share
    rows += 1
    if share > held:
        cells[at] = part + 1
        held = share
    marks[at] = held | _LISTED
    return rows


@inline_kernel
def _open_brick(cells: NDArray[Any], marks: NDArray[np.uint16], brick: int, held: int) -> None:
    """Write out cell by cell a brick that was air, or wholly inside a part."""
    if held != AIR:
        for at in range(brick * BRICK**3, (brick + 1) * BRICK**3):
            cells[at] = -held - 1
            marks[at] = FULL


@inline_kernel
def _enter_alike(
    bricks: OwnerBricks,
    shared: SharedRows,
    scratch: EnterScratch,
    voxels: PartRuns,
    part: int,
    alike: _Alike,
    used: int,
    rows: int,
) -> tuple[int, int]:
    """Enter columns of a stack that all have the same runs; see ``enter``.

    The cells of a column in a brick are computed once, and entered as words where nobody has these cells yet.
    """
    index, cells, cell_words, marks, mark_words, shape = bricks
    whole, own, own_words, held, held_words = scratch
    runs, shares, floor = voxels.runs, voxels.shares, voxels.start[2]
    i0, i1, j0, j1, run, run_stop = alike
    bx, by, bz0 = i0 // BRICK, j0 // BRICK, floor // BRICK
    per_column = own_words.shape[1]
    n = run
    bottom = 0
    while n < run_stop:
        b = max(runs[n, 0] + floor, bottom) // BRICK
        bottom = b * BRICK
        if whole[b - bz0]:
            # One run fills it from bottom to top.
            bottom += BRICK
            if runs[n, 1] + floor <= bottom:
                n += 1
            continue
        # Compute the cells of a column in this brick: owner, mark and share.
        for w in range(per_column):
            own_words[0, w] = own_words[1, w] = NONE
        for w in range(_WORDS_OF_SHARES):
            held_words[w] = NONE
        lowest_k, highest_k = BRICK, 0
        while n < run_stop:
            first, stop = runs[n, 0] + floor, runs[n, 1] + floor
            low, high = max(first, bottom) - bottom, min(stop, bottom + BRICK) - bottom
            if low >= BRICK:
                break
            lowest_k, highest_k = min(lowest_k, low), high
            share_at = runs[n, 2]
            for k in range(low, high):
                own[0, k], own[1, k] = part + 1, -1
                held[k] = FULL if share_at < 0 else shares[share_at + k + bottom - first]
            if stop > bottom + BRICK:
                break
            n += 1
        bottom += BRICK
        # Open the brick if nobody has it yet, or if one part has all of it.
        brick = index[bx, by, b]
        fresh = brick == AIR
        if brick < 0:
            _open_brick(cells, marks, used, brick)
            brick = used
            index[bx, by, b] = brick
            used += 1
        for x in range(i0, i1):
            for y in range(j0, j1):
                column = (brick * BRICK + x % BRICK) * BRICK + y % BRICK
                # Where another part has a cell of the column, enter cell by cell; otherwise all at once.
                if not fresh:
                    taken = NONE
                    for w in range(per_column):
                        taken |= cell_words[column * per_column + w] & own_words[1, w]
                    if taken != NONE:
                        rank = (x * shape[1] + y) * shape[2] + b * BRICK
                        for k in range(lowest_k, highest_k):
                            if own[1, k] != 0:
                                share = int(np.int64(held[k]))
                                rows = _enter_cell(bricks, shared, column * BRICK + k, rank + k, part, share, rows)
                        continue
                for w in range(per_column):
                    cell_words[column * per_column + w] |= own_words[0, w]
                for w in range(_WORDS_OF_SHARES):
                    mark_words[column * _WORDS_OF_SHARES + w] |= held_words[w]
    return used, rows


@inline_kernel
def _same_runs(columns: NDArray[np.int32], column: int, other: int, count: int) -> bool:
    """Return whether ``count`` columns from ``column`` on have the same runs as those from ``other`` on."""
    same = True
    for n in range(count):
        same = same and columns[column + n, 0] == columns[other + n, 0]
        same = same and columns[column + n, 1] == columns[other + n, 1]
    return bool(same)


@leaf_kernel
def enter(
    bricks: OwnerBricks,
    shared: SharedRows,
    scratch: EnterScratch,
    voxels: PartRuns,
    part: int,
    first: int,
    used: int,
    rows: int,
) -> tuple[int, int, int]:
    """Enter one part, stack of bricks by stack of bricks, from stack ``first`` under its box on.

    Args:
        bricks: Changed in place.
        shared: Changed in place.
        scratch: Scratch.
        voxels: The part's cells.
        part: The part's index.
        first: First stack to enter.
        used: Bricks used so far.
        rows: Rows of shared cells so far.

    Returns:
        The stack to continue with when there is more room (the number of stacks if done), the bricks used and the rows
        used.
    """
    index, cells, shape, whole = bricks.brick_at, bricks.cells, bricks.shape, scratch.whole
    start, size, columns, runs, _ = voxels
    bx0, by0, bz0 = start[0] // BRICK, start[1] // BRICK, start[2] // BRICK
    nx = (start[0] + size[0] - 1) // BRICK - bx0 + 1
    ny = (start[1] + size[1] - 1) // BRICK - by0 + 1
    nz = (start[2] + size[2] - 1) // BRICK - bz0 + 1
    room = cells.size // BRICK**3
    # Whether any run can fill a brick from bottom to top.
    bulky = False
    for column in range(columns.shape[0]):
        if column == 0 or columns[column, 0] != columns[column - 1, 0]:
            for n in range(columns[column, 0], columns[column, 1]):
                bulky = bulky or (runs[n, 2] < 0 and runs[n, 1] - runs[n, 0] >= BRICK)
    for stack in range(first, nx * ny):
        bx, by = bx0 + stack // ny, by0 + stack % ny
        i0, i1 = max(bx * BRICK, start[0]), min(bx * BRICK + BRICK, start[0] + size[0])
        j0, j1 = max(by * BRICK, start[1]), min(by * BRICK + BRICK, start[1] + size[1])
        if used + nz > room or rows + 2 * (i1 - i0) * (j1 - j0) * size[2] > shared.ranks.size:
            return stack, used, rows
        # How many columns of the part fill each brick from bottom to top.
        for b in range(nz + 1):
            whole[b] = 0
        if bulky:
            corner = (i0 - start[0]) * size[1] + j0 - start[1]
            alike = _same_runs(columns, corner, corner + 1, j1 - j0 - 1)
            for x in range(1, i1 - i0):
                alike = alike and _same_runs(columns, corner, corner + x * size[1], j1 - j0)
            weight = (i1 - i0) * (j1 - j0) if alike else 1
            for x in range(i0, i0 + 1 if alike else i1):
                for y in range(j0, j0 + 1 if alike else j1):
                    column = (x - start[0]) * size[1] + y - start[1]
                    for n in range(columns[column, 0], columns[column, 1]):
                        if runs[n, 2] < 0:
                            low, high = runs[n, 0] + start[2], runs[n, 1] + start[2]
                            b0 = (low + BRICK - 1) // BRICK
                            b1 = (high + BRICK - 1 if high == shape[2] else high) // BRICK
                            if b0 < b1:
                                whole[b0 - bz0] += weight
                                whole[b1 - bz0] -= weight
            # A brick that the part fills, and that was air, is a single number in the index.
            in_grid = min(BRICK, shape[0] - bx * BRICK) * min(BRICK, shape[1] - by * BRICK)
            for b in range(1, nz):
                whole[b] += whole[b - 1]
            for b in range(nz):
                filled = whole[b] == in_grid and index[bx, by, bz0 + b] == AIR
                if filled:
                    index[bx, by, bz0 + b] = -part - 2
                whole[b] = int(filled)
        # Enter the rest, in rectangles of columns with the same runs.
        x = i0
        while x < i1:
            row = (x - start[0]) * size[1] - start[1]
            x1 = x + 1
            while x1 < i1 and _same_runs(columns, row + j0, row + j0 + (x1 - x) * size[1], j1 - j0):
                x1 += 1
            y = j0
            while y < j1:
                y1 = y + 1
                while y1 < j1 and _same_runs(columns, row + y, row + y1, 1):
                    y1 += 1
                alike_columns = _Alike(x, x1, y, y1, int(columns[row + y, 0]), int(columns[row + y, 1]))
                used, rows = _enter_alike(bricks, shared, scratch, voxels, part, alike_columns, used, rows)
                y = y1
            x = x1
    return nx * ny, used, rows


@kernel
def enter_batch(
    bricks: OwnerBricks,
    shared: SharedRows,
    scratch: EnterScratch,
    queue: PartQueue,
    part: int,
    stack: int,
    used: int,
    rows: int,
) -> tuple[int, int, int, int]:
    """Enter the parts ``part`` to ``queue.stop``, the first of them from ``stack`` on; see ``enter``.

    Returns the part and the stack to continue with when there is more room (``queue.stop`` if done), the bricks used
    and the rows used.
    """
    low, lows, batch = queue.low, queue.lows, queue.batch
    shapes, starts = batch.shapes, batch.column_starts
    while part < queue.stop:
        place = queue.places[part]
        if batch.counts[place] > 0:
            x, y, z = lows[part, 0] - low[0], lows[part, 1] - low[1], lows[part, 2] - low[2]
            a, b, c = shapes[place, 0], shapes[place, 1], shapes[place, 2]
            columns = batch.columns[starts[place] : starts[place + 1]]
            voxels = PartRuns((x, y, z), (a, b, c), columns, batch.runs, batch.shares)
            stacks = ((x + a - 1) // BRICK - x // BRICK + 1) * ((y + b - 1) // BRICK - y // BRICK + 1)
            index = queue.first_index + part
            stack, used, rows = enter(bricks, shared, scratch, voxels, index, stack, used, rows)
            if stack < stacks:
                return part, stack, used, rows
            stack = 0
        part += 1
    return queue.stop, 0, used, rows


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

    Returns the number of bricks in ``out``.
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
