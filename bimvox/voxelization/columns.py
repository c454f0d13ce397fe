"""The solid along columns: signed winding on 16 vertical lines a cell, exact along z.

Each line counts the triangles it crosses, +1 where it enters (a face looking down) and -1 where it leaves. It is inside
where the sum is not zero: inverted shells count, overlapping shells count once, cavities do not count.

The columns are swept in slabs, which bounds the number of crossings in memory. Between surface cells a column is filled
by runs: nothing is computed per cell of the interior.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.voxelization.bits import WORD, CellPlanes, population
from bimvox.voxelization.faces import RECTANGLE, SKIPPED, Faces, faces_of, heights_of
from bimvox.voxelization.lines import CutScratch, Records, Slab, record_faces
from bimvox.voxelization.samples import SAMPLES
from bimvox.voxelization.sweep import (
    FEW,
    Changes,
    ColumnScratch,
    Found,
    count_closing,
    fill_column,
    sweep_columns,
    sweep_lines,
)

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
    faces = faces_of(triangles, inverted)
    slab_rows = max(1, min(rows, _SLAB // max(width, 1)))
    slab_starts, slab_faces = _slabs_of(triangles, faces.kinds, rows, slab_rows)
    sources = np.empty(rows, np.int32)
    _find_changes(faces, sources, slab_rows)
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
        for n in range(records.head.size):
            records.head[n] = -1
        for j in range(width):
            plain[0, j] = plain[1, j] = False
        records = _record_faces(faces, slab_faces[slab_starts[number] : slab_starts[number + 1]], slab, cut, records)
        more = _count_met(cells.met, i_low, i_high)
        if sums[0] + more > shares.size:
            shares = _longer(shares, sums[0], 2 * (sums[0] + more))
        found = Found(closed, starts, shares, sums, sharing)
        column = 0
        while True:
            column = sweep_columns(cells, faces, slab, records, column, scratch, found)
            if column == (i_high - i_low) * width:
                break
            _sweep_long_column(cells, faces, slab, records, column, changes, found)
            column += 1
    starts[rows * width] = sums[0]
    return shares[: sums[0]], sums[1], sums[2], sums[3]
