"""Where the 16 vertical lines of each column cross the triangles, kept as one record per triangle and column.

A record says which of the column's lines a triangle crosses, and whether they enter or leave the solid there, as one
bit per line. Heights follow from the triangle's plane when the column is swept (``columns.py``).

Ties are canonical. A triangle is cut by a scan line along y; an edge's crossing is computed from its endpoints in
sorted order, and both the rows and the runs are half-open. Two triangles that share an edge therefore get the same bits
for it, and a line meets exactly one of them: a closed mesh closes on every line, whatever the rounding. Heights do not
depend on the order of a triangle's corners, nor on a quarter turn of the building about z.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import inline_kernel, kernel, leaf_kernel
from bimvox.voxelize.samples import SAMPLES

LEAVES = SAMPLES
"""Bits 0 to 15 of a record's lines say where the solid is entered going up, bits 16 to 31 where it is left."""
ALL = (1 << SAMPLES) - 1
"""All lines of a column."""
HEIGHT_BITS = 16
UNIT = 1 << HEIGHT_BITS
"""Heights are counted in 2^-16 of a cell."""


@leaf_kernel
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


@kernel
def planes_of(triangles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (F, 7) float64 planes: dz/dx, dz/dy, a point x y z, lowest and highest z."""
    planes = np.empty((triangles.shape[0], 7), np.float64)
    for f in range(triangles.shape[0]):
        _plane_of(triangles[f], planes[f])
    return planes


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
    least = most = total = heights[0]
    for s in range(1, SAMPLES):
        total += heights[s]
        least = heights[s] if heights[s] < least else least
        most = heights[s] if heights[s] > most else most
    return least, most, total


@leaf_kernel
def record_lines(
    triangles: NDArray[np.float64],
    f: int,
    inverted: bool,
    samples: NDArray[np.float64],
    i: int,
    width: int,
    spans: NDArray[np.int32],
    masks: NDArray[np.uint32],
) -> tuple[int, int]:
    """Find which lines of the columns (i, 0..width) a triangle crosses.

    Args:
        triangles: (F, 3, 3) float64.
        f: Number of the triangle.
        inverted: Whether it is to be read the other way round.
        samples: (2, 16) float64, positions of the lines in the cell's square, x and y.
        i: Row of columns.
        width: Columns in the row.
        spans: (3, 16) scratch: first and one past the last column of each line, and its bit.
        masks: (width,) uint32, written within the range returned.

    Returns:
        The half-open range of columns that may be crossed, possibly empty.
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
    if cx <= i or ax >= i + 1 or ax == cx or (ay == by and ay == cy):
        return 0, 0
    # Going round counter-clockwise seen from above, the edge that runs to larger x is below the one that runs back. The
    # sign comes from that order, not from the normal, so that slivers cannot get a sign of their own.
    long_is_below = ((a + 1) % 3 == c) != inverted
    long_slope = (cy - ay) / (cx - ax)
    left_slope = (by - ay) / (bx - ax) if bx > ax else 0.0
    right_slope = (cy - by) / (cx - bx) if cx > bx else 0.0
    end = float(width)
    for s in range(SAMPLES):
        x = i + samples[0, s]
        on_long = ay + (x - ax) * long_slope
        on_short = ay + (x - ax) * left_slope if x < bx else by + (x - bx) * right_slope
        below = on_long <= on_short
        start = np.ceil((on_long if below else on_short) - samples[1, s])
        stop = np.ceil((on_short if below else on_long) - samples[1, s])
        start = 0.0 if start < 0.0 else start
        stop = end if stop > end else stop
        missed = x < ax or x >= cx or stop <= start
        spans[0, s] = np.int32(end if missed else start)
        spans[1, s] = np.int32(0.0 if missed else stop)
        spans[2, s] = np.int32(1 << s + LEAVES if below == long_is_below else 1 << s)
    first, last = width, 0
    first_all, last_all = 0, width
    every = 0
    for s in range(SAMPLES):
        first, last = min(first, spans[0, s]), max(last, spans[1, s])
        first_all, last_all = max(first_all, spans[0, s]), min(last_all, spans[1, s])
        every |= spans[2, s]
    for j in range(first, last):
        mask = every
        if not first_all <= j < last_all:
            mask = 0
            for s in range(SAMPLES):
                mask |= spans[2, s] if spans[0, s] <= j < spans[1, s] else 0
        masks[j] = np.uint32(mask & 0xFFFFFFFF)
    return first, last
