"""The cells of a part as runs along z: what its surface meets, with shares, and what lies inside.

A run is a row ``first, stop, share``: the cells first <= k < stop of its column. ``share`` is the place in the list of
shares of the first of them, or -1 for cells that lie inside, which are full. A column is a row ``first, stop``, too: of
its runs. Columns side by side that are alike have the same runs.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import inline_kernel, kernel, leaf_kernel
from bimvox.voxelization.bits import EVERY, NONE, ONE, WORD, lowest, population, stretch
from bimvox.voxelization.sweep import FULL


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
def _alike(
    met: NDArray[np.uint64],
    inside: NDArray[np.uint64],
    border: NDArray[np.uint64],
    starts: NDArray[np.int64],
    i: int,
    j: int,
    x: int,
    y: int,
) -> bool:
    """Say whether two columns have the same cells, and their shares in one place."""
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
def write_runs(
    met: NDArray[np.uint64],
    inside: NDArray[np.uint64],
    border: NDArray[np.uint64],
    starts: NDArray[np.int64],
    shares: NDArray[np.uint16],
    border_share: int,
    low: NDArray[np.int64],
    high: NDArray[np.int64],
    column: int,
    columns: NDArray[np.int32],
    runs: NDArray[np.int32],
    kept: NDArray[np.uint16],
    sums: NDArray[np.int64],
) -> int:
    """Write the runs from number ``column`` on until there is no room; returns the first column not written.

    ``sums`` holds the runs, the shares and the cells so far. See ``runs_of``.
    """
    width = high[1] - low[1]
    w0, w1 = low[2] >> 6, (high[2] + WORD - 1) >> 6
    count, kept_count, total = sums[0], sums[1], sums[2]
    height = high[2] - low[2]
    # Cells of the column before.
    before = _cells_of(columns, runs, column - 1) if column > 0 else 0
    while column < columns.shape[0]:
        if count + height + 1 > runs.shape[0] or kept_count + height > kept.size:
            break
        i, j = low[0] + column // width, low[1] + column % width
        same = -1
        if j > low[1] and _alike(met, inside, border, starts, i, j, i, j - 1):
            same = column - 1
        elif i > low[0] and _alike(met, inside, border, starts, i, j, i - 1, j):
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
        for w in range(w0):
            share += population(met[i, j, w])
        for w in range(w0, w1):
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
                bit = lowest(left)
                on_surface = surface >> np.uint64(bit) & ONE != NONE
                rest = ~((surface if on_surface else solid) >> np.uint64(bit))
                length = min(lowest(rest) if rest != NONE else WORD, WORD - bit)
                left &= ~stretch(bit, bit + length)
                total += length
                # A run goes on over the border of words.
                joins = bit == 0 and count > first_run and runs[count - 1, 1] == base
                if joins and (runs[count - 1, 2] >= 0) == on_surface:
                    runs[count - 1, 1] += length
                else:
                    runs[count, 0], runs[count, 1] = base + bit, base + bit + length
                    runs[count, 2] = kept_count if on_surface else -1
                    count += 1
                if on_surface:
                    for k in range(bit, bit + length):
                        if met_here >> np.uint64(k) & ONE:
                            kept[kept_count] = shares[share]
                            share += 1
                        else:
                            kept[kept_count] = border_share
                        kept_count += 1
        before += total
        columns[column, 0], columns[column, 1] = first_run, count
        column += 1
    sums[0], sums[1], sums[2] = count, kept_count, total
    return column


@kernel
def longer_runs(runs: NDArray[np.int32], used: int, size: int) -> NDArray[np.int32]:
    """Return room for ``size`` runs that starts with the ``used`` ones of another array."""
    longer = np.empty((size, 3), np.int32)
    for n in range(used):
        longer[n, 0], longer[n, 1], longer[n, 2] = runs[n, 0], runs[n, 1], runs[n, 2]
    return longer


@kernel
def longer_shares(shares: NDArray[np.uint16], used: int, size: int) -> NDArray[np.uint16]:
    """Return room for ``size`` shares that starts with the ``used`` ones of another array."""
    longer = np.empty(size, np.uint16)
    for n in range(used):
        longer[n] = shares[n]
    return longer


@kernel
def runs_of(
    met: NDArray[np.uint64],
    inside: NDArray[np.uint64],
    border: NDArray[np.uint64],
    starts: NDArray[np.int64],
    shares: NDArray[np.uint16],
    border_share: int,
    low: NDArray[np.int64],
    high: NDArray[np.int64],
) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.uint16], int]:
    """Return the runs of the half-open box [low, high) of a part's cells.

    Args:
        met: (A, B, W) plane of bits: cells that the surface meets.
        inside: (A, B, W) plane of bits: other cells, inside the solid.
        border: (A, B, W) plane of bits: other cells, in the part by the half-open rule.
        starts: (A * B + 1,) int64 first share of each column.
        shares: (S,) uint16 share of every cell that is ``met``, in order.
        border_share: Share of cells of ``border``.
        low: (3,) int64.
        high: (3,) int64.

    Returns:
        (columns, 2) int32 first run of each column, and one past its last; (R, 3) int32 runs, (S,) uint16 shares, and
        the number of cells.
    """
    columns = np.empty((max(high[0] - low[0], 0) * max(high[1] - low[1], 0), 2), np.int32)
    height = high[2] - low[2]
    runs = np.empty((columns.shape[0] + height + 1, 3), np.int32)
    kept = np.empty(shares.size + height, np.uint16)
    sums = np.zeros(3, np.int64)
    column = 0
    while True:
        column = write_runs(
            met, inside, border, starts, shares, border_share, low, high, column, columns, runs, kept, sums
        )
        if column == columns.shape[0]:
            break
        runs = longer_runs(runs, sums[0], 2 * sums[0] + height + 1)
        kept = longer_shares(kept, sums[1], 2 * sums[1] + height)
    return columns, runs[: sums[0]], kept[: sums[1]], sums[2]


@kernel
def filled_of(columns: NDArray[np.int32], runs: NDArray[np.int32], shares: NDArray[np.uint16]) -> tuple[int, int]:
    """Return the number of cells inside, and the sum of the shares of the others."""
    full = total = 0
    for column in range(columns.shape[0]):
        for n in range(columns[column, 0], columns[column, 1]):
            size = runs[n, 1] - runs[n, 0]
            if runs[n, 2] < 0:
                full += size
            else:
                for k in range(size):
                    total += int(np.int64(shares[runs[n, 2] + k]))
    return full, total


@kernel
def dense_cells(shape: tuple[int, int, int], columns: NDArray[np.int32], runs: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Return the cells of runs as an array of booleans."""
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
    """Return the filled share of every cell of runs, 0..1."""
    fractions = np.zeros(shape, np.float32)
    for column in range(columns.shape[0]):
        i, j = column // shape[1], column % shape[1]
        for n in range(columns[column, 0], columns[column, 1]):
            for k in range(runs[n, 0], runs[n, 1]):
                share = FULL if runs[n, 2] < 0 else int(shares[runs[n, 2] + k - runs[n, 0]])
                fractions[i, j, k] = np.float32(share / FULL)
    return fractions


@kernel
def dense_shares(
    met: NDArray[np.uint64], inside: NDArray[np.uint64], height: int, shares: NDArray[np.uint16]
) -> NDArray[np.uint16]:
    """Return the share of every cell, in 2^-14, from the shares of the surface cells in order."""
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
