"""Cells that a part is in by the half-open rule only: what lies in the skin between two cells, and marks neither.

A sheet, or a plate thinner than twice the tolerance, can lie on a border between cells so that it reaches more than the
tolerance into none of them. It belongs to the cell above (to the right, behind) then. The same goes for the stretch of
a sheet that crosses a border at such a small angle that it stays in the skin for half a cell or more.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.voxelization.surface import mark_triangle

# Of a sheet that rises by less than this many tolerances a cell, half a cell or more can lie in the skin.
_FLAT_RISE = 4.0


@leaf_kernel
def _clip(p: NDArray[np.float64], count: int, axis: int, bound: float, sign: float, out: NDArray[np.float64]) -> int:
    """Cut a convex polygon to ``sign * p[axis] <= sign * bound`` (Sutherland and Hodgman 1974); returns its corners."""
    kept = 0
    for n in range(count):
        m = (n + 1) % count
        a, b = sign * (p[n, axis] - bound), sign * (p[m, axis] - bound)
        if a <= 0.0:
            for c in range(3):
                out[kept, c] = p[n, c]
            kept += 1
        if (a < 0.0 < b) or (b < 0.0 < a):
            share = a / (a - b)
            for c in range(3):
                out[kept, c] = p[n, c] + share * (p[m, c] - p[n, c])
            kept += 1
    return kept


@leaf_kernel
def _flat_axis(triangles: NDArray[np.float64], f: int, rise: float) -> int:
    """Return the axis along which a triangle rises by no more than ``rise`` a cell; -1 if there is none."""
    p = triangles[f]
    ux, uy, uz = p[1, 0] - p[0, 0], p[1, 1] - p[0, 1], p[1, 2] - p[0, 2]
    vx, vy, vz = p[2, 0] - p[0, 0], p[2, 1] - p[0, 1], p[2, 2] - p[0, 2]
    nx, ny, nz = abs(uy * vz - uz * vy), abs(uz * vx - ux * vz), abs(ux * vy - uy * vx)
    if max(ny, nz) < rise * nx:
        return 0
    if max(nz, nx) < rise * ny:
        return 1
    if max(nx, ny) < rise * nz:
        return 2
    return -1


@leaf_kernel
def _beside(border: float, top: int) -> float:
    """Return the middle of the cell that what lies on a border belongs to."""
    return border + 0.5 if border < top else border - 0.5


@kernel
def mark_borders(
    met: NDArray[np.uint64],
    inside: NDArray[np.uint64],
    border: NDArray[np.uint64],
    height: int,
    triangles: NDArray[np.float64],
    tolerance: float,
    top: NDArray[np.int64],
) -> None:
    """Mark where a triangle lies in the skin between cells and no cell beside it is in the part.

    The order of the triangles does not matter.

    Args:
        met: (A, B, W) plane of bits: cells that the surface meets, complete.
        inside: (A, B, W) plane of bits: cells inside the solid, complete.
        border: (A, B, W) plane of bits, changed in place.
        height: Cells of a column.
        triangles: (F, 3, 3) float64, in cells, relative to the lowest corner of the planes.
        tolerance: In cells.
        top: (3,) int64, one past the highest cell of the part's range.
    """
    runs = np.empty((6, max(met.shape[0], met.shape[1])), np.int32)
    terms = np.empty((3, 11), np.float64)
    plane = np.empty(3, np.int64)
    p = np.empty((3, 3), np.float64)
    half_cut = np.empty((8, 3), np.float64)
    cut = np.empty((8, 3), np.float64)
    for f in range(triangles.shape[0]):
        any_axis = False
        for axis in range(3):
            a, b, c = triangles[f, 0, axis], triangles[f, 1, axis], triangles[f, 2, axis]
            at = np.rint(a)
            plane[axis] = -1
            p[0, axis], p[1, axis], p[2, axis] = a, b, c
            if abs(a - at) <= tolerance and abs(b - at) <= tolerance and abs(c - at) <= tolerance:
                any_axis = True
                plane[axis] = int(at)
                p[0, axis] = p[1, axis] = p[2, axis] = _beside(at, top[axis])
        if any_axis:
            mark_triangle(met, inside, border, height, p, tolerance, plane, runs, terms, True)
            continue
        axis = _flat_axis(triangles, f, _FLAT_RISE * tolerance)
        if axis < 0:
            continue
        low = min(triangles[f, 0, axis], triangles[f, 1, axis], triangles[f, 2, axis])
        high = max(triangles[f, 0, axis], triangles[f, 1, axis], triangles[f, 2, axis])
        for border_at in range(int(np.ceil(low - tolerance)), int(np.floor(high + tolerance)) + 1):
            if border_at < 0 or border_at > top[axis]:
                continue
            corners = _clip(triangles[f], 3, axis, border_at + tolerance, 1.0, half_cut)
            corners = _clip(half_cut, corners, axis, border_at - tolerance, -1.0, cut)
            plane[:] = -1
            plane[axis] = border_at
            for n in range(1, corners - 1):
                for c in range(3):
                    p[0, c], p[1, c], p[2, c] = cut[0, c], cut[n, c], cut[n + 1, c]
                p[0, axis] = p[1, axis] = p[2, axis] = _beside(border_at, top[axis])
                mark_triangle(met, inside, border, height, p, tolerance, plane, runs, terms, True)
