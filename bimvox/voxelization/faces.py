"""What is known of each triangle before the vertical lines cross it: its plane, and what it is joined with.

Level triangles of one height share one name: floors and flanges are drawn as many triangles, and the cuts between them
do not matter. Two triangles that form a parallelogram which, seen from above, is a rectangle along the lattice are
marked as one rectangle, level or not.

Heights depend neither on the order of a triangle's corners nor on a quarter turn of the building about z.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import inline_kernel, kernel, leaf_kernel
from bimvox.voxelization.lattice import STEPS_PER_CELL
from bimvox.voxelization.samples import SAMPLES

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
def turns_left(p: NDArray[np.float64]) -> bool:
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
    if one < 0 or _missing_corner(q, x0, x1, y0, y1) != 3 - one or turns_left(p) != turns_left(q):
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
