"""Where the 16 vertical lines of each column cross the planes of the triangles, as one record per face and column.

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

from bimvox.compiled import inline_kernel, kernel, leaf_kernel
from bimvox.voxelization.lattice import SAMPLES, STEPS_PER_CELL

# What is known of each triangle before the vertical lines cross it: its plane, and what it is joined with.
#
# Level triangles of one height share one name: floors and flanges are drawn as many triangles, and the cuts between
# them do not matter. Two triangles that form a parallelogram which, seen from above, is a rectangle along the lattice
# are marked as one rectangle, level or not.
#
# Heights depend neither on the order of a triangle's corners nor on a quarter turn of the building about z.

HEIGHT_BITS = 16
UNIT = 1 << HEIGHT_BITS
"""Heights are counted in 2^-16 of a cell."""

SLANTED, LEVEL, RECTANGLE, SKIPPED = 0, 1, 2, 3
"""Kinds of faces: slanted, level, the half of a rectangle that stands for both halves, the other half."""

# A level face is joined with the last heights, this many.
_HEIGHTS = 8
_EMPTY = -1
_MIX = np.uint64(0x9E3779B97F4A7C15)
_HIGH = np.uint64(33)


class Faces(NamedTuple):
    """The triangles of a part, and what is known of their planes.

    Attributes:
        triangles: (F, 3, 3) float64, in cells.
        inverted: (F,) bool, triangles whose orientation is reversed.
        planes: (F, 7) float64: dz/dx, dz/dy, a point x y z, lowest and highest z (only the last two if level).
        kinds: (F,) int8.
        names: (F,) int32 face that the records are kept under: for level faces the first one of that height.
    """

    triangles: NDArray[np.float64]
    inverted: NDArray[np.bool_]
    planes: NDArray[np.float64]
    kinds: NDArray[np.int8]
    names: NDArray[np.int32]


@inline_kernel
def _plane_of(p: NDArray[np.float64], plane: NDArray[np.float64]) -> None:
    """Write a triangle's plane: slopes dz/dx and dz/dy, a point, the lowest and highest z."""
    z0, z1, z2 = p[0, 2], p[1, 2], p[2, 2]
    plane[5] = min(z0, z1, z2)
    plane[6] = max(z0, z1, z2)
    # The point is chosen by height alone (the middle one, or the one not level with another), so that neither the
    # corners' order nor a turn about z changes a bit of the result.
    base = 0
    if z0 == z1:
        base = 2
    elif z1 == z2:
        base = 0
    elif z0 == z2 or (z0 < z1) == (z1 < z2):
        base = 1
    elif (z1 < z2) == (z2 < z0):
        base = 2
    second, third = (base + 1) % 3, (base + 2) % 3
    ux, uy, uz = p[second, 0] - p[base, 0], p[second, 1] - p[base, 1], p[second, 2] - p[base, 2]
    vx, vy, vz = p[third, 0] - p[base, 0], p[third, 1] - p[base, 1], p[third, 2] - p[base, 2]
    nz = ux * vy - uy * vx
    plane[0] = (uy * vz - uz * vy) / nz if nz != 0.0 else 0.0
    plane[1] = (uz * vx - ux * vz) / nz if nz != 0.0 else 0.0
    plane[2], plane[3], plane[4] = p[base, 0], p[base, 1], p[base, 2]


@inline_kernel
def _missing_corner(p: NDArray[np.float64], x0: float, x1: float, y0: float, y1: float) -> int:
    """Return the corner of a rectangle that a triangle lacks (bit 0: at x1, bit 1: at y1); -1 if it is not a half."""
    seen = 0
    for corner in range(3):
        x, y = p[corner, 0], p[corner, 1]
        if (x != x0 and x != x1) or (y != y0 and y != y1):
            return -1
        seen |= 1 << (int(x == x1) + 2 * int(y == y1))
    missing = 15 - seen
    if missing == 1:
        return 0
    if missing == 2:
        return 1
    if missing == 4:
        return 2
    return 3 if missing == 8 else -1


@inline_kernel
def _turns_left(p: NDArray[np.float64]) -> bool:
    """Return whether a triangle's corners run counter-clockwise, seen from above."""
    ux, uy = p[1, 0] - p[0, 0], p[1, 1] - p[0, 1]
    vx, vy = p[2, 0] - p[0, 0], p[2, 1] - p[0, 1]
    return bool(ux * vy > uy * vx)


@inline_kernel
def _is_rectangle(p: NDArray[np.float64], q: NDArray[np.float64]) -> bool:
    """Return whether two triangles form a parallelogram, facing one way, that is a rectangle seen from above."""
    x0, x1 = min(p[0, 0], p[1, 0], p[2, 0]), max(p[0, 0], p[1, 0], p[2, 0])
    y0, y1 = min(p[0, 1], p[1, 1], p[2, 1]), max(p[0, 1], p[1, 1], p[2, 1])
    if x0 == x1 or y0 == y1:
        return False
    one = _missing_corner(p, x0, x1, y0, y1)
    if one < 0 or _missing_corner(q, x0, x1, y0, y1) != 3 - one or _turns_left(p) != _turns_left(q):
        return False
    # Heights at the corners: in a parallelogram, opposite corners have the same sum (lattice coordinates are exact).
    z_0 = z_1 = z_2 = z_3 = 0.0
    level_with = True
    for corner in range(3):
        at = int(p[corner, 0] == x1) + 2 * int(p[corner, 1] == y1)
        z = p[corner, 2]
        z_0, z_1 = z if at == 0 else z_0, z if at == 1 else z_1
        z_2, z_3 = z if at == 2 else z_2, z if at == 3 else z_3
    for corner in range(3):
        at = int(q[corner, 0] == x1) + 2 * int(q[corner, 1] == y1)
        z = q[corner, 2]
        if at == one:
            z_0, z_1 = z if at == 0 else z_0, z if at == 1 else z_1
            z_2, z_3 = z if at == 2 else z_2, z if at == 3 else z_3
        else:
            held = z_0 if at == 0 else z_1 if at == 1 else z_2 if at == 2 else z_3
            level_with = level_with and held == z
    return level_with and z_0 + z_3 == z_1 + z_2


@inline_kernel
def _place_of(a: float, b: float, c: float) -> int:
    """Return a well spread number of 31 bits; equal numbers give equal ones."""
    key = np.uint64(np.int64(a * STEPS_PER_CELL)) * _MIX
    key = ((key ^ (key >> _HIGH)) + np.uint64(np.int64(b * STEPS_PER_CELL))) * _MIX
    key = ((key ^ (key >> _HIGH)) + np.uint64(np.int64(c * STEPS_PER_CELL))) * _MIX
    return int(np.int64(key >> _HIGH))


@leaf_kernel
def _read_planes(
    faces: Faces, known: NDArray[np.float64], known_names: NDArray[np.int32], table: NDArray[np.int32]
) -> None:
    """Fill ``planes``, ``kinds`` and ``names``; ``known`` and ``known_names`` are scratch.

    ``table`` is scratch, filled with -1: halves of rectangles by where they lie. Its size is a power of 2 and larger
    than the number of triangles.
    """
    triangles, inverted, planes, kinds, names = faces
    for n in range(_HEIGHTS):
        known[n] = np.nan
    oldest = 0
    for f in range(triangles.shape[0]):
        p = triangles[f]
        names[f] = f
        z = p[0, 2]
        if z != p[1, 2] or z != p[2, 2]:
            _plane_of(p, planes[f])
            kinds[f] = SLANTED
        else:
            for n in range(5):
                planes[f, n] = 0.0
            planes[f, 5] = planes[f, 6] = z
            kinds[f] = LEVEL
            found = -1
            for n in range(_HEIGHTS):
                if known[n] == z:
                    found = n
            if found >= 0:
                names[f] = known_names[found]
            else:
                known[oldest], known_names[oldest] = z, f
                oldest = (oldest + 1) % _HEIGHTS
        x0, x1 = min(p[0, 0], p[1, 0], p[2, 0]), max(p[0, 0], p[1, 0], p[2, 0])
        y0, y1 = min(p[0, 1], p[1, 1], p[2, 1]), max(p[0, 1], p[1, 1], p[2, 1])
        if x0 == x1 or y0 == y1 or _missing_corner(p, x0, x1, y0, y1) < 0:
            continue
        slot = _place_of(x0 + y1, x1 - y0, planes[f, 5]) & (table.size - 1)
        while table[slot] != _EMPTY:
            half = table[slot]
            if kinds[half] == kinds[f] and inverted[half] == inverted[f] and _is_rectangle(triangles[half], p):
                # The plane of the triangle whose point is higher, whichever comes first.
                kept, other = (f, half) if planes[f, 4] > planes[half, 4] else (half, f)
                kinds[kept], kinds[other] = RECTANGLE, SKIPPED
                break
            slot = (slot + 1) & (table.size - 1)
        if table[slot] == _EMPTY:
            table[slot] = f


@kernel
def faces_of(triangles: NDArray[np.float64], inverted: NDArray[np.bool_]) -> Faces:
    """Return what is known of each triangle's plane."""
    count = triangles.shape[0]
    faces = Faces(
        triangles, inverted, np.empty((count, 7), np.float64), np.empty(count, np.int8), np.empty(count, np.int32)
    )
    size = 4
    while size < 2 * count:
        size *= 2
    table = np.empty(size, np.int32)
    for n in range(size):
        table[n] = _EMPTY
    _read_planes(faces, np.empty(_HEIGHTS, np.float64), np.empty(_HEIGHTS, np.int32), table)
    return faces


@inline_kernel
def heights_of(
    plane: NDArray[np.float64],
    samples: NDArray[np.float64],
    i: int,
    j: int,
    top: int,
    heights: NDArray[np.float64],
) -> tuple[float, float, float]:
    """Write the heights where the lines of column (i, j) cross a plane, in whole 2^-16 of a cell, 0 to ``top``.

    Heights stay within the triangle, however steep it is, and within the grid, where parts are clipped.

    Returns the lowest, the highest, and their sum.
    """
    low = min(max(plane[5], 0.0), float(top)) * UNIT
    high = min(max(plane[6], 0.0), float(top)) * UNIT
    if low == high:
        low = np.rint(low)
        for s in range(SAMPLES):
            heights[s] = low
        return low, low, SAMPLES * low
    slope_x, slope_y, base = plane[0], plane[1], plane[4]
    x, y = i - plane[2], j - plane[3]
    for s in range(SAMPLES):
        z = (base - (slope_x * (x + samples[0, s]) + slope_y * (y + samples[1, s]))) * UNIT
        z = low if z < low else z
        heights[s] = np.rint(high if z > high else z)
    # Four at a time: these are whole numbers, so the order of sums does not matter.
    least_a, least_b, least_c, least_d = heights[0], heights[1], heights[2], heights[3]
    most_a, most_b, most_c, most_d = least_a, least_b, least_c, least_d
    sum_a, sum_b, sum_c, sum_d = least_a, least_b, least_c, least_d
    for s in range(4, SAMPLES, 4):
        a, b, c, d = heights[s], heights[s + 1], heights[s + 2], heights[s + 3]
        sum_a, sum_b, sum_c, sum_d = sum_a + a, sum_b + b, sum_c + c, sum_d + d
        least_a, most_a = a if a < least_a else least_a, a if a > most_a else most_a
        least_b, most_b = b if b < least_b else least_b, b if b > most_b else most_b
        least_c, most_c = c if c < least_c else least_c, c if c > most_c else most_c
        least_d, most_d = d if d < least_d else least_d, d if d > most_d else most_d
    least = min(min(least_a, least_b), min(least_c, least_d))
    most = max(max(most_a, most_b), max(most_c, most_d))
    return least, most, (sum_a + sum_b) + (sum_c + sum_d)


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
        # Of each sample line along the row: the columns in which it crosses the triangle.
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
        # The columns that any line crosses, and those that all cross: there the mask is the same.
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
    side = LEAVES if _turns_left(p) != faces.inverted[f] else 0
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
