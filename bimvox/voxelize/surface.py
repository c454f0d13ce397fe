"""Surface cells: every cell whose open box meets a triangle.

Triangle against box by the separating axis theorem with its 13 axes (Akenine-Möller 2001, "Fast 3D triangle-box overlap
testing"): three box normals, the triangle's normal, nine cross products of edges. All of them are linear in the cell's
indices, so the cells of a triangle are found as runs along z instead of being tested one by one (compare Schwarz and
Seidel 2010, "Fast parallel surface and solid voxelization on GPUs").

The box is the cell shrunk by the tolerance on every side. What then marks nothing because it lies wholly inside the
skin between two cells follows the half-open rule: it belongs to the cell above (to the right, behind), unless one of
the cells on either side of the border is in the part anyway, or the cell above is outside the part's range.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel

MET = 1
"""Bit of a cell that a triangle meets."""
INSIDE = 2
"""Bit of a cell that lies inside the solid."""
ON_BORDER = 4
"""Bit of a cell that is in the part by the half-open rule only."""

_FAR = 1.0e9
# Below this ratio of twice the area to the squared edge a normal is rounding noise: the triangle is its edges.
_FLAT = 1.0e-12


@kernel
def _open_run(slope: float, base: float, low: float, high: float) -> tuple[int, int]:
    """Return first and last integer k with ``low < slope * (k + 0.5) + base < high``; first > last if there is none."""
    if slope == 0.0:
        if low < base < high:
            return -int(_FAR), int(_FAR)
        return 1, 0
    start = (low - base) / slope
    stop = (high - base) / slope
    if start > stop:
        start, stop = stop, start
    start = min(max(start, -_FAR), _FAR)
    stop = min(max(stop, -_FAR), _FAR)
    return int(np.floor(start - 0.5)) + 1, int(np.ceil(stop - 0.5)) - 1


@kernel
def _edge_run(p: NDArray[np.float64], edge: int, across: int, along: int, at: float, half: float) -> tuple[int, int]:
    """Return the run of cells along ``along``, at ``at`` across, that one edge's axis does not separate.

    The axis is the edge turned by a quarter in the plane of the two coordinates, so it separates the 2-D projections.
    """
    first, second, third = edge, (edge + 1) % 3, (edge + 2) % 3
    e_along = p[second, along] - p[first, along]
    e_across = p[second, across] - p[first, across]
    if e_along == 0.0 and e_across == 0.0:
        return -int(_FAR), int(_FAR)
    # The coordinates are taken relative to the edge's first corner: the edge projects to 0, the third corner to `tip`.
    tip = e_along * (p[third, across] - p[first, across]) - e_across * (p[third, along] - p[first, along])
    radius = half * (abs(e_along) + abs(e_across))
    base = e_along * (at - p[first, across]) + e_across * p[first, along]
    return _open_run(-e_across, base, min(tip, 0.0) - radius, max(tip, 0.0) + radius)


@kernel
def _side(cell: int, plane: int, size: int) -> tuple[int, int]:
    """Return the half-open range of cells on both sides of a border, or the cell itself where there is no border."""
    if plane < 0:
        return cell, cell + 1
    return max(plane - 1, 0), min(plane + 1, size)


@kernel
def _beside_part(cells: NDArray[np.uint8], i: int, j: int, k: int, plane: NDArray[np.int64]) -> bool:
    """Say whether a cell on either side of the borders that a triangle lies in is in the part already."""
    i0, i1 = _side(i, plane[0], cells.shape[0])
    j0, j1 = _side(j, plane[1], cells.shape[1])
    k0, k1 = _side(k, plane[2], cells.shape[2])
    for x in range(i0, i1):
        for y in range(j0, j1):
            for z in range(k0, k1):
                if cells[x, y, z] & np.uint8(MET | INSIDE):
                    return True
    return False


@kernel
def _mark(
    cells: NDArray[np.uint8],
    p: NDArray[np.float64],
    tolerance: float,
    plane: NDArray[np.int64],
    runs: NDArray[np.int64],
    on_border: bool,
) -> None:
    """Mark the cells that one triangle meets; see ``mark_surface`` and ``mark_borders``."""
    first = np.empty(3, np.int64)
    last = np.empty(3, np.int64)
    for axis in range(3):
        low = min(p[0, axis], p[1, axis], p[2, axis])
        high = max(p[0, axis], p[1, axis], p[2, axis])
        first[axis] = max(int(np.floor(low + tolerance)), 0)
        last[axis] = min(int(np.ceil(high - tolerance)) - 1, cells.shape[axis] - 1)
        if first[axis] > last[axis]:
            return
    half = 0.5 - tolerance
    ux, uy, uz = p[1, 0] - p[0, 0], p[1, 1] - p[0, 1], p[1, 2] - p[0, 2]
    vx, vy, vz = p[2, 0] - p[0, 0], p[2, 1] - p[0, 1], p[2, 2] - p[0, 2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    reach = abs(nx) + abs(ny) + abs(nz)
    if reach <= _FLAT * (ux * ux + uy * uy + uz * uz + vx * vx + vy * vy + vz * vz):
        nx = ny = nz = reach = 0.0
    radius = half * reach
    has_plane = reach > 0.0
    for i in range(first[0], last[0] + 1):
        low, high = first[2], last[2]
        for edge in range(3):
            start, stop = _edge_run(p, edge, 0, 2, i + 0.5, half)
            low, high = max(low, start), min(high, stop)
        runs[i, 0], runs[i, 1] = low, high
    for j in range(first[1], last[1] + 1):
        low_x, high_x = first[0], last[0]
        low_z, high_z = first[2], last[2]
        for edge in range(3):
            start, stop = _edge_run(p, edge, 1, 0, j + 0.5, half)
            low_x, high_x = max(low_x, start), min(high_x, stop)
            start, stop = _edge_run(p, edge, 1, 2, j + 0.5, half)
            low_z, high_z = max(low_z, start), min(high_z, stop)
        if low_z > high_z:
            continue
        for i in range(low_x, high_x + 1):
            low, high = max(low_z, runs[i, 0]), min(high_z, runs[i, 1])
            if low <= high and has_plane:
                base = nx * (i + 0.5 - p[0, 0]) + ny * (j + 0.5 - p[0, 1]) - nz * p[0, 2]
                start, stop = _open_run(nz, base, -radius, radius)
                low, high = max(low, start), min(high, stop)
            for k in range(low, high + 1):
                if not on_border:
                    cells[i, j, k] |= np.uint8(MET)
                    continue
                if not _beside_part(cells, i, j, k, plane):
                    cells[i, j, k] |= np.uint8(ON_BORDER)


@kernel
def mark_surface(cells: NDArray[np.uint8], triangles: NDArray[np.float64], tolerance: float) -> None:
    """Set ``MET`` in every cell whose open box, shrunk by ``tolerance``, meets a triangle.

    Args:
        cells: (A, B, C) uint8 bits, changed in place.
        triangles: (F, 3, 3) float64, in cells, relative to the lowest corner of ``cells``.
        tolerance: In cells.
    """
    runs = np.empty((cells.shape[0], 2), np.int64)
    plane = np.full(3, -1, np.int64)
    for f in range(triangles.shape[0]):
        _mark(cells, triangles[f], tolerance, plane, runs, False)


@kernel
def mark_borders(
    cells: NDArray[np.uint8], triangles: NDArray[np.float64], tolerance: float, top: NDArray[np.int64]
) -> None:
    """Set ``ON_BORDER`` where a triangle lies wholly in the skin between cells and no cell beside it is in the part.

    Run it after ``MET`` and ``INSIDE`` are complete. The order of the triangles does not matter.

    Args:
        cells: (A, B, C) uint8 bits, changed in place.
        triangles: (F, 3, 3) float64, in cells, relative to the lowest corner of ``cells``.
        tolerance: In cells.
        top: (3,) int64, one past the highest cell of the part's range.
    """
    runs = np.empty((cells.shape[0], 2), np.int64)
    plane = np.empty(3, np.int64)
    p = np.empty((3, 3), np.float64)
    for f in range(triangles.shape[0]):
        any_axis = False
        for axis in range(3):
            a, b, c = triangles[f, 0, axis], triangles[f, 1, axis], triangles[f, 2, axis]
            border = np.rint(a)
            plane[axis] = -1
            p[0, axis], p[1, axis], p[2, axis] = a, b, c
            if abs(a - border) <= tolerance and abs(b - border) <= tolerance and abs(c - border) <= tolerance:
                any_axis = True
                plane[axis] = int(border)
                inside = border + 0.5 if border < top[axis] else border - 0.5
                p[0, axis] = p[1, axis] = p[2, axis] = inside
        if any_axis:
            _mark(cells, p, tolerance, plane, runs, True)
