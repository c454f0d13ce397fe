"""Cells that belong to a part by the half-open rule only.

A sheet, or a plate thinner than twice the tolerance, can lie on a border between cells and reach more than the
tolerance into neither. It then belongs to the cell above (to the right, behind). The same holds where a sheet crosses
a border at such a small angle that it stays within the tolerance for half a cell or more.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.voxelization.bits import CellPlanes
from bimvox.voxelization.surface import mark_scratch, mark_triangle

# If a sheet rises by less than this many tolerances per cell, half a cell or more can lie within the tolerance.
_FLAT_RISE = 4.0


@leaf_kernel
def _clip(p: NDArray[np.float64], count: int, axis: int, bound: float, sign: float, out: NDArray[np.float64]) -> int:
    """Clip a convex polygon to ``sign * p[axis] <= sign * bound`` (Sutherland and Hodgman 1974); return its corners."""
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
    """Return the axis along which a triangle rises by less than ``rise`` per cell; -1 if there is none."""
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
def _cell_at(border: float, top: int) -> float:
    """Return the middle of the cell that owns what lies on a border."""
    return border + 0.5 if border < top else border - 0.5


@kernel
def mark_borders(cells: CellPlanes, triangles: NDArray[np.float64], tolerance: float, top: NDArray[np.int64]) -> None:
    """Mark where a triangle lies on a border, within the tolerance, and no cell next to it is in the part.

    The order of the triangles does not matter.

    Args:
        cells: ``border`` is changed in place; ``met`` and ``inside`` are complete.
        triangles: (F, 3, 3) float64, in cells, relative to the lowest corner of the planes.
        tolerance: In cells.
        top: (3,) int64, one past the highest cell of the part's range.
    """
    scratch = mark_scratch(cells.met)
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
                p[0, axis] = p[1, axis] = p[2, axis] = _cell_at(at, top[axis])
        if any_axis:
            mark_triangle(cells, p, tolerance, plane, scratch, True)
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
            for other in range(3):
                plane[other] = -1
            plane[axis] = border_at
            for n in range(1, corners - 1):
                for c in range(3):
                    p[0, c], p[1, c], p[2, c] = cut[0, c], cut[n, c], cut[n + 1, c]
                p[0, axis] = p[1, axis] = p[2, axis] = _cell_at(float(border_at), top[axis])
                mark_triangle(cells, p, tolerance, plane, scratch, True)
