"""The interior of a part, however its mesh is made, and how it was found.

A closed mesh is filled by winding along z. Where lines do not close, the three axes vote: a cell is inside if most of
the axes whose lines close there say so. If the vote is a tie, or the mesh is more a sheet than a shell, a cell is
inside if it cannot be reached from outside without crossing a surface cell.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.voxelization.bits import WORD, CellPlanes, empty_plane, empty_planes, pack, population, unpack
from bimvox.voxelization.lattice import SAMPLES, sample_lines
from bimvox.voxelization.lines import (
    RECTANGLE,
    SKIPPED,
    CutScratch,
    Faces,
    Records,
    Slab,
    faces_of,
    heights_of,
    record_faces,
)
from bimvox.voxelization.meshes import corner_keys, edges_match, inverted_faces, openness
from bimvox.voxelization.runs import FilledCells, dense_shares, share_starts
from bimvox.voxelization.surface import mark_borders, mark_surface
from bimvox.voxelization.sweep import (
    FEW,
    FULL,
    Changes,
    ColumnScratch,
    Found,
    count_closing,
    fill_column,
    sweep_columns,
    sweep_lines,
)

# The solid along columns: signed winding on 16 vertical lines a cell, exact along z.
#
# Each line counts the triangles it crosses, +1 where it enters (a face looking down) and -1 where it leaves. It is
# inside where the sum is not zero: inverted shells count, overlapping shells count once, cavities do not count.
#
# The columns are swept in slabs, which bounds the number of crossings in memory. Between surface cells a column is
# filled by runs: nothing is computed per cell of the interior.

HEIGHT_LIMIT = 1 << 23
"""Most cells along z that a crossing's height can tell apart."""

# Columns that are swept together.
_SLAB = 1 << 12


@kernel
def _longer(array: Any, used: int, size: int) -> Any:
    """Return an array of ``size`` elements that starts with the first ``used`` of another."""
    longer = np.empty(size, array.dtype)
    for n in range(used):
        longer[n] = array[n]
    return longer


@kernel
def _slabs_of(
    triangles: NDArray[np.float64], kinds: NDArray[np.int8], rows: int, width: int
) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Return the triangles over each slab of ``width`` rows of columns: (slabs + 2,) starts, and their indices."""
    slabs = (rows + width - 1) // width
    starts = np.zeros(slabs + 2, np.int64)
    ranges = np.empty((triangles.shape[0], 2), np.int32)
    for f in range(triangles.shape[0]):
        low = min(triangles[f, 0, 0], triangles[f, 1, 0], triangles[f, 2, 0])
        high = max(triangles[f, 0, 0], triangles[f, 1, 0], triangles[f, 2, 0])
        first = int(np.floor(min(max(low, 0.0), float(rows)))) // width
        last = min(int(np.floor(min(max(high, -1.0), float(rows)))) // width, slabs - 1)
        p = triangles[f]
        upright = p[0, 0] == p[1, 0] == p[2, 0] or p[0, 1] == p[1, 1] == p[2, 1]
        if upright or kinds[f] == SKIPPED:
            # No line crosses it.
            last = first - 1
        ranges[f, 0], ranges[f, 1] = first, last
        for slab in range(first, last + 1):
            starts[slab + 2] += 1
    for slab in range(slabs):
        starts[slab + 2] += starts[slab + 1]
    faces = np.empty(starts[slabs + 1], np.int32)
    for f in range(triangles.shape[0]):
        for slab in range(ranges[f, 0], ranges[f, 1] + 1):
            faces[starts[slab + 1]] = f
            starts[slab + 1] += 1
    return starts, faces


@leaf_kernel
def _find_changes(faces: Faces, sources: NDArray[np.int32], slab: int) -> None:
    """Write, for each row of columns, the first row that is crossed in the same way; slabs of rows start anew.

    Two rows are if only rectangles that neither rise nor fall along x cross them.
    """
    triangles, planes, kinds = faces.triangles, faces.planes, faces.kinds
    rows = sources.size
    for i in range(rows):
        sources[i] = 0
    for f in range(triangles.shape[0]):
        p = triangles[f]
        upright = p[0, 0] == p[1, 0] == p[2, 0] or p[0, 1] == p[1, 1] == p[2, 1]
        if upright or kinds[f] == SKIPPED:
            continue
        x0, x1 = min(p[0, 0], p[1, 0], p[2, 0]), max(p[0, 0], p[1, 0], p[2, 0])
        first, last = int(np.floor(max(x0, 0.0))), int(np.floor(min(x1, float(rows))))
        if kinds[f] != RECTANGLE or planes[f, 0] != 0.0:
            for i in range(first, min(last + 2, rows)):
                sources[i] = 1
            continue
        for i in range(first, min(first + 2, rows)):
            sources[i] = 1
        for i in range(max(last, 0), min(last + 2, rows)):
            sources[i] = 1
    source = 0
    for i in range(rows):
        if sources[i] == 1 or i % slab == 0:
            source = i
        sources[i] = source


@kernel
def _count_met(met: NDArray[np.uint64], i_low: int, i_high: int) -> int:
    count = 0
    for i in range(i_low, i_high):
        for j in range(met.shape[1]):
            for w in range(met.shape[2]):
                count += population(met[i, j, w])
    return count


@kernel
def _with_room(records: Records, used: int, size: int) -> Records:
    """Return room for ``size`` records, with the ``used`` ones so far."""
    return Records(
        records.head,
        _longer(records.following, used, size),
        _longer(records.face, used, size),
        _longer(records.mask, used, size),
    )


@kernel
def _scratch_of(count: int, changes: Changes) -> ColumnScratch:
    """Return scratch for columns of up to ``count`` records."""
    return ColumnScratch(
        np.empty(count, np.uint32),
        np.empty((count, SAMPLES), np.float64),
        np.empty((count, 4), np.int64),
        np.empty((SAMPLES, count), np.int64),
        np.empty(SAMPLES, np.int64),
        np.zeros(SAMPLES, np.int32),
        changes,
    )


@kernel
def _record_faces(
    faces: Faces, numbers: NDArray[np.int32], slab: Slab, scratch: CutScratch, records: Records
) -> Records:
    """Record which lines of a slab cross these faces; returns the records, with more room if needed."""
    n = row = count = 0
    while True:
        n, row, count = record_faces(faces, numbers, n, row, slab, scratch, records, count)
        if n == numbers.size:
            break
        records = _with_room(records, count, 2 * (count + slab.width))
    return records


@kernel
def _sweep_long_column(
    cells: CellPlanes, faces: Faces, slab: Slab, records: Records, column: int, changes: Changes, found: Found
) -> None:
    """Sweep a column that has more records than the usual scratch has room for."""
    i, j = slab.first_row + column // slab.width, column % slab.width
    slab.plain[0, j] = slab.plain[1, j] = False
    first_record = records.head[(slab.sources[i] - slab.first_row) * slab.width + j]
    count = 0
    record = first_record
    while record >= 0:
        count += 1
        record = records.following[record]
    scratch = _scratch_of(count, changes)
    record = first_record
    for n in range(count):
        scratch.masks[n] = records.mask[record]
        heights_of(faces.planes[records.face[record]], slab.samples, i, j, cells.height, scratch.heights[n])
        record = records.following[record]
    sums = found.sums
    found.starts[i * slab.width + j] = sums[0]
    closing, used = count_closing(scratch.masks, count, scratch.winding)
    sums[1] += SAMPLES - closing
    if 2 * closing < SAMPLES:
        found.closed[i, j] = False
    else:
        sweep_lines(scratch, count, used, sums)
    sums[0] = fill_column(cells, i, j, changes, closing, found.shares, sums[0])


@kernel
def fill_columns(
    cells: CellPlanes,
    triangles: NDArray[np.float64],
    inverted: NDArray[np.bool_],
    samples: NDArray[np.float64],
    closed: NDArray[np.bool_],
    starts: NDArray[np.int64],
    sharing: bool,
) -> tuple[NDArray[np.uint16], int, int, int]:
    """Find the cells inside, and measure the filled share of every surface cell, column by column.

    A cell that no triangle meets is all inside or all outside, apart from the skin of the tolerance: it is inside if
    more than half of it is filled.

    Args:
        cells: ``met`` is complete; ``inside`` is zeros, and the other cells inside the solid are set.
        triangles: (F, 3, 3) float64, in cells, relative to the lowest corner of the planes.
        inverted: (F,) bool, triangles whose orientation is reversed.
        samples: (2, 16) float64, positions of the lines in the cell's square, x and y.
        closed: (A, B) bool, set False if most lines of the column do not close; such columns stay empty.
        starts: (A * B + 1,) int64, filled with the first share of each column, and the number of shares.
        sharing: Whether equal neighbouring columns may use the same shares.

    Returns:
        The shares of the surface cells, column by column, in 2^-14; the number of lines that do not close; the lowest
        and highest winding.
    """
    rows, width = cells.met.shape[:2]
    # Rows of columns are done in slabs, so that the records of crossings stay small.
    faces = faces_of(triangles, inverted)
    slab_rows = max(1, min(rows, _SLAB // max(width, 1)))
    slab_starts, slab_faces = _slabs_of(triangles, faces.kinds, rows, slab_rows)
    sources = np.empty(rows, np.int32)
    _find_changes(faces, sources, slab_rows)
    # Scratch for one slab and for one column; records and shares grow.
    records = Records(
        np.empty(slab_rows * width, np.int32),
        np.empty(1 << 8, np.int32),
        np.empty(1 << 8, np.int32),
        np.empty(1 << 8, np.uint32),
    )
    cut = CutScratch(
        np.empty(SAMPLES, np.int32),
        np.empty(SAMPLES, np.int32),
        np.empty(SAMPLES, np.int32),
        np.empty(width, np.uint32),
    )
    words = (cells.height + 2 + WORD - 1) // WORD
    changes = Changes(np.zeros(cells.height + 2, np.int64), np.zeros(words, np.uint64))
    scratch = _scratch_of(FEW, changes)
    plain = np.zeros((2, width), np.bool_)
    sums = np.zeros(4, np.int64)
    shares = np.empty(1 << 8, np.uint16)
    for number in range(slab_starts.size - 2):
        i_low, i_high = number * slab_rows, min((number + 1) * slab_rows, rows)
        slab = Slab(samples, sources, plain, i_low, i_high, width)
        # Record which lines of the slab's columns each triangle crosses.
        for n in range(records.head.size):
            records.head[n] = -1
        for j in range(width):
            plain[0, j] = plain[1, j] = False
        records = _record_faces(faces, slab_faces[slab_starts[number] : slab_starts[number + 1]], slab, cut, records)
        more = _count_met(cells.met, i_low, i_high)
        if sums[0] + more > shares.size:
            shares = _longer(shares, sums[0], 2 * (sums[0] + more))
        found = Found(closed, starts, shares, sums, sharing)
        # Sweep the columns; one with more crossings than the scratch holds is done by itself.
        column = 0
        while True:
            column = sweep_columns(cells, faces, slab, records, column, scratch, found)
            if column == (i_high - i_low) * width:
                break
            _sweep_long_column(cells, faces, slab, records, column, changes, found)
            column += 1
    starts[rows * width] = sums[0]
    return shares[: sums[0]], sums[1], sums[2], sums[3]


# If less than half of a mesh's surface faces other surface, it is a sheet: lines through it tell nothing about inside.
_SHEET_OPENNESS = 0.5
_HALF = FULL // 2


class Fill(StrEnum):
    """How the interior of a part was found."""

    WINDING = "winding"
    """Signed winding closed on every line."""
    VOTE = "vote"
    """Some lines did not close; the axes voted there."""
    FLOOD = "flood"
    """Cells that cannot be reached from outside are inside."""
    SURFACE = "surface"
    """The mesh encloses nothing; the part is its surface."""


@dataclass(frozen=True, slots=True, eq=False)
class SolidFill:
    """The cells of a part, and how they were found.

    Attributes:
        fill: How the interior was found.
        volume: Exact volume in cells by the divergence theorem; None if the mesh is open or overlaps itself.
        filled: The cells, and the filled share of each.
    """

    fill: Fill
    volume: float | None
    filled: FilledCells


@kernel
def signed_volume(triangles: NDArray[np.float64], inverted: NDArray[np.bool_]) -> float:
    """Return the volume by the divergence theorem, about a corner of the mesh to keep the digits."""
    ox, oy, oz = triangles[0, 0, 0], triangles[0, 0, 1], triangles[0, 0, 2]
    six_fold = 0.0
    for f in range(triangles.shape[0]):
        ax, ay, az = triangles[f, 0, 0] - ox, triangles[f, 0, 1] - oy, triangles[f, 0, 2] - oz
        bx, by, bz = triangles[f, 1, 0] - ox, triangles[f, 1, 1] - oy, triangles[f, 1, 2] - oz
        cx, cy, cz = triangles[f, 2, 0] - ox, triangles[f, 2, 1] - oy, triangles[f, 2, 2] - oz
        part = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
        six_fold += -part if inverted[f] else part
    return six_fold / 6.0


def _reach_from_outside(barrier: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the cells that a 6-connected walk from the faces of the grid reaches without entering the barrier."""
    from scipy.ndimage import label  # imported only for the few parts that need it

    pieces, count = label(~barrier)
    is_outer = np.zeros(count + 1, np.bool_)
    for axis in range(3):
        layers = np.moveaxis(pieces, axis, 0)
        is_outer[layers[:1]] = is_outer[layers[-1:]] = True
    is_outer[0] = False  # the barrier
    reached: NDArray[np.bool_] = is_outer[pieces]
    return reached


@kernel
def _vote(
    met: NDArray[np.bool_],
    inside: NDArray[np.bool_],
    shares: NDArray[np.uint16],
    axis_shares: NDArray[np.uint16],
    closed_yz: NDArray[np.bool_],
    closed_zx: NDArray[np.bool_],
    closed_xy: NDArray[np.bool_],
    outside: NDArray[np.bool_],
) -> tuple[bool, bool]:
    """Let the axes decide every cell.

    Whether all axes agreed everywhere, and whether the flood decided any cell.
    """
    agreed = True
    flooded = False
    at = 0
    for i in range(met.shape[0]):
        for j in range(met.shape[1]):
            for k in range(met.shape[2]):
                votes = 0
                yes = 0
                total = 0
                for axis in range(3):
                    if axis == 0:
                        closes = closed_yz[j, k]
                    elif axis == 1:
                        closes = closed_zx[k, i]
                    else:
                        closes = closed_xy[i, j]
                    if closes:
                        votes += 1
                        share = int(axis_shares[axis, i, j, k])
                        yes += int(share > _HALF)
                        total += share
                if met[i, j, k]:
                    shares[at] = (2 * total + votes) // (2 * votes) if votes > 0 else _HALF
                    at += 1
                    continue
                inside[i, j, k] = 2 * yes > votes
                if 2 * yes == votes:
                    inside[i, j, k] = not outside[i, j, k]
                    flooded = flooded or inside[i, j, k]
                agreed = agreed and votes == 3 and (yes == 0 or yes == 3)
    return agreed, flooded


def _fill_along(
    axis: int, met: NDArray[np.bool_], triangles: NDArray[np.float64], inverted: NDArray[np.bool_]
) -> tuple[NDArray[np.uint16], NDArray[np.bool_], int]:
    """Return the filled shares found along one axis, which of its columns close, and how many lines leak."""
    order = [(1, 2, 0), (2, 0, 1), (0, 1, 2)][axis]
    turned = np.ascontiguousarray(met.transpose(order))
    nothing = empty_plane(0, 0, 0)
    cells = CellPlanes(pack(turned), empty_plane(*turned.shape), nothing, turned.shape[2])
    closed = np.ones(turned.shape[:2], np.bool_)
    corners = np.ascontiguousarray(triangles[:, :, order])
    starts = np.empty(closed.size + 1, np.int64)
    shares, leaks, _, _ = fill_columns(cells, corners, inverted, sample_lines(), closed, starts, False)
    dense = dense_shares(cells, shares)
    return dense.transpose(np.argsort(order)), closed, leaks


def fill_solid(
    shape: tuple[int, int, int], triangles: NDArray[np.float64], tolerance: float, top: NDArray[np.int64]
) -> SolidFill:
    """Find every cell of a part, and measure how much of it is filled.

    Args:
        shape: (A, B, C) cells to look at.
        triangles: (F, 3, 3) float64, in cells, relative to the lowest of these cells.
        tolerance: In cells.
        top: (3,) int64, one past the highest cell of the part's range.

    Returns:
        The cells, and how they were found. Surface cells count as half filled if the part was flooded, and as empty if
        it is a sheet.
    """
    cells = empty_planes(*shape)
    mark_surface(cells, triangles, tolerance)
    starts = np.empty(shape[0] * shape[1] + 1, np.int64)
    keys = corner_keys(triangles)
    matched = bool(edges_match(keys))
    if not matched and openness(triangles) >= _SHEET_OPENNESS:
        return _fill_by_flood(cells, triangles, tolerance, top)
    inverted = np.zeros(len(triangles), np.bool_)
    closed = np.ones(shape[:2], np.bool_)
    fill = Fill.WINDING
    # As it is; with a share for each cell, as leaking lines need it; with inverted shells turned.
    for sharing, inside_out in ((True, False), (False, False), (False, True)):
        if sharing and not matched:
            continue
        if inside_out:
            inverted = inverted_faces(triangles, keys)
            if not inverted.any():
                break
        cells.inside[:] = 0
        closed[:] = True
        shares, leaks, least, most = fill_columns(cells, triangles, inverted, sample_lines(), closed, starts, sharing)
        if not least < 0 < most and not (sharing and leaks):
            break
    if not matched or leaks:
        fill, inside = _fill_by_vote(cells, shares, triangles, inverted, closed, leaks, tolerance, top)
        cells = cells._replace(inside=inside)
    mark_borders(cells, triangles, tolerance, top)
    exact = None
    if matched and fill is Fill.WINDING and covers_once(least, most):
        exact = abs(signed_volume(triangles, inverted))
    return SolidFill(fill, exact, FilledCells(cells, starts, shares, 0))


@kernel
def covers_once(least: int, most: int) -> bool:
    """Return whether windings from ``least`` to ``most`` are those of a mesh that does not overlap itself."""
    return least == 0 <= most <= 1 or least == -1 <= most == 0


def _fill_by_vote(
    cells: CellPlanes,
    shares: NDArray[np.uint16],
    triangles: NDArray[np.float64],
    inverted: NDArray[np.bool_],
    closed_xy: NDArray[np.bool_],
    leaks_z: int,
    tolerance: float,
    top: NDArray[np.int64],
) -> tuple[Fill, NDArray[np.uint64]]:
    surface = unpack(cells.met, cells.height)
    share_x, closed_yz, leaks_x = _fill_along(0, surface, triangles, inverted)
    share_y, closed_zx, leaks_y = _fill_along(1, surface, triangles, inverted)
    along = np.stack([share_x, share_y, dense_shares(cells, shares)])
    # Seen from outside, cells on borders are surface too.
    shell = CellPlanes(cells.met, np.zeros_like(cells.met), np.zeros_like(cells.met), cells.height)
    mark_borders(shell, triangles, tolerance, top)
    outside = _reach_from_outside(unpack(shell.met | shell.border, cells.height))
    found = np.zeros_like(surface)
    agreed, flooded = _vote(surface, found, shares, along, closed_yz, closed_zx, closed_xy, outside)
    if agreed and not (leaks_x or leaks_y or leaks_z):
        return Fill.WINDING, pack(found)
    return Fill.FLOOD if flooded else Fill.VOTE, pack(found)


def _fill_by_flood(
    cells: CellPlanes, triangles: NDArray[np.float64], tolerance: float, top: NDArray[np.int64]
) -> SolidFill:
    mark_borders(cells, triangles, tolerance, top)
    barrier = unpack(cells.met | cells.border, cells.height)
    enclosed = ~barrier & ~_reach_from_outside(barrier)
    starts = share_starts(cells.met)
    if not enclosed.any():
        shares = np.zeros(starts[-1], np.uint16)
        return SolidFill(Fill.SURFACE, None, FilledCells(cells, starts, shares, 0))
    shares = np.full(starts[-1], _HALF, np.uint16)
    cells = cells._replace(inside=pack(enclosed))
    return SolidFill(Fill.FLOOD, None, FilledCells(cells, starts, shares, _HALF))
