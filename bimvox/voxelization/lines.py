"""Where the 16 vertical lines of each column cross the triangles, as one record per face and column.

A record holds one bit per line: which of the column's lines a face crosses, and whether they enter or leave the solid.
Heights follow from the face's plane when the column is swept (``columns.py``).

Ties are canonical. A triangle is cut by a scan line along y; an edge's crossing is computed from its endpoints in
sorted order, and both the rows and the runs are half-open. Two triangles that share an edge therefore get the same bits
for it, and a line crosses exactly one of them: a closed mesh closes on every line, whatever the rounding.

Level triangles of one height share one record in a column, and a rectangle is recorded as one face (``faces.py``).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import inline_kernel, leaf_kernel
from bimvox.voxelization.faces import RECTANGLE, Faces, turns_left
from bimvox.voxelization.samples import SAMPLES

LEAVES = SAMPLES
"""Bits 0 to 15 of a record's lines enter the solid going up, bits 16 to 31 leave it."""
ALL = (1 << SAMPLES) - 1
"""All lines of a column."""

# A level face is joined with one of the first records of a column, this many.
_RECORDS = 4


class Slab(NamedTuple):
    """Rows of columns that are swept together.

    Attributes:
        samples: (2, 16) float64, positions of the lines in the cell's square, x and y.
        sources: (A,) int32, for each row of the part the first row that is crossed in the same way: it has the records.
        plain: (2, B) bool, columns of the previous row (of this row, up to the current column) whose result the next
            column along x, or along y, may take over.
        first_row: First row of the slab.
        stop_row: One past the last row.
        width: Columns in a row, B.
    """

    samples: NDArray[np.float64]
    sources: NDArray[np.int32]
    plain: NDArray[np.bool_]
    first_row: int
    stop_row: int
    width: int


class Records(NamedTuple):
    """The records of a slab: a linked list for each column.

    Attributes:
        head: (columns,) int32, first record of each column, or -1.
        following: (R,) int32, next record of the column, or -1.
        face: (R,) int32, name of the face.
        mask: (R,) uint32, its lines.
    """

    head: NDArray[np.int32]
    following: NDArray[np.int32]
    face: NDArray[np.int32]
    mask: NDArray[np.uint32]


class CutScratch(NamedTuple):
    """Scratch for cutting a face into lines.

    Attributes:
        firsts: (16,) int32, first column that each line of a row crosses.
        lasts: (16,) int32, one past the last.
        bits: (16,) int32, bit of each line in a record.
        across: (B,) uint32, lines of each column within a rectangle's extent along y.
    """

    firsts: NDArray[np.int32]
    lasts: NDArray[np.int32]
    bits: NDArray[np.int32]
    across: NDArray[np.uint32]


@inline_kernel
def _add(records: Records, count: int, column: int, face: int, mask: int, level: bool) -> int:
    """Add a record to a column's list, or its lines to that face's record if level; returns the number of records."""
    head, following, record_face, record_mask = records
    first = head[column]
    if level:
        n = first
        for _ in range(_RECORDS):
            if n < 0:
                break
            if record_face[n] == face:
                held = int(np.int64(record_mask[n]))
                both = held | mask
                # Each line once, and all of them the same way.
                if held & mask == 0 and (both & ALL == 0 or both >> LEAVES == 0):
                    record_mask[n] = np.uint32(both)
                    return count
                break
            n = following[n]
    following[count] = first
    record_face[count] = np.int32(face)
    record_mask[count] = np.uint32(mask)
    head[column] = np.int32(count)
    return count + 1


@inline_kernel
def _record_triangle(
    faces: Faces,
    f: int,
    slab: Slab,
    row: int,
    stop_row: int,
    scratch: CutScratch,
    records: Records,
    count: int,
) -> tuple[int, int]:
    """Record which lines of the columns (row..stop_row, 0..width) triangle ``f`` crosses; see ``record_faces``.

    Returns:
        The row to continue with when there is more room (``stop_row`` if done), and the number of records.
    """
    samples, width = slab.samples, slab.width
    firsts, lasts, bits = scratch.firsts, scratch.lasts, scratch.bits
    name, level = int(faces.names[f]), faces.planes[f, 5] == faces.planes[f, 6]
    inverted = faces.inverted[f]
    p = faces.triangles[f]
    # Corners sorted by x: the long edge runs from a to c, the short ones from a to b and from b to c.
    a, b, c = 0, 1, 2
    if p[b, 0] < p[a, 0]:
        a, b = b, a
    if p[c, 0] < p[b, 0]:
        b, c = c, b
        if p[b, 0] < p[a, 0]:
            a, b = b, a
    ax, ay, bx, by, cx, cy = p[a, 0], p[a, 1], p[b, 0], p[b, 1], p[c, 0], p[c, 1]
    if ax == cx or (ay == by and ay == cy):
        return stop_row, count
    # Counter-clockwise seen from above, the edge towards larger x is below the edge back. The sign comes from that
    # order, not from the normal, so that slivers cannot get a different sign.
    long_is_below = ((a + 1) % 3 == c) != inverted
    long_slope = (cy - ay) / (cx - ax)
    left_slope = (by - ay) / (bx - ax) if bx > ax else 0.0
    right_slope = (cy - by) / (cx - bx) if cx > bx else 0.0
    end = float(width)
    room = records.following.size
    while row < stop_row and not (cx <= row or ax >= row + 1):
        for s in range(SAMPLES):
            x = row + samples[0, s]
            on_long = ay + (x - ax) * long_slope
            on_left = ay + (x - ax) * left_slope
            on_right = by + (x - bx) * right_slope
            on_short = on_left if x < bx else on_right
            below = on_long <= on_short
            start = np.ceil((on_long if below else on_short) - samples[1, s])
            stop = np.ceil((on_short if below else on_long) - samples[1, s])
            start = 0.0 if start < 0.0 else start
            stop = end if stop > end else stop
            missed = (x < ax) | (x >= cx) | (stop <= start)
            firsts[s] = np.int32(end if missed else start)
            lasts[s] = np.int32(0.0 if missed else stop)
            bits[s] = np.int32(s + LEAVES if below == long_is_below else s)
        first, last = np.int32(width), np.int32(0)
        first_all, last_all = np.int32(0), np.int32(width)
        for s in range(SAMPLES):
            first, last = min(first, firsts[s]), max(last, lasts[s])
            first_all, last_all = max(first_all, firsts[s]), min(last_all, lasts[s])
        if count + last - first > room:
            return row, count
        every = 0
        if first_all < last_all:
            for s in range(SAMPLES):
                every |= 1 << int(bits[s])
        base = (row - slab.first_row) * slab.width
        for j in range(first, last):
            mask = every
            if not first_all <= j < last_all:
                mask = 0
                for s in range(SAMPLES):
                    mask |= int(firsts[s] <= j < lasts[s]) << int(bits[s])
            if mask != 0:
                count = _add(records, count, base + j, name, mask, level)
        row += 1
    return stop_row, count


@inline_kernel
def _record_rectangle(
    faces: Faces,
    f: int,
    slab: Slab,
    row: int,
    stop_row: int,
    scratch: CutScratch,
    records: Records,
    count: int,
) -> tuple[int, int]:
    """Record which lines cross the rectangle of which triangle ``f`` is one half; see ``_record_triangle``.

    Finds the same lines as for the two triangles. Leaves out rows that are crossed like an earlier row, their source.
    """
    samples, sources, width, across = slab.samples, slab.sources, slab.width, scratch.across
    name, level = int(faces.names[f]), faces.planes[f, 5] == faces.planes[f, 6]
    p = faces.triangles[f]
    x0, x1 = min(p[0, 0], p[1, 0], p[2, 0]), max(p[0, 0], p[1, 0], p[2, 0])
    y0, y1 = min(p[0, 1], p[1, 1], p[2, 1]), max(p[0, 1], p[1, 1], p[2, 1])
    side = LEAVES if turns_left(p) != faces.inverted[f] else 0
    first, last = max(int(np.floor(max(y0, 0.0))), 0), min(int(np.floor(min(y1, float(width)))), width - 1)
    for j in range(first, last + 1):
        mask = ALL
        if y0 > j or y1 < j + 1:
            mask = 0
            for s in range(SAMPLES):
                mask |= int(np.ceil(y0 - samples[1, s]) <= j < np.ceil(y1 - samples[1, s])) << s
        across[j] = mask
    room = records.following.size
    while row < stop_row:
        if sources[row] != row:
            row += 1
            continue
        if count + last + 1 - first > room:
            return row, count
        along = ALL
        if x0 > row or x1 < row + 1:
            along = 0
            for s in range(SAMPLES):
                along |= int(x0 <= row + samples[0, s] < x1) << s
        base = (row - slab.first_row) * slab.width
        for j in range(first, last + 1):
            mask = along & int(np.int64(across[j]))
            if mask != 0:
                mask <<= side
                count = _add(records, count, base + j, name, mask, level)
        row += 1
    return stop_row, count


@leaf_kernel
def record_faces(
    faces: Faces,
    numbers: NDArray[np.int32],
    first: int,
    row: int,
    slab: Slab,
    scratch: CutScratch,
    records: Records,
    count: int,
) -> tuple[int, int, int]:
    """Record which lines of a slab the faces ``numbers`` cross.

    Args:
        faces: The part's triangles.
        numbers: (N,) int32 indices of triangles.
        first: The first of them to record.
        row: Its first row of columns; 0 to start at the first row of the slab.
        slab: The rows to sweep.
        scratch: Scratch.
        records: Room for records, changed in place.
        count: Records so far.

    Returns:
        Where to continue when there is more room: ``first`` (the length of ``numbers`` if done) and ``row``; and the
        number of records.
    """
    triangles, rows = faces.triangles, slab.sources.size
    for n in range(first, numbers.size):
        f = int(np.int64(numbers[n]))
        x_low = min(triangles[f, 0, 0], triangles[f, 1, 0], triangles[f, 2, 0])
        x_high = max(triangles[f, 0, 0], triangles[f, 1, 0], triangles[f, 2, 0])
        row = max(row, int(np.floor(max(x_low, 0.0))), slab.first_row)
        stop = min(int(np.floor(min(x_high, float(rows)))), slab.stop_row - 1) + 1
        if row < stop:
            if faces.kinds[f] == RECTANGLE:
                row, count = _record_rectangle(faces, f, slab, row, stop, scratch, records, count)
            else:
                row, count = _record_triangle(faces, f, slab, row, stop, scratch, records, count)
            if row < stop:
                return n, row, count
        row = 0
    return numbers.size, 0, count
