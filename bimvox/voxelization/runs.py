"""The cells of a part as runs along z, with shares, and the boxes that they make.

A run is a row ``first, stop, share``: the cells first <= k < stop of its column. ``share`` is the index of the first
cell's share, or -1 for cells inside the solid, which are full. A column is a row ``first, stop`` of its runs.
Neighbouring columns that are equal have the same runs.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import inline_kernel, kernel, leaf_kernel
from bimvox.voxelization.bits import EVERY, NONE, ONE, WORD, CellPlanes, lowest, population, stretch
from bimvox.voxelization.sweep import FULL


class FilledCells(NamedTuple):
    """The cells of a part and how much of each is filled, in 2^-14.

    Attributes:
        cells: Cells inside the solid are full.
        starts: (A * B + 1,) int64 first share of each column; equal columns may use the same shares.
        shares: (S,) uint16 share of every cell that the surface meets, in order.
        border_share: Share of the cells of ``cells.border``.
    """

    cells: CellPlanes
    starts: NDArray[np.int64]
    shares: NDArray[np.uint16]
    border_share: int


class Runs(NamedTuple):
    """Room for runs.

    Attributes:
        columns: (N, 2) int32 first run of each column, and one past its last.
        rows: (R, 3) int32 runs ``first, stop, share``.
        shares: (S,) uint16.
        sums: (3,) int64, used so far: runs, shares, cells.
    """

    columns: NDArray[np.int32]
    rows: NDArray[np.int32]
    shares: NDArray[np.uint16]
    sums: NDArray[np.int64]


@kernel
def share_starts(met: NDArray[np.uint64]) -> NDArray[np.int64]:
    """Return the number of surface cells before each column: (A * B + 1,) int64."""
    starts = np.zeros(met.shape[0] * met.shape[1] + 1, np.int64)
    count = 0
    for i in range(met.shape[0]):
        for j in range(met.shape[1]):
            for w in range(met.shape[2]):
                count += population(met[i, j, w])
            starts[i * met.shape[1] + j + 1] = count
    return starts


@inline_kernel
def _alike(filled: FilledCells, i: int, j: int, x: int, y: int) -> bool:
    """Return whether two columns have the same cells and use the same shares."""
    met, inside, border, starts = filled.cells.met, filled.cells.inside, filled.cells.border, filled.starts
    alike = starts[i * met.shape[1] + j] == starts[x * met.shape[1] + y]
    for w in range(met.shape[2]):
        alike = alike and met[i, j, w] == met[x, y, w] and inside[i, j, w] == inside[x, y, w]
        alike = alike and border[i, j, w] == border[x, y, w]
    return bool(alike)


@inline_kernel
def _cells_of(columns: NDArray[np.int32], runs: NDArray[np.int32], column: int) -> int:
    count = 0
    for n in range(columns[column, 0], columns[column, 1]):
        count += int(runs[n, 1]) - int(runs[n, 0])
    return count


@leaf_kernel
def write_runs(filled: FilledCells, low: NDArray[np.int64], high: NDArray[np.int64], column: int, room: Runs) -> int:
    """Write the runs of the box [low, high) from ``column`` on while there is room; see ``runs_of``.

    Returns the first column that is not written.
    """
    met, inside, border = filled.cells.met, filled.cells.inside, filled.cells.border
    starts, shares = filled.starts, filled.shares
    columns, runs, kept, sums = room.columns, room.rows, room.shares, room.sums
    width = high[1] - low[1]
    w0, w1 = low[2] >> 6, (high[2] + WORD - 1) >> 6
    count, kept_count, total = sums[0], sums[1], sums[2]
    height = high[2] - low[2]
    # Cells of the previous column.
    before = _cells_of(columns, runs, column - 1) if column > 0 else 0
    while column < columns.shape[0]:
        if count + height + 1 > runs.shape[0] or kept_count + height > kept.size:
            break
        i, j = low[0] + column // width, low[1] + column % width
        # A column with the same cells as a neighbour shares its runs.
        same = -1
        if j > low[1] and _alike(filled, i, j, i, j - 1):
            same = column - 1
        elif i > low[0] and _alike(filled, i, j, i - 1, j):
            same = column - width
        if same >= 0:
            columns[column, 0], columns[column, 1] = columns[same, 0], columns[same, 1]
            if same != column - 1:
                before = _cells_of(columns, runs, same)
            total += before
            column += 1
            continue
        before = -total
        first_run = count
        share = starts[i * met.shape[1] + j]
        # Skip the shares of cells below the box.
        for w in range(w0):
            share += population(met[i, j, w])
        for w in range(w0, w1):
            # The cells of a word within the box, on the surface and inside.
            met_here = met[i, j, w]
            surface, solid = met_here | border[i, j, w], inside[i, j, w]
            base = WORD * w - low[2]
            if base < 0:
                share += population(met_here & ~(EVERY << np.uint64(-base)))
            if base < 0 or base + WORD > height:
                window = stretch(max(-base, 0), min(height - base, WORD))
                surface, solid = surface & window, solid & window
            left = surface | solid
            while left != NONE:
                # The next stretch of one kind.
                bit = lowest(left)
                on_surface = surface >> np.uint64(bit) & ONE != NONE
                rest = ~((surface if on_surface else solid) >> np.uint64(bit))
                length = min(lowest(rest) if rest != NONE else WORD, WORD - bit)
                left &= ~stretch(bit, bit + length)
                total += length
                # A run continues across the border between words.
                joins = bit == 0 and count > first_run and runs[count - 1, 1] == base
                if joins and (runs[count - 1, 2] >= 0) == on_surface:
                    runs[count - 1, 1] += length
                else:
                    runs[count, 0], runs[count, 1] = base + bit, base + bit + length
                    runs[count, 2] = kept_count if on_surface else -1
                    count += 1
                # The share of each of its cells on the surface; a cell on the border has none of its own.
                if on_surface:
                    for k in range(bit, bit + length):
                        if met_here >> np.uint64(k) & ONE:
                            kept[kept_count] = shares[share]
                            share += 1
                        else:
                            kept[kept_count] = filled.border_share
                        kept_count += 1
        before += total
        columns[column, 0], columns[column, 1] = first_run, count
        column += 1
    sums[0], sums[1], sums[2] = count, kept_count, total
    return column


@kernel
def longer(room: Runs, height: int) -> Runs:
    """Return the same content with room for twice as much and one more column of ``height`` cells."""
    used, used_shares = room.sums[0], room.sums[1]
    rows = np.empty((2 * used + height + 1, 3), np.int32)
    for n in range(used):
        rows[n, 0], rows[n, 1], rows[n, 2] = room.rows[n, 0], room.rows[n, 1], room.rows[n, 2]
    shares = np.empty(2 * used_shares + height, np.uint16)
    for n in range(used_shares):
        shares[n] = room.shares[n]
    return Runs(room.columns, rows, shares, room.sums)


@kernel
def runs_of(
    filled: FilledCells, low: NDArray[np.int64], high: NDArray[np.int64]
) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.uint16], int]:
    """Return the runs of the half-open box [low, high) of a part's cells.

    Returns (columns, 2) int32 first run of each column, and one past its last; (R, 3) int32 runs; (S,) uint16 shares;
    the number of cells.
    """
    columns = np.empty((max(high[0] - low[0], 0) * max(high[1] - low[1], 0), 2), np.int32)
    height = high[2] - low[2]
    room = Runs(
        columns,
        np.empty((columns.shape[0] + height + 1, 3), np.int32),
        np.empty(filled.shares.size + height, np.uint16),
        np.zeros(3, np.int64),
    )
    column = 0
    while True:
        column = write_runs(filled, low, high, column, room)
        if column == columns.shape[0]:
            break
        room = longer(room, height)
    sums = room.sums
    return columns, room.rows[: sums[0]], room.shares[: sums[1]], sums[2]


@kernel
def dense_cells(shape: tuple[int, int, int], columns: NDArray[np.int32], runs: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Return the cells of runs as an (A, B, C) bool array."""
    cells = np.zeros(shape, np.bool_)
    for column in range(columns.shape[0]):
        for n in range(columns[column, 0], columns[column, 1]):
            for k in range(runs[n, 0], runs[n, 1]):
                cells[column // shape[1], column % shape[1], k] = True
    return cells


@kernel
def dense_fractions(
    shape: tuple[int, int, int], columns: NDArray[np.int32], runs: NDArray[np.int32], shares: NDArray[np.uint16]
) -> NDArray[np.float32]:
    """Return the filled share of every cell of runs, (A, B, C) float32, 0..1."""
    fractions = np.zeros(shape, np.float32)
    for column in range(columns.shape[0]):
        i, j = column // shape[1], column % shape[1]
        for n in range(columns[column, 0], columns[column, 1]):
            for k in range(runs[n, 0], runs[n, 1]):
                share = FULL if runs[n, 2] < 0 else int(shares[runs[n, 2] + k - runs[n, 0]])
                fractions[i, j, k] = np.float32(share / FULL)
    return fractions


@kernel
def dense_shares(cells: CellPlanes, shares: NDArray[np.uint16]) -> NDArray[np.uint16]:
    """Return the share of every cell, (A, B, C) uint16 in 2^-14, from the shares of the surface cells in order."""
    met, inside, height = cells.met, cells.inside, cells.height
    dense = np.zeros((met.shape[0], met.shape[1], height), np.uint16)
    at = 0
    for i in range(met.shape[0]):
        for j in range(met.shape[1]):
            for k in range(height):
                if met[i, j, k >> 6] >> np.uint64(k & 63) & ONE:
                    dense[i, j, k] = shares[at]
                    at += 1
                elif inside[i, j, k >> 6] >> np.uint64(k & 63) & ONE:
                    dense[i, j, k] = FULL
    return dense


# The boxes of a part, from its runs, without touching every cell.
#
# Most parts are cut as in ``bimvox.grid.summed_area.boxes_of``. That is slow for terrain and the like: parts of very
# many runs are cut into boxes of whole runs, in time proportional to the runs.

MANY_RUNS = 1 << 15
"""Parts with more runs are cut into boxes of whole runs."""


@leaf_kernel
def _has(heads: NDArray[np.int32], spans: NDArray[np.int32], column: int, first: int, stop: int) -> bool:
    """Return whether a column still has all the cells first <= k < stop."""
    span = heads[column]
    while span >= 0 and spans[span, 1] <= first:
        span = spans[span, 2]
    return bool(span >= 0 and spans[span, 0] <= first and stop <= spans[span, 1])


@leaf_kernel
def _take(heads: NDArray[np.int32], spans: NDArray[np.int32], column: int, first: int, stop: int, count: int) -> int:
    """Remove the cells first <= k < stop, which it has, from a column; return the number of spans."""
    before = -1
    span = heads[column]
    while spans[span, 1] <= first:
        before = span
        span = spans[span, 2]
    if spans[span, 0] < first:
        if stop < spans[span, 1]:
            spans[count, 0], spans[count, 1], spans[count, 2] = stop, spans[span, 1], spans[span, 2]
            spans[span, 2] = count
            count += 1
        spans[span, 1] = first
    elif stop < spans[span, 1]:
        spans[span, 0] = stop
    elif before < 0:
        heads[column] = spans[span, 2]
    else:
        spans[before, 2] = spans[span, 2]
    return count


@leaf_kernel
def _find(starts: NDArray[np.int32], spans: NDArray[np.int32], column: int, first: int, stop: int) -> int:
    """Return the unused span of a column that is exactly first <= k < stop; -1 if there is none."""
    for span in range(starts[column], starts[column + 1]):
        if spans[span, 0] == first and spans[span, 1] == stop and spans[span, 2] == 0:
            return span
    return -1


@kernel
def _count_runs(columns: NDArray[np.int32]) -> int:
    """Return the number of runs of all columns; a run that several columns have counts for each."""
    count = 0
    for column in range(columns.shape[0]):
        count += columns[column, 1] - columns[column, 0]
    return count


@kernel
def whole_run_boxes(columns: NDArray[np.int32], runs: NDArray[np.int32], rows: int, width: int) -> NDArray[np.int32]:
    """Cut a part into disjoint boxes of whole runs: equal runs side by side, first along y, then along x.

    Arguments and result as for ``greedy_boxes``.
    """
    starts = np.zeros(rows * width + 1, np.int32)
    # First, stop, whether the span is used.
    spans = np.zeros((_count_runs(columns), 3), np.int32)
    count = 0
    for column in range(rows * width):
        for n in range(columns[column, 0], columns[column, 1]):
            if n > columns[column, 0] and spans[count - 1, 1] == runs[n, 0]:
                spans[count - 1, 1] = runs[n, 1]
            else:
                spans[count, 0], spans[count, 1] = runs[n, 0], runs[n, 1]
                count += 1
        starts[column + 1] = count
    boxes = np.empty((count, 6), np.int32)
    found = 0
    for i in range(rows):
        for j in range(width):
            for span in range(starts[i * width + j], starts[i * width + j + 1]):
                if spans[span, 2]:
                    continue
                k, k1 = spans[span, 0], spans[span, 1]
                spans[span, 2] = 1
                j1 = j + 1
                while j1 < width:
                    same = _find(starts, spans, i * width + j1, k, k1)
                    if same < 0:
                        break
                    spans[same, 2] = 1
                    j1 += 1
                i1 = i + 1
                while i1 < rows:
                    y = j
                    while y < j1 and _find(starts, spans, i1 * width + y, k, k1) >= 0:
                        y += 1
                    if y < j1:
                        break
                    for y in range(j, j1):
                        spans[_find(starts, spans, i1 * width + y, k, k1), 2] = 1
                    i1 += 1
                boxes[found, 0], boxes[found, 1], boxes[found, 2] = i, j, k
                boxes[found, 3], boxes[found, 4], boxes[found, 5] = i1, j1, k1
                found += 1
    return boxes[:found].copy()


@kernel
def greedy_boxes(columns: NDArray[np.int32], runs: NDArray[np.int32], rows: int, width: int) -> NDArray[np.int32]:
    """Cut a part into disjoint boxes, greedily: grow along z, then x, then y from the first cell not yet covered.

    Arguments and result as for ``boxes_of_runs``.
    """
    heads = np.empty(rows * width, np.int32)
    for n in range(heads.size):
        heads[n] = -1
    # Spans of a column form a list: first, stop, next. Columns along x are adjacent in memory, as they are read.
    spans = np.empty((_count_runs(columns) + 64, 3), np.int32)
    count = 0
    for j in range(width):
        for i in range(rows):
            column = i * width + j
            for n in range(columns[column, 0], columns[column, 1]):
                if n > columns[column, 0] and spans[count - 1, 1] == runs[n, 0]:
                    spans[count - 1, 1] = runs[n, 1]
                    continue
                spans[count, 0], spans[count, 1], spans[count, 2] = runs[n, 0], runs[n, 1], -1
                if n == columns[column, 0]:
                    heads[j * rows + i] = count
                else:
                    spans[count - 1, 2] = count
                count += 1
    boxes = np.empty((64, 6), np.int32)
    found = 0
    for i in range(rows):
        for j in range(width):
            while heads[j * rows + i] >= 0:
                k, k1 = spans[heads[j * rows + i], 0], spans[heads[j * rows + i], 1]
                i1 = i + 1
                while i1 < rows and _has(heads, spans, j * rows + i1, k, k1):
                    i1 += 1
                j1 = j + 1
                while j1 < width:
                    x = i
                    while x < i1 and _has(heads, spans, j1 * rows + x, k, k1):
                        x += 1
                    if x < i1:
                        break
                    j1 += 1
                if count + (i1 - i) * (j1 - j) > spans.shape[0]:
                    more = np.empty((2 * (count + (i1 - i) * (j1 - j)), 3), np.int32)
                    for n in range(count):
                        more[n, 0], more[n, 1], more[n, 2] = spans[n, 0], spans[n, 1], spans[n, 2]
                    spans = more
                for x in range(i, i1):
                    for y in range(j, j1):
                        count = _take(heads, spans, y * rows + x, k, k1, count)
                if found == boxes.shape[0]:
                    longer = np.empty((2 * found, 6), np.int32)
                    for n in range(found):
                        for side in range(6):
                            longer[n, side] = boxes[n, side]
                    boxes = longer
                boxes[found, 0], boxes[found, 1], boxes[found, 2] = i, j, k
                boxes[found, 3], boxes[found, 4], boxes[found, 5] = i1, j1, k1
                found += 1
    return boxes[:found].copy()


@kernel
def boxes_of_runs(columns: NDArray[np.int32], runs: NDArray[np.int32], rows: int, width: int) -> NDArray[np.int32]:
    """Cut a part into disjoint boxes whose union is the part.

    Args:
        columns: (rows * width, 2) int32 first run of each column, and one past its last.
        runs: (R, 3) int32 runs, ascending in each column; runs that touch are joined.
        rows: Columns along x.
        width: Columns along y.

    Returns:
        (B, 6) int32 half-open boxes ``x0 y0 z0 x1 y1 z1``, in the part's own cells.
    """
    if _count_runs(columns) <= MANY_RUNS:
        return greedy_boxes(columns, runs, rows, width)
    return whole_run_boxes(columns, runs, rows, width)
