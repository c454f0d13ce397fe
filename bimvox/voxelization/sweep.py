"""One column's crossings, sorted and turned into how much of each cell is filled.

Nearly always the records can be sorted as a whole and each line is inside at most one shell at a time: then the lines
of a record are handled together. Otherwise each line sorts its own crossings (``sweep_lines``).

If a column has the same crossings, at the same heights, and the same surface cells as its neighbour, it takes over the
neighbour's result: along floors, walls, beams and pipes nothing is computed twice.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import inline_kernel, leaf_kernel
from bimvox.voxelization.bits import NONE, ONE, WORD, CellPlanes, lowest, population, stretch
from bimvox.voxelization.lattice import SAMPLES
from bimvox.voxelization.lines import ALL, HEIGHT_BITS, LEAVES, UNIT, Faces, Records, Slab, heights_of

FULL = 1 << 14
"""The share of a full cell; shares are counted in 2^-14 of a cell."""
FEW = 48
"""Room for the records of a column; a column with more gets room of its own."""
# Up to this many records are sorted as a whole.
_ORDERED = 8

# By rounding, faces that touch may be crossed in the wrong order: a winding over a shorter height than this is ignored.
_NOISE = 4
# One share in units of ``change`` when all lines close.
_STEP = SAMPLES * UNIT // FULL
_HALF_STEP = _STEP // 2


class Changes(NamedTuple):
    """How many lines enter the solid (or leave it, negative) along a column; zeros between columns.

    Attributes:
        change: (C + 2,) int64, change of the filled height in each cell, in 2^-16 of a cell, summed over the lines.
        touched: (W,) uint64, bits of the cells whose ``change`` was written.
    """

    change: NDArray[np.int64]
    touched: NDArray[np.uint64]


class ColumnScratch(NamedTuple):
    """Scratch for one column with up to N records.

    Attributes:
        masks: (N,) uint32, lines of each record.
        heights: (N, 16) float64, heights of its lines in 2^-16 of a cell.
        spans: (N, 4) int64, lowest height, highest height, index and sum of heights of each record; these are sorted.
        keys: (16, N) int64, crossings of each line.
        stored: (16,) int64, number of crossings of each line.
        winding: (16,) int32.
        changes: Changes along the column.
    """

    masks: NDArray[np.uint32]
    heights: NDArray[np.float64]
    spans: NDArray[np.int64]
    keys: NDArray[np.int64]
    stored: NDArray[np.int64]
    winding: NDArray[np.int32]
    changes: Changes


class Found(NamedTuple):
    """What the sweep finds, besides the cells inside.

    Attributes:
        closed: (A, B) bool, False for columns of which most lines do not close.
        starts: (A * B + 1,) int64, first share of each column.
        shares: (S,) uint16, room for shares.
        sums: (4,) int64: shares so far, lines that do not close, lowest and highest winding.
        sharing: Whether equal neighbouring columns use the same shares.
    """

    closed: NDArray[np.bool_]
    starts: NDArray[np.int64]
    shares: NDArray[np.uint16]
    sums: NDArray[np.int64]
    sharing: bool


@inline_kernel
def _mask(masks: NDArray[np.uint32], n: int) -> int:
    """Return a record's lines as an int (numba turns mixed signs into floats)."""
    return int(np.int64(masks[n]))


@leaf_kernel
def count_closing(masks: NDArray[np.uint32], count: int, winding: NDArray[np.int32]) -> tuple[int, int]:
    """Return how many lines of a column close, and a bit for each that does."""
    for s in range(SAMPLES):
        winding[s] = 0
    for n in range(count):
        enters, leaves = np.int32(masks[n] & np.uint32(ALL)), np.int32(masks[n] >> np.uint32(LEAVES))
        for s in range(SAMPLES):
            winding[s] += np.int32(enters >> s & 1) - np.int32(leaves >> s & 1)
    closing = used = 0
    for s in range(SAMPLES):
        closes = int(winding[s] == 0)
        closing += closes
        used |= closes << s
        winding[s] = 0
    return closing, used


@inline_kernel
def _enter_change(z: int, lines: int, changes: Changes) -> None:
    """Record that ``lines`` lines enter the solid (or leave it, negative) at height ``z``."""
    change, touched = changes
    k = z >> HEIGHT_BITS
    above = z & (UNIT - 1)
    change[k] += lines * (UNIT - above)
    change[k + 1] += lines * above
    touched[k >> 6] |= ONE << np.uint64(k & 63)
    touched[(k + 1) >> 6] |= ONE << np.uint64((k + 1) & 63)


@inline_kernel
def _enter_lines(
    lines: int, sign: int, low: int, high: int, total: int, heights: NDArray[np.float64], changes: Changes
) -> None:
    """Record that these lines, a bit each, enter the solid (or leave it, sign -1) at their heights."""
    change, touched = changes
    k = low >> HEIGHT_BITS
    if k != high >> HEIGHT_BITS:
        for s in range(SAMPLES):
            if lines >> s & 1:
                _enter_change(int(heights[s]), sign, changes)
        return
    # All in one cell.
    count = SAMPLES
    if lines != ALL:
        count = 0
        some = 0.0
        for s in range(SAMPLES):
            crossed = lines >> s & 1
            count += crossed
            some += heights[s] if crossed else 0.0
        total = int(some)
    rest = total - (count * k << HEIGHT_BITS)
    change[k] += sign * ((count << HEIGHT_BITS) - rest)
    change[k + 1] += sign * rest
    touched[k >> 6] |= ONE << np.uint64(k & 63)
    touched[(k + 1) >> 6] |= ONE << np.uint64((k + 1) & 63)


@inline_kernel
def _orientation(masks: NDArray[np.uint32], spans: NDArray[np.int64], count: int) -> int:
    """Return the winding inside a column, 1 or -1; 0 if a line does not close or is inside two shells at once.

    The records are sorted.
    """
    if count == 0:
        return 0
    outward = _mask(masks, spans[0, 2]) & ALL != 0
    inside = 0
    for n in range(count):
        mask = _mask(masks, spans[n, 2])
        enters, leaves = mask & ALL, mask >> LEAVES
        if not outward:
            enters, leaves = leaves, enters
        if enters & leaves or enters & inside or leaves & ~inside:
            return 0
        inside = (inside | enters) & ~leaves
    if inside != 0:
        return 0
    return 1 if outward else -1


@inline_kernel
def _put_in_order(
    masks: NDArray[np.uint32], heights: NDArray[np.float64], spans: NDArray[np.int64], count: int
) -> bool:
    """Sort ``spans`` by height, entering before leaving; return False if no order is right for every line."""
    for n in range(1, count):
        low, high, record, total = spans[n, 0], spans[n, 1], spans[n, 2], spans[n, 3]
        rank = 2 * low + int(_mask(masks, record) >> LEAVES != 0)
        at = n
        while at > 0 and 2 * spans[at - 1, 0] + int(_mask(masks, spans[at - 1, 2]) >> LEAVES != 0) > rank:
            for field in range(4):
                spans[at, field] = spans[at - 1, field]
            at -= 1
        spans[at, 0], spans[at, 1], spans[at, 2], spans[at, 3] = low, high, record, total
    for n in range(1, count):
        above = spans[n, 2]
        lines = (_mask(masks, above) | _mask(masks, above) >> LEAVES) & ALL
        for m in range(n):
            if spans[m, 1] < spans[n, 0]:
                continue
            below = spans[m, 2]
            both = (_mask(masks, below) | _mask(masks, below) >> LEAVES) & lines
            if both == 0:
                continue
            crossed = _mask(masks, below) >> LEAVES & _mask(masks, above)
            for s in range(SAMPLES):
                if both >> s & 1 and heights[below, s] + (crossed >> s & 1) > heights[above, s]:
                    return False
    return True


@leaf_kernel
def sweep_lines(scratch: ColumnScratch, count: int, used: int, sums: NDArray[np.int64]) -> None:
    """Sweep the lines ``used`` of a column one by one, the crossings of each sorted by height, entering before leaving.

    Args:
        scratch: Holds the records; its changes are written.
        count: Number of records.
        used: A bit for each line.
        sums: See ``Found``.
    """
    masks, heights, keys, stored = scratch.masks, scratch.heights, scratch.keys, scratch.stored
    for s in range(SAMPLES):
        stored[s] = 0
    for n in range(count):
        leaving = _mask(masks, n) >> LEAVES
        lines = np.uint64((_mask(masks, n) | leaving) & used)
        while lines != NONE:
            s = lowest(lines)
            lines &= lines - ONE
            key = int(heights[n, s]) << 1 | (leaving >> s & 1)
            at = stored[s]
            while at > 0 and keys[s, at - 1] > key:
                keys[s, at] = keys[s, at - 1]
                at -= 1
            keys[s, at] = key
            stored[s] += 1
    least, most = sums[2], sums[3]
    for s in range(SAMPLES):
        winding = since = 0
        for n in range(stored[s]):
            z = keys[s, n] >> 1
            before = winding
            winding += 1 - 2 * (keys[s, n] & 1)
            if z - since > _NOISE:
                least, most = min(least, before), max(most, before)
            since = z
            lines_in = int(winding != 0) - int(before != 0)
            if lines_in != 0:
                _enter_change(z, lines_in, scratch.changes)
    sums[2], sums[3] = least, most


@inline_kernel
def fill_column(
    cells: CellPlanes, i: int, j: int, changes: Changes, closing: int, shares: NDArray[np.uint16], at: int
) -> int:
    """Turn changes into bits of ``inside`` and shares from ``at`` on; the changes are zero again afterwards.

    Returns one past the last share.
    """
    met, inside, top = cells.met, cells.inside, cells.height
    change, touched = changes
    whole = max(closing, 1) * UNIT
    run = 0
    for w in range(met.shape[2]):
        surface = met[i, j, w]
        events = surface | touched[w]
        if events == NONE and run == 0:
            continue
        filled = NONE
        start = 0
        while events != NONE:
            bit = lowest(events)
            events &= events - ONE
            if bit > start and 2 * run > whole:
                filled |= stretch(start, bit)
            run += change[WORD * w + bit]
            change[WORD * w + bit] = 0
            if surface >> np.uint64(bit) & ONE:
                shares[at] = (
                    (run + _HALF_STEP) // _STEP if closing == SAMPLES else (2 * run * FULL + whole) // (2 * whole)
                )
                at += 1
            elif 2 * run > whole:
                filled |= ONE << np.uint64(bit)
            start = bit + 1
        if start < WORD and 2 * run > whole:
            filled |= stretch(start, WORD)
        inside[i, j, w] = filled
        touched[w] = NONE
    # A crossing at the very top leaves a rest in the next cell.
    change[top] = change[top + 1] = 0
    touched[top >> 6] = touched[(top + 1) >> 6] = NONE
    return at


@inline_kernel
def _repeats(records: Records, column: int, other: int) -> bool:
    """Return whether two columns have the same records."""
    head, following, record_face, record_mask = records
    n, m = head[column], head[other]
    while n >= 0 and m >= 0:
        if record_face[n] != record_face[m] or record_mask[n] != record_mask[m]:
            return False
        n, m = following[n], following[m]
    return bool(n == m)


@inline_kernel
def _meets_the_same(met: NDArray[np.uint64], i: int, j: int, x: int, y: int) -> bool:
    """Return whether the surface meets the same cells of two columns."""
    same = True
    for w in range(met.shape[2]):
        same = same and met[i, j, w] == met[x, y, w]
    return bool(same)


@leaf_kernel
def sweep_columns(
    cells: CellPlanes,
    faces: Faces,
    slab: Slab,
    records: Records,
    column: int,
    scratch: ColumnScratch,
    found: Found,
) -> int:
    """Sweep the columns of a slab from ``column`` on.

    Returns the first column with too many records for the scratch; the number of columns if all are done.
    """
    met, inside, top = cells.met, cells.inside, cells.height
    planes, samples, sources, plain = faces.planes, slab.samples, slab.sources, slab.plain
    i_low, width = slab.first_row, slab.width
    columns = (slab.stop_row - i_low) * width
    head, following, record_face, record_mask = records
    masks, heights, spans, changes = scratch.masks, scratch.heights, scratch.spans, scratch.changes
    starts, shares, sums, sharing = found.starts, found.shares, found.sums, found.sharing
    if column >= columns:
        return columns
    i, j = i_low + column // width, column % width - 1
    while column < columns:
        j += 1
        if j == width:
            i, j = i + 1, 0
        # A column is the same as a neighbour if the same faces cross both and none of them slopes from one to the
        # other.
        at = (sources[i] - i_low) * width + j
        before = (sources[max(i - 1, 0)] - i_low) * width
        plain_x = plain_y = True
        x = y = -1
        if (
            plain[0, j]
            and (sources[i] != i or _repeats(records, at, before + j))
            and _meets_the_same(met, i, j, i - 1, j)
        ):
            x, y = i - 1, j
            plain_y = plain[1, j]
        elif j > 0 and plain[1, j - 1] and _meets_the_same(met, i, j, i, j - 1) and _repeats(records, at, at - 1):
            x, y = i, j - 1
            plain_x = plain[0, j - 1]
        if x >= 0:
            first = starts[x * width + y]
            starts[i * width + j] = first if sharing else sums[0]
            for w in range(met.shape[2]):
                inside[i, j, w] = inside[x, y, w]
                if not sharing:
                    more = population(met[i, j, w])
                    for n in range(more):
                        shares[sums[0] + n] = shares[first + n]
                    first += more
                    sums[0] += more
            plain[0, j], plain[1, j] = plain_x, plain_y
            column += 1
            continue
        # Collect its crossings, with the heights at which each line crosses.
        count = 0
        record = head[at]
        while record >= 0 and count < FEW:
            face = record_face[record]
            masks[count] = record_mask[record]
            low, high, total = heights_of(planes[face], samples, i, j, top, heights[count])
            # Both are 0 for level faces.
            plain_x, plain_y = plain_x and planes[face, 0] == 0.0, plain_y and planes[face, 1] == 0.0
            spans[count, 0], spans[count, 1], spans[count, 2], spans[count, 3] = int(low), int(high), count, int(total)
            count += 1
            record = following[record]
        if record >= 0:
            return column
        starts[i * width + j] = sums[0]
        # If the crossings have a clear order, no line is followed by itself; otherwise the lines that close are.
        closing = SAMPLES
        turn = 0
        if count <= _ORDERED and _put_in_order(masks, heights, spans, count):
            turn = _orientation(masks, spans, count)
        if turn != 0:
            sums[2], sums[3] = min(sums[2], turn), max(sums[3], turn)
            for n in range(count):
                m = spans[n, 2]
                for side in range(2):
                    lines = _mask(masks, m) >> side * LEAVES & ALL
                    if lines != 0:
                        sign = turn * (1 - 2 * side)
                        _enter_lines(lines, sign, spans[n, 0], spans[n, 1], spans[n, 3], heights[m], changes)
        elif count > 0:
            closing, used = count_closing(masks, count, scratch.winding)
            sums[1] += SAMPLES - closing
            if 2 * closing < SAMPLES:
                found.closed[i, j] = False
            else:
                sweep_lines(scratch, count, used, sums)
        # Fill the column from the changes along it.
        plain[0, j], plain[1, j] = plain_x and closing == SAMPLES, plain_y and closing == SAMPLES
        sums[0] = fill_column(cells, i, j, changes, closing, shares, sums[0])
        column += 1
    return columns
