"""Surface cells: every cell whose open box meets a triangle.

Triangle against box by the separating axis theorem with its 13 axes (Akenine-Möller 2001, "Fast 3D triangle-box overlap
testing"): three box normals, the triangle's normal, nine cross products of edges. All of them are linear in the cell's
indices, so the cells of a triangle are found as runs along z instead of being tested one by one (compare Schwarz and
Seidel 2010, "Fast parallel surface and solid voxelization on GPUs").

The box is the cell shrunk by the tolerance on every side, so that faces lying on a cell border do not spill. What then
marks nothing because it lies in the skin between two cells follows the half-open rule: it belongs to the cell above (to
the right, behind), unless one of the cells on either side of the border is in the part anyway, or the cell above is
outside the part's range (``borders.py``).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import inline_kernel, kernel, leaf_kernel
from bimvox.voxelize.bits import NONE, ONE, WORD, has, set_run, stretch

_FAR = 1.0e9
# Below this ratio of twice the area to the squared edge a normal is rounding noise: the triangle is its edges.
_FLAT = 1.0e-12


@leaf_kernel
def _edge_terms(p: NDArray[np.float64], across: int, along: int, half: float, terms: NDArray[np.float64]) -> None:
    """Write, per edge, the bounds that its axis sets to cells along ``along``, linear in the place across.

    The axis is the edge turned by a quarter in the plane of the two coordinates, so it separates the 2-D projections:
    cells k with ``terms[0] + terms[2] * at < k + 0.5 < terms[1] + terms[2] * at``. Where the edge runs along
    ``along`` the axis only bounds the place across: ``terms[3] < at < terms[4]``.
    """
    for edge in range(3):
        second, third = (edge + 1) % 3, (edge + 2) % 3
        e_along = p[second, along] - p[edge, along]
        e_across = p[second, across] - p[edge, across]
        # Relative to the edge's first corner: the edge projects to 0, the third corner to `tip`.
        tip = e_along * (p[third, across] - p[edge, across]) - e_across * (p[third, along] - p[edge, along])
        radius = half * (abs(e_along) + abs(e_across))
        low, high = min(tip, 0.0) - radius, max(tip, 0.0) + radius
        terms[edge, 0], terms[edge, 1], terms[edge, 2] = -_FAR, _FAR, 0.0
        terms[edge, 3], terms[edge, 4] = -_FAR, _FAR
        if e_across != 0.0:
            slope = e_along / e_across
            first, last = -high / e_across, -low / e_across
            shift = p[edge, along] - slope * p[edge, across]
            terms[edge, 0] = min(first, last) + shift
            terms[edge, 1] = max(first, last) + shift
            terms[edge, 2] = slope
        elif e_along != 0.0:
            first, last = low / e_along, high / e_along
            terms[edge, 3] = min(first, last) + p[edge, across]
            terms[edge, 4] = max(first, last) + p[edge, across]


@inline_kernel
def _run_across(terms: NDArray[np.float64], at: float, first: int, last: int) -> tuple[int, int]:
    """Return the run of cells within first..last that no edge's axis separates, at ``at`` across."""
    low, high = first + 0.5, last + 0.5
    low_open = high_open = 0.0
    for edge in range(3):
        if not terms[edge, 3] < at < terms[edge, 4]:
            return 1, 0
        turned = terms[edge, 2] * at
        low_open = terms[edge, 0] + turned
        high_open = terms[edge, 1] + turned
        if low <= low_open:
            low = np.floor(low_open - 0.5) + 1.5
        if high >= high_open:
            high = np.ceil(high_open - 0.5) - 0.5
    if low > high:
        return 1, 0
    return int(low), int(high)


@inline_kernel
def _side(cell: int, plane: int, size: int) -> tuple[int, int]:
    """Return the half-open range of cells on both sides of a border, or the cell itself where there is no border."""
    if plane < 0:
        return cell, cell + 1
    return max(plane - 1, 0), min(plane + 1, size)


@inline_kernel
def _mark_beside(
    met: NDArray[np.uint64],
    inside: NDArray[np.uint64],
    border: NDArray[np.uint64],
    i: int,
    j: int,
    low: int,
    high: int,
    height: int,
    plane: NDArray[np.int64],
) -> None:
    """Mark the cells low..high of a column, but for those beside a cell that is in the part already."""
    i0, i1 = _side(i, plane[0], met.shape[0])
    j0, j1 = _side(j, plane[1], met.shape[1])
    if plane[2] >= 0:
        k0, k1 = _side(low, plane[2], height)
        for x in range(i0, i1):
            for y in range(j0, j1):
                for k in range(k0, k1):
                    if has(met, x, y, k) or has(inside, x, y, k):
                        return
        border[i, j, low >> 6] |= ONE << np.uint64(low & 63)
        return
    for w in range(low >> 6, (high >> 6) + 1):
        there = NONE
        for x in range(i0, i1):
            for y in range(j0, j1):
                there |= met[x, y, w] | inside[x, y, w]
        border[i, j, w] |= stretch(max(low - WORD * w, 0), min(high + 1 - WORD * w, WORD)) & ~there


@leaf_kernel
def mark_triangle(
    met: NDArray[np.uint64],
    inside: NDArray[np.uint64],
    border: NDArray[np.uint64],
    height: int,
    p: NDArray[np.float64],
    tolerance: float,
    plane: NDArray[np.int64],
    runs: NDArray[np.int64],
    terms: NDArray[np.float64],
    on_border: bool,
) -> None:
    """Mark the cells that one triangle meets; see ``mark_surface`` and ``borders.mark_borders``."""
    i0 = max(int(np.floor(min(p[0, 0], p[1, 0], p[2, 0]) + tolerance)), 0)
    i1 = min(int(np.ceil(max(p[0, 0], p[1, 0], p[2, 0]) - tolerance)) - 1, met.shape[0] - 1)
    j0 = max(int(np.floor(min(p[0, 1], p[1, 1], p[2, 1]) + tolerance)), 0)
    j1 = min(int(np.ceil(max(p[0, 1], p[1, 1], p[2, 1]) - tolerance)) - 1, met.shape[1] - 1)
    k0 = max(int(np.floor(min(p[0, 2], p[1, 2], p[2, 2]) + tolerance)), 0)
    k1 = min(int(np.ceil(max(p[0, 2], p[1, 2], p[2, 2]) - tolerance)) - 1, height - 1)
    if i0 > i1 or j0 > j1 or k0 > k1:
        return
    half = 0.5 - tolerance
    ux, uy, uz = p[1, 0] - p[0, 0], p[1, 1] - p[0, 1], p[1, 2] - p[0, 2]
    vx, vy, vz = p[2, 0] - p[0, 0], p[2, 1] - p[0, 1], p[2, 2] - p[0, 2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    radius = half * (abs(nx) + abs(ny) + abs(nz))
    flat = _FLAT * (ux * ux + uy * uy + uz * uz + vx * vx + vy * vy + vz * vz)
    has_plane = abs(nx) + abs(ny) + abs(nz) > flat
    slanted = has_plane and nz != 0.0
    over = 1.0 / nz if slanted else 0.0
    reach = abs(radius * over)
    _edge_terms(p, 0, 2, half, terms[0])
    _edge_terms(p, 1, 0, half, terms[1])
    _edge_terms(p, 1, 2, half, terms[2])
    for i in range(i0, i1 + 1):
        runs[i, 0], runs[i, 1] = _run_across(terms[0], i + 0.5, k0, k1)
    for j in range(j0, j1 + 1):
        low_x, high_x = _run_across(terms[1], j + 0.5, i0, i1)
        if low_x > high_x:
            continue
        low_z, high_z = _run_across(terms[2], j + 0.5, k0, k1)
        if low_z > high_z:
            continue
        for i in range(low_x, high_x + 1):
            low, high = max(low_z, runs[i, 0]), min(high_z, runs[i, 1])
            if low > high:
                continue
            if has_plane:
                base = nx * (i + 0.5 - p[0, 0]) + ny * (j + 0.5 - p[0, 1])
                if slanted:
                    middle = p[0, 2] - base * over - 0.5
                    low = max(low, int(np.floor(min(max(middle - reach, -1.0), _FAR))) + 1)
                    high = min(high, int(np.ceil(min(max(middle + reach, -1.0), _FAR))) - 1)
                elif not -radius < base < radius:
                    continue
            if low > high:
                continue
            if on_border:
                _mark_beside(met, inside, border, i, j, low, high, height, plane)
            else:
                set_run(met, i, j, low, high)


@kernel
def mark_surface(met: NDArray[np.uint64], height: int, triangles: NDArray[np.float64], tolerance: float) -> None:
    """Set the bit of every cell whose open box, shrunk by ``tolerance``, meets a triangle.

    Args:
        met: (A, B, W) plane of bits, changed in place.
        height: Cells of a column.
        triangles: (F, 3, 3) float64, in cells, relative to the lowest corner of the plane.
        tolerance: In cells.
    """
    runs = np.empty((met.shape[0], 2), np.int64)
    terms = np.empty((3, 3, 5), np.float64)
    plane = np.full(3, -1, np.int64)
    for f in range(triangles.shape[0]):
        mark_triangle(met, met, met, height, triangles[f], tolerance, plane, runs, terms, False)
