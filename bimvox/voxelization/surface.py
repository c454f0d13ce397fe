"""Surface cells: every cell whose open box meets a triangle.

Triangle against box by the separating axis theorem with its 13 axes (Akenine-Möller 2001, "Fast 3D triangle-box overlap
testing"): three box normals, the triangle's normal, nine cross products of edges. All are linear in the cell's
indices, so the cells of a triangle are found as runs along z instead of one by one (compare Schwarz and Seidel 2010,
"Fast parallel surface and solid voxelization on GPUs").

The box is the cell shrunk by the tolerance on every side, so that faces on a cell border do not spill over. What then
marks no cell, because it lies within the tolerance of a border, follows the half-open rule: it belongs to the cell
above (to the right, behind), unless a cell on either side of the border is in the part anyway, or the cell above is
outside the part's range (``borders.py``).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import inline_kernel, kernel, leaf_kernel
from bimvox.voxelization.bits import NONE, ONE, WORD, CellPlanes, has, set_run, stretch

_FAR = 1.0e9
# Below this ratio of twice the area to the squared edge a normal is rounding noise: the triangle is its edges.
_FLAT = 1.0e-12


class _MarkScratch(NamedTuple):
    """Scratch of ``_mark_triangle``.

    Attributes:
        runs: (6, max(A, B)) int32, first and last cell of the runs in the three projections.
        terms: (3, 11) float64, the bounds that the edges set in them, see ``_edge_terms``.
    """

    runs: NDArray[np.int32]
    terms: NDArray[np.float64]


@kernel
def _mark_scratch(plane: NDArray[np.uint64]) -> _MarkScratch:
    """Return the scratch for marking the cells of a plane of bits."""
    runs = np.empty((6, max(plane.shape[0], plane.shape[1])), np.int32)
    return _MarkScratch(runs, np.empty((3, 11), np.float64))


@inline_kernel
def _edge_terms(p: NDArray[np.float64], across: int, along: int, half: float, terms: NDArray[np.float64]) -> None:
    """Write the bounds that the edges set on cells along ``along``, linear in the position across.

    An edge's axis is the edge turned by a quarter in the plane of the two coordinates, so it separates the 2-D
    projections: cells k with ``terms[edge] + terms[edge + 6] * at < k + 0.5 < terms[edge + 3] + terms[edge + 6] * at``.
    An edge along ``along`` bounds only the position across: ``terms[9] < at < terms[10]``.
    """
    terms[9], terms[10] = -_FAR, _FAR
    for edge in range(3):
        second, third = (edge + 1) % 3, (edge + 2) % 3
        e_along = p[second, along] - p[edge, along]
        e_across = p[second, across] - p[edge, across]
        # Relative to the edge's first corner: the edge projects to 0, the third corner to `tip`.
        tip = e_along * (p[third, across] - p[edge, across]) - e_across * (p[third, along] - p[edge, along])
        radius = half * (abs(e_along) + abs(e_across))
        low, high = min(tip, 0.0) - radius, max(tip, 0.0) + radius
        terms[edge], terms[edge + 3], terms[edge + 6] = -_FAR, _FAR, 0.0
        if e_across != 0.0:
            slope = e_along / e_across
            first, last = -high / e_across, -low / e_across
            shift = p[edge, along] - slope * p[edge, across]
            terms[edge] = min(first, last) + shift
            terms[edge + 3] = max(first, last) + shift
            terms[edge + 6] = slope
        elif e_along != 0.0:
            first, last = low / e_along, high / e_along
            terms[9] = max(terms[9], min(first, last) + p[edge, across])
            terms[10] = min(terms[10], max(first, last) + p[edge, across])


@inline_kernel
def _runs_across(
    terms: NDArray[np.float64],
    place: int,
    stop: int,
    first: int,
    last: int,
    lows: NDArray[np.int32],
    highs: NDArray[np.int32],
) -> None:
    """Write, for each position place..stop, the run of cells within first..last that no edge's axis separates.

    Without branches, so that the compiler vectorizes it.
    """
    low_a, low_b, low_c = terms[0], terms[1], terms[2]
    high_a, high_b, high_c = terms[3], terms[4], terms[5]
    slope_a, slope_b, slope_c = terms[6], terms[7], terms[8]
    after, before = terms[9], terms[10]
    least, most = float(first), float(last)
    for n in range(place, stop):
        at = n + 0.5
        a, b, c = slope_a * at, slope_b * at, slope_c * at
        low, low_2, low_3 = low_a + a, low_b + b, low_c + c
        low = low if low > low_2 else low_2
        low = low if low > low_3 else low_3
        high, high_2, high_3 = high_a + a, high_b + b, high_c + c
        high = high if high < high_2 else high_2
        high = high if high < high_3 else high_3
        low, high = np.floor(low - 0.5) + 1.0, np.ceil(high - 0.5) - 1.0
        low = low if low > least else least
        high = high if high < most else most
        # An empty run: one past the last cell, or one before the first.
        low = low if low <= most else most + 1.0
        high = high if high >= least else least - 1.0
        high = high if (after < at) & (at < before) else least - 1.0
        lows[n] = np.int32(low)
        highs[n] = np.int32(high)


@inline_kernel
def _side(cell: int, plane: int, size: int) -> tuple[int, int]:
    """Return the half-open range of the cells on both sides of a border; the cell itself if there is no border."""
    if plane < 0:
        return cell, cell + 1
    return max(plane - 1, 0), min(plane + 1, size)


@inline_kernel
def _mark_unless_adjacent(cells: CellPlanes, i: int, j: int, low: int, high: int, plane: NDArray[np.int64]) -> None:
    """Mark the cells low..high of a column, except those next to a cell that is in the part already."""
    met, inside, border = cells.met, cells.inside, cells.border
    i0, i1 = _side(i, plane[0], met.shape[0])
    j0, j1 = _side(j, plane[1], met.shape[1])
    if plane[2] >= 0:
        k0, k1 = _side(low, plane[2], cells.height)
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
def _mark_triangle(
    cells: CellPlanes,
    p: NDArray[np.float64],
    tolerance: float,
    plane: NDArray[np.int64],
    scratch: _MarkScratch,
    on_border: bool,
) -> None:
    """Mark the cells that one triangle meets; see ``mark_surface`` and ``borders.mark_borders``.

    ``cells``: ``met`` is changed in place, or ``border`` if ``on_border``; ``p``: (3, 3) float64, the corners;
    ``plane``: (3,) int64, the border between cells that the triangle lies on, for each axis; -1 if it lies on none;
    ``scratch``: from ``_mark_scratch``; ``on_border``: whether to mark only cells on a border, with no cell of the part
    next to them.
    """
    met, inside, border, height = cells.met, cells.inside, cells.border, cells.height
    runs, terms = scratch.runs, scratch.terms
    # The box of cells around the triangle.
    i0 = max(int(np.floor(min(p[0, 0], p[1, 0], p[2, 0]) + tolerance)), 0)
    i1 = min(int(np.ceil(max(p[0, 0], p[1, 0], p[2, 0]) - tolerance)) - 1, met.shape[0] - 1)
    j0 = max(int(np.floor(min(p[0, 1], p[1, 1], p[2, 1]) + tolerance)), 0)
    j1 = min(int(np.ceil(max(p[0, 1], p[1, 1], p[2, 1]) - tolerance)) - 1, met.shape[1] - 1)
    k0 = max(int(np.floor(min(p[0, 2], p[1, 2], p[2, 2]) + tolerance)), 0)
    k1 = min(int(np.ceil(max(p[0, 2], p[1, 2], p[2, 2]) - tolerance)) - 1, height - 1)
    if i0 > i1 or j0 > j1 or k0 > k1:
        return
    half = 0.5 - tolerance
    # Most triangles of a building are perpendicular to an axis: then the bounds replace all tests but one.
    if p[0, 2] == p[1, 2] and p[0, 2] == p[2, 2]:
        _edge_terms(p, 1, 0, half, terms[1])
        _runs_across(terms[1], j0, j1 + 1, i0, i1, runs[2], runs[3])
        alone = on_border and plane[0] < 0 and plane[1] < 0
        for k in range(k0, k1 + 1):
            bit = ONE << np.uint64(k & 63)
            if alone:
                # As in _mark_unless_adjacent, for the border below or above only.
                first, stop = _side(k, plane[2], height)
                for j in range(j0, j1 + 1):
                    for i in range(runs[2, j], runs[3, j] + 1):
                        taken = NONE
                        for n in range(first, stop):
                            taken |= (met[i, j, n >> 6] | inside[i, j, n >> 6]) >> np.uint64(n & 63)
                        if taken & ONE == NONE:
                            border[i, j, k >> 6] |= bit
                continue
            for j in range(j0, j1 + 1):
                for i in range(runs[2, j], runs[3, j] + 1):
                    if on_border:
                        _mark_unless_adjacent(cells, i, j, k, k, plane)
                    else:
                        met[i, j, k >> 6] |= bit
        return
    # Perpendicular to x: the runs along z of each column follow from its outline across y.
    if p[0, 0] == p[1, 0] and p[0, 0] == p[2, 0]:
        _edge_terms(p, 1, 2, half, terms[2])
        _runs_across(terms[2], j0, j1 + 1, k0, k1, runs[4], runs[5])
        for i in range(i0, i1 + 1):
            for j in range(j0, j1 + 1):
                if runs[4, j] <= runs[5, j]:
                    if on_border:
                        _mark_unless_adjacent(cells, i, j, int(np.int64(runs[4, j])), int(np.int64(runs[5, j])), plane)
                    else:
                        set_run(met, i, j, int(np.int64(runs[4, j])), int(np.int64(runs[5, j])))
        return
    _edge_terms(p, 0, 2, half, terms[0])
    _runs_across(terms[0], i0, i1 + 1, k0, k1, runs[0], runs[1])
    # Perpendicular to y.
    if p[0, 1] == p[1, 1] and p[0, 1] == p[2, 1]:
        for i in range(i0, i1 + 1):
            for j in range(j0, j1 + 1):
                if runs[0, i] <= runs[1, i]:
                    if on_border:
                        _mark_unless_adjacent(cells, i, j, int(np.int64(runs[0, i])), int(np.int64(runs[1, i])), plane)
                    else:
                        set_run(met, i, j, int(np.int64(runs[0, i])), int(np.int64(runs[1, i])))
        return
    _edge_terms(p, 1, 0, half, terms[1])
    _edge_terms(p, 1, 2, half, terms[2])
    _runs_across(terms[1], j0, j1 + 1, i0, i1, runs[2], runs[3])
    _runs_across(terms[2], j0, j1 + 1, k0, k1, runs[4], runs[5])
    # Oblique: a cell is met if its outlines across all three axes and its distance from the plane say so.
    ux, uy, uz = p[1, 0] - p[0, 0], p[1, 1] - p[0, 1], p[1, 2] - p[0, 2]
    vx, vy, vz = p[2, 0] - p[0, 0], p[2, 1] - p[0, 1], p[2, 2] - p[0, 2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    radius = half * (abs(nx) + abs(ny) + abs(nz))
    flat = _FLAT * (ux * ux + uy * uy + uz * uz + vx * vx + vy * vy + vz * vz)
    has_plane = abs(nx) + abs(ny) + abs(nz) > flat
    slanted = has_plane and nz != 0.0
    over = 1.0 / nz if slanted else 0.0
    reach = abs(radius * over)
    px, py, pz = p[0, 0], p[0, 1], p[0, 2]
    for j in range(j0, j1 + 1):
        low_z, high_z = int(np.int64(runs[4, j])), int(np.int64(runs[5, j]))
        if low_z > high_z:
            continue
        for i in range(runs[2, j], runs[3, j] + 1):
            # The run that both outlines along z allow, then cut by the plane.
            low, high = max(low_z, int(np.int64(runs[0, i]))), min(high_z, int(np.int64(runs[1, i])))
            if low > high:
                continue
            if has_plane:
                base = nx * (i + 0.5 - px) + ny * (j + 0.5 - py)
                if slanted:
                    middle = pz - base * over - 0.5
                    low = max(low, int(np.floor(min(max(middle - reach, -1.0), _FAR))) + 1)
                    high = min(high, int(np.ceil(min(max(middle + reach, -1.0), _FAR))) - 1)
                elif not -radius < base < radius:
                    continue
            if low > high:
                continue
            if on_border:
                _mark_unless_adjacent(cells, i, j, low, high, plane)
            else:
                set_run(met, i, j, low, high)


@leaf_kernel
def _mark_triangles(
    cells: CellPlanes,
    triangles: NDArray[np.float64],
    tolerance: float,
    plane: NDArray[np.int64],
    scratch: _MarkScratch,
) -> None:
    for f in range(triangles.shape[0]):
        _mark_triangle(cells, triangles[f], tolerance, plane, scratch, False)


@kernel
def mark_surface(cells: CellPlanes, triangles: NDArray[np.float64], tolerance: float) -> None:
    """Set the bit of every cell whose open box, shrunk by ``tolerance``, meets a triangle.

    Args:
        cells: ``met`` is changed in place.
        triangles: (F, 3, 3) float64, in cells, relative to the lowest corner of the planes.
        tolerance: In cells.
    """
    plane = np.empty(3, np.int64)
    plane[0] = plane[1] = plane[2] = -1
    _mark_triangles(cells, triangles, tolerance, plane, _mark_scratch(cells.met))


# Cells that belong to a part by the half-open rule only.
#
# A sheet, or a plate thinner than twice the tolerance, can lie on a border between cells and reach more than the
# tolerance into neither. It then belongs to the cell above (to the right, behind). The same holds where a sheet crosses
# a border at such a small angle that it stays within the tolerance for half a cell or more.

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
    scratch = _mark_scratch(cells.met)
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
            _mark_triangle(cells, p, tolerance, plane, scratch, True)
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
                _mark_triangle(cells, p, tolerance, plane, scratch, True)
