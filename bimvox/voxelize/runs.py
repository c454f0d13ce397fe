"""The cells of a part as runs along z: what its surface meets, with shares, and what lies inside.

A run is a row ``first, stop, share``: the cells first <= k < stop of its column. ``share`` is the place in the list of
shares of the first of them, or -1 for cells that lie inside, which are full.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.voxelize.bits import EVERY, NONE, ONE, WORD, lowest, population, stretch
from bimvox.voxelize.sweep import FULL


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


@leaf_kernel
def _write_runs(
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

    ``sums`` holds the runs, the shares and the cells so far.
    """
    width = high[1] - low[1]
    w0, w1 = low[2] >> 6, (high[2] + WORD - 1) >> 6
    count, kept_count, total = sums[0], sums[1], sums[2]
    height = high[2] - low[2]
    while column < columns.size - 1:
        if count + height + 1 > runs.shape[0] or kept_count + height > kept.size:
            break
        i, j = low[0] + column // width, low[1] + column % width
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
        column += 1
        columns[column] = count
    sums[0], sums[1], sums[2] = count, kept_count, total
    return column


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
        (columns + 1,) int32 first run of each column, (R, 3) int32 runs, (S,) uint16 shares, and the number of cells.
    """
    columns = np.zeros((high[0] - low[0]) * (high[1] - low[1]) + 1, np.int32)
    height = high[2] - low[2]
    runs = np.empty((columns.size + height + 1, 3), np.int32)
    kept = np.empty(shares.size + height, np.uint16)
    sums = np.zeros(3, np.int64)
    column = 0
    while True:
        column = _write_runs(
            met, inside, border, starts, shares, border_share, low, high, column, columns, runs, kept, sums
        )
        if column == columns.size - 1:
            break
        longer_runs = np.empty((2 * sums[0] + height + 1, 3), np.int32)
        for n in range(sums[0]):
            longer_runs[n, 0], longer_runs[n, 1], longer_runs[n, 2] = runs[n, 0], runs[n, 1], runs[n, 2]
        runs = longer_runs
        longer = np.empty(2 * sums[1] + height, np.uint16)
        for n in range(sums[1]):
            longer[n] = kept[n]
        kept = longer
    return columns, runs[: sums[0]], kept[: sums[1]], sums[2]


@kernel
def dense_cells(shape: tuple[int, int, int], columns: NDArray[np.int32], runs: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Return the cells of runs as an array of booleans."""
    cells = np.zeros(shape, np.bool_)
    for column in range(columns.size - 1):
        for n in range(columns[column], columns[column + 1]):
            for k in range(runs[n, 0], runs[n, 1]):
                cells[column // shape[1], column % shape[1], k] = True
    return cells


@kernel
def dense_fractions(
    shape: tuple[int, int, int], columns: NDArray[np.int32], runs: NDArray[np.int32], shares: NDArray[np.uint16]
) -> NDArray[np.float32]:
    """Return the filled share of every cell of runs, 0..1."""
    fractions = np.zeros(shape, np.float32)
    for column in range(columns.size - 1):
        i, j = column // shape[1], column % shape[1]
        for n in range(columns[column], columns[column + 1]):
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
