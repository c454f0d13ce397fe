"""One column's crossings, put in order and turned into what each of its cells is filled.

Where the crossings are in order as they are and the lines are inside at most one shell at a time, which is nearly
always, the lines of a record are dealt with together. Else each line keeps its winding (``_cross_record``); where no
order is right for every line, each line sorts its crossings (``sweep_lines``).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import inline_kernel, kernel, leaf_kernel
from bimvox.voxelize.bits import NONE, ONE, WORD, lowest, stretch
from bimvox.voxelize.lines import ALL, HEIGHT_BITS, LEAVES, UNIT, heights_of
from bimvox.voxelize.samples import SAMPLES

FULL = 1 << 14
"""The share of a cell that is filled throughout; shares are counted in 2^-14 of a cell."""
FEW = 24
"""Up to so many records of a column are put in order as they are; more are swept line by line."""

# Faces that touch may be crossed in the wrong order by rounding: a winding that lasts no longer than this is not seen.
_NOISE = 4
# Of a share, in units of ``change`` when all lines close.
_STEP = SAMPLES * UNIT // FULL
_HALF_STEP = _STEP // 2


@inline_kernel
def _mask(masks: NDArray[np.uint32], n: int) -> int:
    """Return a record's lines as a whole number (Numba makes floats of mixed signs)."""
    return int(np.int64(masks[n]))


@leaf_kernel
def count_closing(masks: NDArray[np.uint32], count: int, winding: NDArray[np.int32]) -> tuple[int, int]:
    """Return how many lines of a column close, and which, a bit each."""
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
def _enter_change(z: int, lines: int, change: NDArray[np.int64], touched: NDArray[np.uint64]) -> None:
    """Enter that so many lines get in (or out, negative) at a height."""
    k = z >> HEIGHT_BITS
    above = z & (UNIT - 1)
    change[k] += lines * (UNIT - above)
    change[k + 1] += lines * above
    touched[k >> 6] |= ONE << np.uint64(k & 63)
    touched[(k + 1) >> 6] |= ONE << np.uint64((k + 1) & 63)


@inline_kernel
def _enter_lines(
    lines: int,
    sign: int,
    low: int,
    high: int,
    total: int,
    heights: NDArray[np.float64],
    change: NDArray[np.int64],
    touched: NDArray[np.uint64],
) -> None:
    """Enter that these lines, a bit each, get in (or out, sign -1) at their heights."""
    k = low >> HEIGHT_BITS
    if k != high >> HEIGHT_BITS:
        for s in range(SAMPLES):
            if lines >> s & 1:
                _enter_change(int(heights[s]), sign, change, touched)
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
    """Return the winding inside a column, 1 or -1, whose lines are inside at most one shell at a time; else 0.

    The records are in order. Lines that do not close give 0, too.
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


@leaf_kernel
def _cross_record(
    enters: int,
    leaves: int,
    heights: NDArray[np.float64],
    winding: NDArray[np.int32],
    since: NDArray[np.float64],
    sums: NDArray[np.int64],
    change: NDArray[np.int64],
    touched: NDArray[np.uint64],
) -> None:
    """Cross one triangle on every line of its record: keep the windings, and enter where lines get in or out."""
    for s in range(SAMPLES):
        if (enters | leaves) >> s & 1 == 0:
            continue
        before = int(winding[s])
        after = before + (enters >> s & 1) - (leaves >> s & 1)
        winding[s] = after
        if heights[s] - since[s] > _NOISE:
            sums[2], sums[3] = min(sums[2], before), max(sums[3], before)
        since[s] = heights[s]
        lines = int(after != 0) - int(before != 0)
        if lines != 0:
            _enter_change(int(heights[s]), lines, change, touched)


@inline_kernel
def _put_in_order(
    masks: NDArray[np.uint32], heights: NDArray[np.float64], spans: NDArray[np.int64], count: int
) -> bool:
    """Order the records of a column by height, entering before leaving; False if no order is right for every line.

    ``spans`` (count, 4) holds lowest and highest height, the record's number and the sum of its heights, and is what is
    ordered.
    """
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


@kernel
def sweep_lines(
    masks: NDArray[np.uint32],
    planes: NDArray[np.float64],
    count: int,
    used: int,
    samples: NDArray[np.float64],
    i: int,
    j: int,
    top: int,
    sums: NDArray[np.int64],
    change: NDArray[np.int64],
    touched: NDArray[np.uint64],
) -> None:
    """Sweep a column line by line, the crossings of each sorted by height, entering before leaving."""
    keys = np.empty((SAMPLES, count), np.int64)
    stored = np.zeros(SAMPLES, np.int64)
    heights = np.empty(SAMPLES, np.float64)
    for n in range(count):
        heights_of(planes[n], samples, i, j, top, heights)
        for s in range(SAMPLES):
            leaves = _mask(masks, n) >> (s + LEAVES) & 1
            if (_mask(masks, n) >> s & 1 | leaves) and used >> s & 1:
                key = int(heights[s]) << 1 | leaves
                at = stored[s]
                while at > 0 and keys[s, at - 1] > key:
                    keys[s, at] = keys[s, at - 1]
                    at -= 1
                keys[s, at] = key
                stored[s] += 1
    for s in range(SAMPLES):
        winding = since = 0
        for n in range(stored[s]):
            z = keys[s, n] >> 1
            before = winding
            winding += 1 - 2 * (keys[s, n] & 1)
            if z - since > _NOISE:
                sums[2], sums[3] = min(sums[2], before), max(sums[3], before)
            since = z
            lines = int(winding != 0) - int(before != 0)
            if lines != 0:
                _enter_change(z, lines, change, touched)


@inline_kernel
def fill_column(
    met: NDArray[np.uint64],
    inside: NDArray[np.uint64],
    i: int,
    j: int,
    top: int,
    change: NDArray[np.int64],
    touched: NDArray[np.uint64],
    closing: int,
    shares: NDArray[np.uint16],
    at: int,
) -> int:
    """Turn ``change`` into bits of ``inside`` and shares; ``change`` and ``touched`` are zero again afterwards."""
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
    # Of what ends on the very top, a rest went to the next cell.
    change[top] = change[top + 1] = 0
    touched[top >> 6] = touched[(top + 1) >> 6] = NONE
    return at


@leaf_kernel
def sweep_columns(
    met: NDArray[np.uint64],
    inside: NDArray[np.uint64],
    top: int,
    planes: NDArray[np.float64],
    samples: NDArray[np.float64],
    i_low: int,
    column: int,
    columns: int,
    head: NDArray[np.int32],
    following: NDArray[np.int32],
    record_face: NDArray[np.int32],
    record_mask: NDArray[np.uint32],
    masks: NDArray[np.uint32],
    heights: NDArray[np.float64],
    spans: NDArray[np.int64],
    winding: NDArray[np.int32],
    since: NDArray[np.float64],
    change: NDArray[np.int64],
    touched: NDArray[np.uint64],
    closed: NDArray[np.bool_],
    starts: NDArray[np.int64],
    shares: NDArray[np.uint16],
    sums: NDArray[np.int64],
) -> int:
    """Sweep the columns from ``column`` to ``columns``, counted from row ``i_low``.

    ``sums`` holds the number of shares so far, the lines that do not close, and the lowest and highest winding seen.

    Returns:
        The first column that has to be swept line by line, or ``columns``.
    """
    width = met.shape[1]
    while column < columns:
        i, j = i_low + column // width, column % width
        count = 0
        record = head[column]
        while record >= 0 and count < FEW:
            face = record_face[record]
            masks[count] = record_mask[record]
            low, high, total = heights_of(planes[face], samples, i, j, top, heights[count])
            spans[count, 0], spans[count, 1], spans[count, 2], spans[count, 3] = int(low), int(high), count, int(total)
            count += 1
            record = following[record]
        if record >= 0 or not _put_in_order(masks, heights, spans, count):
            return column
        starts[i * width + j] = sums[0]
        closing = SAMPLES
        turn = _orientation(masks, spans, count)
        if turn != 0:
            sums[2], sums[3] = min(sums[2], turn), max(sums[3], turn)
            for n in range(count):
                m = spans[n, 2]
                for side in range(2):
                    lines = _mask(masks, m) >> side * LEAVES & ALL
                    if lines != 0:
                        sign = turn * (1 - 2 * side)
                        _enter_lines(lines, sign, spans[n, 0], spans[n, 1], spans[n, 3], heights[m], change, touched)
        elif count > 0:
            closing, used = count_closing(masks, count, winding)
            sums[1] += SAMPLES - closing
            if 2 * closing < SAMPLES:
                closed[i, j] = False
            else:
                for s in range(SAMPLES):
                    since[s] = 0.0
                for n in range(count):
                    m = spans[n, 2]
                    enters, leaves = _mask(masks, m) & used, _mask(masks, m) >> LEAVES & used
                    _cross_record(enters, leaves, heights[m], winding, since, sums, change, touched)
        sums[0] = fill_column(met, inside, i, j, top, change, touched, closing, shares, sums[0])
        column += 1
    return columns
