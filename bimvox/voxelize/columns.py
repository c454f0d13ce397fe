"""The solid along columns: signed winding on 16 vertical lines a cell, exact along z.

Each line counts the triangles it crosses, +1 where it enters (a face looking down) and -1 where it leaves; it is inside
where the sum is not zero (so inverted shells count, overlapping shells count once, and cavities do not).

Ties are canonical: a triangle is cut by a horizontal scan line along y, an edge's crossing is computed from its
endpoints in sorted order, and both the rows and the runs are half-open. Two triangles that share an edge therefore get
the same bits for it, and a line meets exactly one of them: a closed mesh closes on every line, whatever the rounding.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.voxelize.samples import SAMPLES
from bimvox.voxelize.surface import INSIDE, MET

# A crossing is one int64: height (in 2^-16 of a cell), which line (or ``_MANY``), a bit per line, whether it leaves.
# Sorting the numbers sorts by height.
_HEIGHT_BITS = 16
_UNIT = 1 << _HEIGHT_BITS
_ALL = (1 << SAMPLES) - 1
_MANY = 16
_SHIFT = 22
HEIGHT_LIMIT = 1 << 23
"""Most cells along z that a crossing can tell apart."""

# Faces that touch may be crossed in the wrong order by rounding: a winding that lasts no longer than this is not seen.
_NOISE = 4
# Crossings held at once; larger parts are swept in blocks of columns.
_BLOCK = 1 << 22
# Up to here insertion is the fastest way to sort.
_FEW = 64


@kernel
def _cut(p: NDArray[np.float64], x: float) -> tuple[float, float, bool]:
    """Cut a triangle by the line at ``x``: start and stop in y, and whether it is left (else entered) going up."""
    start = stop = 0.0
    for edge in range(3):
        ax, ay = p[edge, 0], p[edge, 1]
        bx, by = p[(edge + 1) % 3, 0], p[(edge + 1) % 3, 1]
        if ax <= x < bx:
            start = ay + (x - ax) * (by - ay) / (bx - ax)
        elif bx <= x < ax:
            stop = by + (x - bx) * (ay - by) / (ax - bx)
    # Going round counter-clockwise seen from above, the edge that runs to larger x is below the one that runs back. The
    # sign comes from that order, not from the normal, so that slivers cannot get a sign of their own.
    if start <= stop:
        return start, stop, True
    return stop, start, False


@kernel
def _cross(
    p: NDArray[np.float64],
    inverted: bool,
    samples: NDArray[np.float64],
    i_low: int,
    i_high: int,
    shape: tuple[int, int, int],
    cursor: NDArray[np.int64],
    keys: NDArray[np.int64],
    count_only: bool,
    runs: NDArray[np.int64],
) -> None:
    """Count or store one triangle's crossings in the columns ``i_low <= i < i_high``; ``cursor`` is moved on."""
    x_low = min(p[0, 0], p[1, 0], p[2, 0])
    x_high = max(p[0, 0], p[1, 0], p[2, 0])
    if x_low >= i_high or x_high <= i_low:
        return
    ux, uy, uz = p[1, 0] - p[0, 0], p[1, 1] - p[0, 1], p[1, 2] - p[0, 2]
    vx, vy, vz = p[2, 0] - p[0, 0], p[2, 1] - p[0, 1], p[2, 2] - p[0, 2]
    nz = ux * vy - uy * vx
    slope_x = (uy * vz - uz * vy) / nz if nz != 0.0 else 0.0
    slope_y = (uz * vx - ux * vz) / nz if nz != 0.0 else 0.0
    # Heights stay within the triangle, however steep, and within the grid, where parts are clipped.
    z_low = min(max(min(p[0, 2], p[1, 2], p[2, 2]), 0.0), float(shape[2]))
    z_high = min(max(max(p[0, 2], p[1, 2], p[2, 2]), 0.0), float(shape[2]))
    level = p[0, 2] == p[1, 2] and p[0, 2] == p[2, 2]
    level_key = int(np.rint(z_low * _UNIT)) << _SHIFT
    for i in range(max(int(np.floor(x_low)) - 1, i_low), min(int(np.floor(x_high)) + 1, i_high)):
        # Every line has its own run of columns; a level triangle stores one crossing a column for all lines.
        first_any, last_any = shape[1], 0
        first_all, last_all = 0, shape[1]
        some_leave = some_enter = False
        for s in range(SAMPLES):
            x = i + samples[s, 0]
            start = stop = 0
            if x_low <= x < x_high:
                y0, y1, leaves = _cut(p, x)
                offset = samples[s, 1]
                start = int(min(max(np.ceil(y0 - offset), 0.0), float(shape[1])))
                stop = int(min(max(np.ceil(y1 - offset), 0.0), float(shape[1])))
                leaves = leaves != inverted
                if start < stop:
                    some_leave, some_enter = some_leave or leaves, some_enter or not leaves
                    first_any, last_any = min(first_any, start), max(last_any, stop)
                    if not level:
                        at = i * shape[1]
                        if count_only:
                            for j in range(start, stop):
                                cursor[at + j] += 1
                        else:
                            low_bits = (s << (SAMPLES + 1)) | (1 << (s + 1)) | int(leaves)
                            base = p[0, 2] - slope_x * (x - p[0, 0])
                            for j in range(start, stop):
                                z = base - slope_y * (j + offset - p[0, 1])
                                z = min(max(z, z_low), z_high)
                                keys[cursor[at + j]] = (int(np.rint(z * _UNIT)) << _SHIFT) | low_bits
                                cursor[at + j] += 1
            runs[s, 0], runs[s, 1] = start, stop
            first_all, last_all = max(first_all, start), min(last_all, stop)
        if not level:
            continue
        for leaves in (False, True):
            if not (some_leave if leaves else some_enter):
                continue
            one_way = not (some_leave and some_enter)
            for j in range(first_any, last_any):
                mask = _ALL
                if not (one_way and first_all <= j < last_all):
                    mask = 0
                    for s in range(SAMPLES):
                        # In slivers lines can disagree on the direction, by rounding.
                        if runs[s, 0] <= j < runs[s, 1] and (
                            one_way or (_cut(p, i + samples[s, 0])[2] != inverted) == leaves
                        ):
                            mask |= 1 << s
                if mask != 0:
                    at = i * shape[1] + j
                    if not count_only:
                        keys[cursor[at]] = level_key | (_MANY << (SAMPLES + 1)) | (mask << 1) | int(leaves)
                    cursor[at] += 1


@kernel
def _sort(keys: NDArray[np.int64], start: int, stop: int) -> None:
    """Sort a stretch of crossings in place."""
    if stop - start > _FEW:
        keys[start:stop].sort()
        return
    for n in range(start + 1, stop):
        key = keys[n]
        at = n
        while at > start and keys[at - 1] > key:
            keys[at] = keys[at - 1]
            at -= 1
        keys[at] = key


@kernel
def _sweep_together(
    keys: NDArray[np.int64], start: int, stop: int, change: NDArray[np.int64], extremes: NDArray[np.int64]
) -> int:
    """Sweep a column whose crossings all concern all lines; see ``_sweep``."""
    total = 0
    for n in range(start, stop):
        total += -1 if keys[n] & 1 else 1
    if total != 0:
        return 0
    winding = 0
    since = 0
    for n in range(start, stop):
        z = keys[n] >> _SHIFT
        before = winding
        winding += -1 if keys[n] & 1 else 1
        if z - since > _NOISE:
            extremes[0], extremes[1] = min(extremes[0], before), max(extremes[1], before)
        since = z
        lines = SAMPLES * (int(winding != 0) - int(before != 0))
        if lines != 0:
            k = z >> _HEIGHT_BITS
            above = z & (_UNIT - 1)
            change[k] += lines * (_UNIT - above)
            change[k + 1] += lines * above
    return SAMPLES


@kernel
def _sweep(
    keys: NDArray[np.int64],
    start: int,
    stop: int,
    change: NDArray[np.int64],
    winding: NDArray[np.int64],
    since: NDArray[np.int64],
    extremes: NDArray[np.int64],
) -> int:
    """Turn one column's sorted crossings into ``change``, whose running sum is what each cell is filled, in units.

    Returns:
        How many lines close. Only those are swept, and none when they are less than half.
    """
    together = True
    for n in range(start, stop):
        together = together and (keys[n] >> 1) & _ALL == _ALL
    if together:
        return int(_sweep_together(keys, start, stop, change, extremes))
    for s in range(SAMPLES):
        winding[s] = 0
        since[s] = 0
    for n in range(start, stop):
        key = keys[n]
        step = -1 if key & 1 else 1
        line = (key >> (SAMPLES + 1)) & 31
        if line < SAMPLES:
            winding[line] += step
        else:
            for s in range(SAMPLES):
                if key >> (s + 1) & 1:
                    winding[s] += step
    closing = 0
    used = 0
    for s in range(SAMPLES):
        if winding[s] == 0:
            closing += 1
            used |= 1 << s
        winding[s] = 0
    if 2 * closing < SAMPLES:
        return closing
    for n in range(start, stop):
        key = keys[n]
        step = -1 if key & 1 else 1
        z = key >> _SHIFT
        line = (key >> (SAMPLES + 1)) & 31
        mask = (key >> 1) & used
        lines = 0
        for s in range(line if line < SAMPLES else 0, line + 1 if line < SAMPLES else SAMPLES):
            if mask >> s & 1:
                before = winding[s]
                winding[s] = before + step
                lines += int(before + step != 0) - int(before != 0)
                if z - since[s] > _NOISE:
                    extremes[0], extremes[1] = min(extremes[0], before), max(extremes[1], before)
                since[s] = z
        if lines != 0:
            k = z >> _HEIGHT_BITS
            above = z & (_UNIT - 1)
            change[k] += lines * (_UNIT - above)
            change[k + 1] += lines * above
    return closing


@kernel
def fill_columns(
    cells: NDArray[np.uint8],
    fractions: NDArray[np.float32],
    triangles: NDArray[np.float64],
    inverted: NDArray[np.bool_],
    samples: NDArray[np.float64],
    closed: NDArray[np.bool_],
) -> tuple[int, int, int]:
    """Set ``INSIDE`` and the filled share of every cell, column by column.

    A cell that no triangle meets is all inside or all outside but for the tolerance's skin: it is inside when more than
    half of it is filled. The share of cells that are not in the part is 0.

    Args:
        cells: (A, B, C) uint8 bits; ``MET`` must be complete, ``INSIDE`` is added.
        fractions: (A, B, C) float32, zeros; filled share of the cell, 0..1.
        triangles: (F, 3, 3) float64, in cells, relative to the lowest corner of ``cells``.
        inverted: (F,) bool, triangles to be read the other way round.
        samples: (16, 2) float64, positions of the lines in the cell's square.
        closed: (A, B) bool, set False where most lines of the column do not close; such columns stay empty.

    Returns:
        The number of lines that do not close, and the lowest and highest winding seen.
    """
    shape = cells.shape
    counts = np.zeros(shape[0] * shape[1], np.int64)
    no_keys = np.empty(0, np.int64)
    runs = np.zeros((SAMPLES, 2), np.int64)
    for f in range(triangles.shape[0]):
        _cross(triangles[f], inverted[f], samples, 0, shape[0], shape, counts, no_keys, True, runs)
    change = np.zeros(shape[2] + 2, np.int64)
    winding = np.zeros(SAMPLES, np.int64)
    since = np.zeros(SAMPLES, np.int64)
    extremes = np.zeros(2, np.int64)
    leaks = 0
    i_low = 0
    while i_low < shape[0]:
        i_high = i_low
        stored = 0
        while i_high < shape[0]:
            more = counts[i_high * shape[1] : (i_high + 1) * shape[1]].sum()
            if i_high > i_low and stored + more > _BLOCK:
                break
            stored += more
            i_high += 1
        keys = np.empty(stored, np.int64)
        cursor = counts.copy()
        at = 0
        for column in range(i_low * shape[1], i_high * shape[1]):
            cursor[column] = at
            at += counts[column]
        for f in range(triangles.shape[0]):
            _cross(triangles[f], inverted[f], samples, i_low, i_high, shape, cursor, keys, False, runs)
        for i in range(i_low, i_high):
            for j in range(shape[1]):
                column = i * shape[1] + j
                if counts[column] == 0:
                    continue
                start, stop = cursor[column] - counts[column], cursor[column]
                _sort(keys, start, stop)
                k_low, k_high = keys[start] >> (_SHIFT + _HEIGHT_BITS), keys[stop - 1] >> (_SHIFT + _HEIGHT_BITS)
                closing = _sweep(keys, start, stop, change, winding, since, extremes)
                leaks += SAMPLES - closing
                if 2 * closing < SAMPLES:
                    closed[i, j] = False
                    continue
                whole = closing * _UNIT
                run = 0
                for k in range(k_low, min(k_high + 1, shape[2])):
                    run += change[k]
                    if cells[i, j, k] & np.uint8(MET):
                        fractions[i, j, k] = run / whole
                    elif 2 * run > whole:
                        cells[i, j, k] |= np.uint8(INSIDE)
                        fractions[i, j, k] = run / whole
                for k in range(k_low, k_high + 2):
                    change[k] = 0
        i_low = i_high
    return leaks, extremes[0], extremes[1]
