"""The solid along columns: signed winding on 16 vertical lines a cell, exact along z.

Each line counts the triangles it crosses, +1 where it enters (a face looking down) and -1 where it leaves; it is inside
where the sum is not zero (so inverted shells count, overlapping shells count once, and cavities do not).

The columns are swept in slabs, so that the crossings held at once stay few, whatever the size of the part. Between the
surface cells a column is filled by runs: nothing is computed per cell of the interior.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.voxelize.bits import WORD, population
from bimvox.voxelize.lines import planes_of, record_lines
from bimvox.voxelize.samples import SAMPLES
from bimvox.voxelize.sweep import FEW, count_closing, fill_column, sweep_columns, sweep_lines

HEIGHT_LIMIT = 1 << 23
"""Most cells along z that a crossing can tell apart."""

# Columns swept together.
_SLAB = 1 << 12


@kernel
def _longer(array: Any, used: int, size: int) -> Any:
    """Return an array of ``size`` elements that starts with the ``used`` ones of another."""
    longer = np.empty(size, array.dtype)
    for n in range(used):
        longer[n] = array[n]
    return longer


@kernel
def _slabs_of(triangles: NDArray[np.float64], rows: int, width: int) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Return which triangles lie over each slab of ``width`` rows of columns: (slabs + 1,) starts, and the numbers."""
    slabs = (rows + width - 1) // width
    starts = np.zeros(slabs + 2, np.int64)
    ranges = np.empty((triangles.shape[0], 2), np.int32)
    for f in range(triangles.shape[0]):
        low = min(triangles[f, 0, 0], triangles[f, 1, 0], triangles[f, 2, 0])
        high = max(triangles[f, 0, 0], triangles[f, 1, 0], triangles[f, 2, 0])
        first = int(np.floor(min(max(low, 0.0), float(rows)))) // width
        last = min(int(np.floor(min(max(high, -1.0), float(rows)))) // width, slabs - 1)
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


@kernel
def _count_met(met: NDArray[np.uint64], i_low: int, i_high: int) -> int:
    count = 0
    for i in range(i_low, i_high):
        for j in range(met.shape[1]):
            for w in range(met.shape[2]):
                count += population(met[i, j, w])
    return count


@kernel
def fill_columns(
    met: NDArray[np.uint64],
    inside: NDArray[np.uint64],
    top: int,
    triangles: NDArray[np.float64],
    inverted: NDArray[np.bool_],
    samples: NDArray[np.float64],
    closed: NDArray[np.bool_],
    starts: NDArray[np.int64],
) -> tuple[NDArray[np.uint16], int, int, int]:
    """Find the cells inside, and measure the filled share of every surface cell, column by column.

    A cell that no triangle meets is all inside or all outside but for the tolerance's skin: it is inside when more than
    half of it is filled.

    Args:
        met: (A, B, W) plane of bits: the cells that the surface meets, complete.
        inside: (A, B, W) plane of bits, zeros; the other cells that lie inside are set.
        top: Cells of a column.
        triangles: (F, 3, 3) float64, in cells, relative to the lowest corner of the planes.
        inverted: (F,) bool, triangles to be read the other way round.
        samples: (2, 16) float64, positions of the lines in the cell's square, x and y.
        closed: (A, B) bool, set False where most lines of the column do not close; such columns stay empty.
        starts: (A * B + 1,) int64, filled with the first share of each column.

    Returns:
        The shares of the surface cells, in order, in 2^-14; the number of lines that do not close; the lowest and
        highest winding seen.
    """
    rows, width = met.shape[:2]
    planes = planes_of(triangles)
    slab = max(1, min(rows, _SLAB // max(width, 1)))
    slab_starts, slab_faces = _slabs_of(triangles, rows, slab)
    # The records of a column form a list.
    head = np.empty(slab * width, np.int32)
    following = np.empty(1 << 8, np.int32)
    record_face = np.empty(1 << 8, np.int32)
    record_mask = np.empty(1 << 8, np.uint32)
    line_spans = np.empty((3, SAMPLES), np.int32)
    row_masks = np.zeros(width, np.uint32)
    masks = np.empty(FEW, np.uint32)
    heights = np.empty((FEW, SAMPLES), np.float64)
    spans = np.empty((FEW, 4), np.int64)
    change = np.zeros(top + 2, np.int64)
    touched = np.zeros((top + 2 + WORD - 1) // WORD, np.uint64)
    winding = np.zeros(SAMPLES, np.int32)
    since = np.zeros(SAMPLES, np.float64)
    shares = np.empty(1 << 8, np.uint16)
    sums = np.zeros(4, np.int64)
    for number in range(slab_starts.size - 2):
        i_low, i_high = number * slab, min(number * slab + slab, rows)
        head[:] = -1
        records = 0
        for n in range(slab_starts[number], slab_starts[number + 1]):
            f = slab_faces[n]
            x_low = min(triangles[f, 0, 0], triangles[f, 1, 0], triangles[f, 2, 0])
            x_high = max(triangles[f, 0, 0], triangles[f, 1, 0], triangles[f, 2, 0])
            first_row = max(int(np.floor(max(x_low, 0.0))), i_low)
            last_row = min(int(np.floor(min(x_high, float(rows)))), i_high - 1)
            for i in range(first_row, last_row + 1):
                first, last = record_lines(triangles, f, inverted[f], samples, i, width, line_spans, row_masks)
                if records + last - first > following.size:
                    grown = 2 * (records + last - first)
                    following = _longer(following, records, grown)
                    record_face = _longer(record_face, records, grown)
                    record_mask = _longer(record_mask, records, grown)
                for j in range(first, last):
                    if row_masks[j] != 0:
                        column = (i - i_low) * width + j
                        following[records] = head[column]
                        record_face[records] = f
                        record_mask[records] = row_masks[j]
                        head[column] = records
                        records += 1
        more = _count_met(met, i_low, i_high)
        if sums[0] + more > shares.size:
            shares = _longer(shares, sums[0], 2 * (sums[0] + more))
        columns = (i_high - i_low) * width
        column = 0
        while True:
            column = sweep_columns(
                met, inside, top, planes, samples, i_low, column, columns, head, following, record_face, record_mask,
                masks, heights, spans, winding, since, change, touched, closed, starts, shares, sums,
            )  # fmt: skip
            if column == columns:
                break
            i, j = i_low + column // width, column % width
            count = 0
            record = head[column]
            while record >= 0:
                count += 1
                record = following[record]
            all_masks = np.empty(count, np.uint32)
            all_planes = np.empty((count, planes.shape[1]), np.float64)
            record = head[column]
            for n in range(count):
                all_masks[n] = record_mask[record]
                for m in range(planes.shape[1]):
                    all_planes[n, m] = planes[record_face[record], m]
                record = following[record]
            starts[i * width + j] = sums[0]
            closing, used = count_closing(all_masks, count, winding)
            sums[1] += SAMPLES - closing
            if 2 * closing < SAMPLES:
                closed[i, j] = False
            else:
                sweep_lines(all_masks, all_planes, count, used, samples, i, j, top, sums, change, touched)
            sums[0] = fill_column(met, inside, i, j, top, change, touched, closing, shares, sums[0])
            column += 1
    starts[rows * width] = sums[0]
    return shares[: sums[0]], sums[1], sums[2], sums[3]
