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

from bimvox.compiled import kernel, leaf_kernel
from bimvox.voxelization.bits import WORD, population
from bimvox.voxelization.lines import RECTANGLE, SKIPPED, heights_of, planes_of, record_rectangle, record_triangle
from bimvox.voxelization.samples import SAMPLES
from bimvox.voxelization.sweep import FEW, count_closing, fill_column, sweep_columns, sweep_lines

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
def _slabs_of(
    triangles: NDArray[np.float64], kinds: NDArray[np.int8], rows: int, width: int
) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Return which triangles lie over each slab of ``width`` rows of columns: (slabs + 1,) starts, and the numbers."""
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
def _find_changes(
    triangles: NDArray[np.float64],
    planes: NDArray[np.float64],
    kinds: NDArray[np.int8],
    sources: NDArray[np.int32],
    slab: int,
) -> None:
    """Write, for each row of columns, the first of the rows before it that is crossed in the same way.

    That is so where only rectangles run on that rise neither nor fall along x. Slabs of rows begin anew.
    """
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
def fill_columns(
    met: NDArray[np.uint64],
    inside: NDArray[np.uint64],
    top: int,
    triangles: NDArray[np.float64],
    inverted: NDArray[np.bool_],
    samples: NDArray[np.float64],
    closed: NDArray[np.bool_],
    starts: NDArray[np.int64],
    sharing: bool,
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
        starts: (A * B + 1,) int64, filled with the first share of each column, and their number.
        sharing: Whether columns beside each other that are alike may have their shares in one place.

    Returns:
        The shares of the surface cells, column by column, in 2^-14; the number of lines that do not close; the lowest
        and highest winding seen.
    """
    rows, width = met.shape[:2]
    planes, kinds, names = planes_of(triangles, inverted)
    slab = max(1, min(rows, _SLAB // max(width, 1)))
    slab_starts, slab_faces = _slabs_of(triangles, kinds, rows, slab)
    sources = np.empty(rows, np.int32)
    _find_changes(triangles, planes, kinds, sources, slab)
    # The records of a column form a list.
    head = np.empty(slab * width, np.int32)
    following = np.empty(1 << 8, np.int32)
    record_face = np.empty(1 << 8, np.int32)
    record_mask = np.empty(1 << 8, np.uint32)
    firsts, lasts, bits = np.empty(SAMPLES, np.int32), np.empty(SAMPLES, np.int32), np.empty(SAMPLES, np.int32)
    across = np.empty(width, np.uint32)
    masks = np.empty(FEW, np.uint32)
    heights = np.empty((FEW, SAMPLES), np.float64)
    spans = np.empty((FEW, 4), np.int64)
    keys = np.empty((SAMPLES, FEW), np.int64)
    stored = np.empty(SAMPLES, np.int64)
    plain = np.zeros((2, width), np.bool_)
    change = np.zeros(top + 2, np.int64)
    touched = np.zeros((top + 2 + WORD - 1) // WORD, np.uint64)
    winding = np.zeros(SAMPLES, np.int32)
    shares = np.empty(1 << 8, np.uint16)
    sums = np.zeros(4, np.int64)
    for number in range(slab_starts.size - 2):
        i_low, i_high = number * slab, min(number * slab + slab, rows)
        head[:] = -1
        plain[:] = False
        records = 0
        for n in range(slab_starts[number], slab_starts[number + 1]):
            f = slab_faces[n]
            x_low = min(triangles[f, 0, 0], triangles[f, 1, 0], triangles[f, 2, 0])
            x_high = max(triangles[f, 0, 0], triangles[f, 1, 0], triangles[f, 2, 0])
            row = max(int(np.floor(max(x_low, 0.0))), i_low)
            stop = min(int(np.floor(min(x_high, float(rows)))), i_high - 1) + 1
            level = planes[f, 5] == planes[f, 6]
            while row < stop:
                if kinds[f] == RECTANGLE:
                    row, records = record_rectangle(
                        triangles, f, names[f], level, inverted[f], samples, sources, row, stop, i_low, width, across,
                        head, following, record_face, record_mask, records,
                    )  # fmt: skip
                else:
                    row, records = record_triangle(
                        triangles, f, names[f], level, inverted[f], samples, row, stop, i_low, width,
                        firsts, lasts, bits, head, following, record_face, record_mask, records,
                    )  # fmt: skip
                if row < stop:
                    grown = 2 * (records + width)
                    following = _longer(following, records, grown)
                    record_face = _longer(record_face, records, grown)
                    record_mask = _longer(record_mask, records, grown)
        more = _count_met(met, i_low, i_high)
        if sums[0] + more > shares.size:
            shares = _longer(shares, sums[0], 2 * (sums[0] + more))
        columns = (i_high - i_low) * width
        column = 0
        while True:
            column = sweep_columns(
                met, inside, top, planes, samples, sources, i_low, column, columns, head, following, record_face,
                record_mask, masks, heights, spans, keys, stored, winding, plain, change, touched, closed, starts,
                shares, sums, sharing,
            )  # fmt: skip
            if column == columns:
                break
            i, j = i_low + column // width, column % width
            plain[0, j] = plain[1, j] = False
            count = 0
            first_record = head[(sources[i] - i_low) * width + j]
            record = first_record
            while record >= 0:
                count += 1
                record = following[record]
            all_masks = np.empty(count, np.uint32)
            all_heights = np.empty((count, SAMPLES), np.float64)
            record = first_record
            for n in range(count):
                all_masks[n] = record_mask[record]
                heights_of(planes[record_face[record]], samples, i, j, top, all_heights[n])
                record = following[record]
            starts[i * width + j] = sums[0]
            closing, used = count_closing(all_masks, count, winding)
            sums[1] += SAMPLES - closing
            if 2 * closing < SAMPLES:
                closed[i, j] = False
            else:
                all_keys = np.empty((SAMPLES, count), np.int64)
                sweep_lines(all_masks, all_heights, count, used, all_keys, stored, sums, change, touched)
            sums[0] = fill_column(met, inside, i, j, top, change, touched, closing, shares, sums[0])
            column += 1
    starts[rows * width] = sums[0]
    return shares[: sums[0]], sums[1], sums[2], sums[3]
