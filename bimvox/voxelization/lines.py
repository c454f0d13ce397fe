"""Where the 16 vertical lines of each column cross the triangles, kept as one record per face and column.

A record says which of the column's lines a face crosses, and whether they enter or leave the solid there, as one bit
per line. Heights follow from the face's plane when the column is swept (``columns.py``).

Ties are canonical. A triangle is cut by a scan line along y; an edge's crossing is computed from its endpoints in
sorted order, and both the rows and the runs are half-open. Two triangles that share an edge therefore get the same bits
for it, and a line meets exactly one of them: a closed mesh closes on every line, whatever the rounding. Heights do not
depend on the order of a triangle's corners, nor on a quarter turn of the building about z.

Level triangles of one height share one record in a column: floors and flanges are drawn as many triangles, and where
the cut between two of them runs does not matter. Two that make up a parallelogram which is a rectangle along the
lattice, seen from above, are recorded as such, level or not.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import inline_kernel, kernel, leaf_kernel
from bimvox.voxelization.lattice import STEPS_PER_CELL
from bimvox.voxelization.samples import SAMPLES

LEAVES = SAMPLES
"""Bits 0 to 15 of a record's lines say where the solid is entered going up, bits 16 to 31 where it is left."""
ALL = (1 << SAMPLES) - 1
"""All lines of a column."""
HEIGHT_BITS = 16
UNIT = 1 << HEIGHT_BITS
"""Heights are counted in 2^-16 of a cell."""

SLANTED, LEVEL, RECTANGLE, SKIPPED = 0, 1, 2, 3
"""Kinds of faces: not level, a level triangle, the one triangle of a rectangle that stands for both, the other one."""

# Level faces are looked for among so many heights, and so many records of a column.
_HEIGHTS = 8
_RECORDS = 4
_EMPTY = -1
_MIX = np.uint64(0x9E3779B97F4A7C15)
_HIGH = np.uint64(33)


@inline_kernel
def _plane_of(p: NDArray[np.float64], plane: NDArray[np.float64]) -> None:
    """Write a triangle's plane: slopes dz/dx and dz/dy, a point, the lowest and highest z."""
    z0, z1, z2 = p[0, 2], p[1, 2], p[2, 2]
    plane[5] = min(z0, z1, z2)
    plane[6] = max(z0, z1, z2)
    # The point is chosen by height alone (the one of middle height, or the one that is not level with another), so
    # that neither the corners' order nor a turn about z changes a bit of the result.
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
    """Return which corner of a rectangle a triangle leaves out (bit 0: at x1, bit 1: at y1); -1 if it is not half."""
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
def turns_left(p: NDArray[np.float64]) -> bool:
    """Say whether a triangle's corners run counter-clockwise, seen from above."""
    ux, uy = p[1, 0] - p[0, 0], p[1, 1] - p[0, 1]
    vx, vy = p[2, 0] - p[0, 0], p[2, 1] - p[0, 1]
    return bool(ux * vy > uy * vx)


@inline_kernel
def _is_rectangle(p: NDArray[np.float64], q: NDArray[np.float64]) -> bool:
    """Say whether two triangles make up a parallelogram, facing one way, that is a rectangle seen from above."""
    x0, x1 = min(p[0, 0], p[1, 0], p[2, 0]), max(p[0, 0], p[1, 0], p[2, 0])
    y0, y1 = min(p[0, 1], p[1, 1], p[2, 1]), max(p[0, 1], p[1, 1], p[2, 1])
    if x0 == x1 or y0 == y1:
        return False
    one = _missing_corner(p, x0, x1, y0, y1)
    if one < 0 or _missing_corner(q, x0, x1, y0, y1) != 3 - one or turns_left(p) != turns_left(q):
        return False
    # Heights at the corners; what opposite corners sum up to tells a parallelogram (lattice coordinates are exact).
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
    triangles: NDArray[np.float64],
    inverted: NDArray[np.bool_],
    planes: NDArray[np.float64],
    kinds: NDArray[np.int8],
    names: NDArray[np.int32],
    known: NDArray[np.float64],
    known_names: NDArray[np.int32],
    table: NDArray[np.int32],
) -> None:
    """Fill the arrays that ``planes_of`` returns; ``known`` and its names are scratch.

    ``table`` is scratch, all empty: halves of rectangles by where they lie. Its size is a power of 2, and more than the
    number of triangles.
    """
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
                # The plane is that of the triangle whose point is the higher one, whichever comes first.
                stands, other = (f, half) if planes[f, 4] > planes[half, 4] else (half, f)
                kinds[stands], kinds[other] = RECTANGLE, SKIPPED
                break
            slot = (slot + 1) & (table.size - 1)
        if table[slot] == _EMPTY:
            table[slot] = f


@kernel
def planes_of(
    triangles: NDArray[np.float64], inverted: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], NDArray[np.int8], NDArray[np.int32]]:
    """Return what is known of each triangle's plane.

    Returns:
        (F, 7) float64 planes: dz/dx, dz/dy, a point x y z, lowest and highest z (of level triangles only the last two);
        (F,) int8 kinds; (F,) int32 the face that records are kept under: of level faces, the first of that height.
    """
    count = triangles.shape[0]
    planes = np.empty((count, 7), np.float64)
    kinds = np.empty(count, np.int8)
    names = np.empty(count, np.int32)
    size = 4
    while size < 2 * count:
        size *= 2
    table = np.full(size, _EMPTY, np.int32)
    _read_planes(
        triangles, inverted, planes, kinds, names, np.empty(_HEIGHTS, np.float64), np.empty(_HEIGHTS, np.int32), table
    )
    return planes, kinds, names


@inline_kernel
def heights_of(
    plane: NDArray[np.float64],
    samples: NDArray[np.float64],
    i: int,
    j: int,
    top: int,
    heights: NDArray[np.float64],
) -> tuple[float, float, float]:
    """Write the heights of the lines of column (i, j) on a triangle's plane, in whole 2^-16 of a cell, 0 to ``top``.

    Heights stay within the triangle, however steep, and within the grid, where parts are clipped.

    Returns:
        The lowest, the highest, and their sum.
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
    # Four at a time: whole numbers, so that the order of sums does not matter.
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


@inline_kernel
def _add(
    column: int,
    face: int,
    mask: int,
    level: bool,
    head: NDArray[np.int32],
    following: NDArray[np.int32],
    record_face: NDArray[np.int32],
    record_mask: NDArray[np.uint32],
    records: int,
) -> int:
    """Add a record to a column's list, or its lines to the one of that face; returns the number of records."""
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
                    return records
                break
            n = following[n]
    following[records] = first
    record_face[records] = np.int32(face)
    record_mask[records] = np.uint32(mask)
    head[column] = np.int32(records)
    return records + 1


@leaf_kernel
def record_triangle(
    triangles: NDArray[np.float64],
    f: int,
    name: int,
    level: bool,
    inverted: bool,
    samples: NDArray[np.float64],
    row: int,
    stop_row: int,
    i_low: int,
    width: int,
    firsts: NDArray[np.int32],
    lasts: NDArray[np.int32],
    bits: NDArray[np.int32],
    head: NDArray[np.int32],
    following: NDArray[np.int32],
    record_face: NDArray[np.int32],
    record_mask: NDArray[np.uint32],
    records: int,
) -> tuple[int, int]:
    """Record which lines of the columns (row..stop_row, 0..width) a triangle crosses.

    Args:
        triangles: (F, 3, 3) float64.
        f: Number of the triangle.
        name: The face that records are kept under.
        level: Whether records of that name may be joined.
        inverted: Whether it is to be read the other way round.
        samples: (2, 16) float64, positions of the lines in the cell's square, x and y.
        row: First row of columns.
        stop_row: One past the last row.
        i_low: Row of the first column in ``head``.
        width: Columns in a row.
        firsts: (16,) scratch: first column of each line.
        lasts: (16,) scratch: one past the last column.
        bits: (16,) scratch: a line's bit.
        head: First record of each column, or -1.
        following: Next record of each record, or -1.
        record_face: Name of each record's face.
        record_mask: Its lines.
        records: Records so far.

    Returns:
        The row to go on with when there is more room (``stop_row`` when all are done), and the number of records.
    """
    p = triangles[f]
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
        return stop_row, records
    # Going round counter-clockwise seen from above, the edge that runs to larger x is below the one that runs back. The
    # sign comes from that order, not from the normal, so that slivers cannot get a sign of their own.
    long_is_below = ((a + 1) % 3 == c) != inverted
    long_slope = (cy - ay) / (cx - ax)
    left_slope = (by - ay) / (bx - ax) if bx > ax else 0.0
    right_slope = (cy - by) / (cx - bx) if cx > bx else 0.0
    end = float(width)
    room = following.size
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
        if records + last - first > room:
            return row, records
        every = 0
        if first_all < last_all:
            for s in range(SAMPLES):
                every |= 1 << int(bits[s])
        base = (row - i_low) * width
        for j in range(first, last):
            mask = every
            if not first_all <= j < last_all:
                mask = 0
                for s in range(SAMPLES):
                    mask |= int(firsts[s] <= j < lasts[s]) << int(bits[s])
            if mask != 0:
                records = _add(base + j, name, mask, level, head, following, record_face, record_mask, records)
        row += 1
    return stop_row, records


@leaf_kernel
def record_rectangle(
    triangles: NDArray[np.float64],
    f: int,
    name: int,
    level: bool,
    inverted: bool,
    samples: NDArray[np.float64],
    sources: NDArray[np.int32],
    row: int,
    stop_row: int,
    i_low: int,
    width: int,
    across: NDArray[np.uint32],
    head: NDArray[np.int32],
    following: NDArray[np.int32],
    record_face: NDArray[np.int32],
    record_mask: NDArray[np.uint32],
    records: int,
) -> tuple[int, int]:
    """Record which lines the rectangle that triangle ``f`` is one half of crosses; see ``record_triangle``.

    ``across`` (width,) is scratch. The same lines are found as for its two triangles. Rows that are crossed as one
    before them, their source, are left out.
    """
    p = triangles[f]
    x0, x1 = min(p[0, 0], p[1, 0], p[2, 0]), max(p[0, 0], p[1, 0], p[2, 0])
    y0, y1 = min(p[0, 1], p[1, 1], p[2, 1]), max(p[0, 1], p[1, 1], p[2, 1])
    side = LEAVES if turns_left(p) != inverted else 0
    first, last = max(int(np.floor(max(y0, 0.0))), 0), min(int(np.floor(min(y1, float(width)))), width - 1)
    for j in range(first, last + 1):
        mask = ALL
        if y0 > j or y1 < j + 1:
            mask = 0
            for s in range(SAMPLES):
                mask |= int(np.ceil(y0 - samples[1, s]) <= j < np.ceil(y1 - samples[1, s])) << s
        across[j] = mask
    room = following.size
    while row < stop_row:
        if sources[row] != row:
            row += 1
            continue
        if records + last + 1 - first > room:
            return row, records
        along = ALL
        if x0 > row or x1 < row + 1:
            along = 0
            for s in range(SAMPLES):
                along |= int(x0 <= row + samples[0, s] < x1) << s
        base = (row - i_low) * width
        for j in range(first, last + 1):
            mask = along & int(np.int64(across[j]))
            if mask != 0:
                mask <<= side
                records = _add(base + j, name, mask, level, head, following, record_face, record_mask, records)
        row += 1
    return stop_row, records
