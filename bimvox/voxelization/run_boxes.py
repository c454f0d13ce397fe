"""The boxes of a part, from its runs, without touching every cell.

Most parts are cut as in ``bimvox.grid.boxes.boxes_of``. That is slow for terrain and the like: parts of very many runs
are cut into boxes of whole runs, in time proportional to the runs.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel

MANY_RUNS = 1 << 15
"""Parts with more runs are cut into boxes of whole runs."""


@leaf_kernel
def _has(heads: NDArray[np.int32], spans: NDArray[np.int32], column: int, first: int, stop: int) -> bool:
    """Return whether a column still has all the cells first <= k < stop."""
    span = heads[column]
    while span >= 0 and spans[span, 1] <= first:
        span = spans[span, 2]
    return bool(span >= 0 and spans[span, 0] <= first and stop <= spans[span, 1])


@leaf_kernel
def _take(heads: NDArray[np.int32], spans: NDArray[np.int32], column: int, first: int, stop: int, count: int) -> int:
    """Remove the cells first <= k < stop, which it has, from a column; return the number of spans."""
    before = -1
    span = heads[column]
    while spans[span, 1] <= first:
        before = span
        span = spans[span, 2]
    if spans[span, 0] < first:
        if stop < spans[span, 1]:
            spans[count, 0], spans[count, 1], spans[count, 2] = stop, spans[span, 1], spans[span, 2]
            spans[span, 2] = count
            count += 1
        spans[span, 1] = first
    elif stop < spans[span, 1]:
        spans[span, 0] = stop
    elif before < 0:
        heads[column] = spans[span, 2]
    else:
        spans[before, 2] = spans[span, 2]
    return count


@leaf_kernel
def _find(starts: NDArray[np.int32], spans: NDArray[np.int32], column: int, first: int, stop: int) -> int:
    """Return the unused span of a column that is exactly first <= k < stop; -1 if there is none."""
    for span in range(starts[column], starts[column + 1]):
        if spans[span, 0] == first and spans[span, 1] == stop and spans[span, 2] == 0:
            return span
    return -1


@kernel
def _count_runs(columns: NDArray[np.int32]) -> int:
    """Return the number of runs of all columns; a run that several columns have counts for each."""
    count = 0
    for column in range(columns.shape[0]):
        count += columns[column, 1] - columns[column, 0]
    return count


@kernel
def whole_run_boxes(columns: NDArray[np.int32], runs: NDArray[np.int32], rows: int, width: int) -> NDArray[np.int32]:
    """Cut a part into disjoint boxes of whole runs: equal runs side by side, first along y, then along x.

    Arguments and result as for ``greedy_boxes``.
    """
    starts = np.zeros(rows * width + 1, np.int32)
    # First, stop, whether the span is used.
    spans = np.zeros((_count_runs(columns), 3), np.int32)
    count = 0
    for column in range(rows * width):
        for n in range(columns[column, 0], columns[column, 1]):
            if n > columns[column, 0] and spans[count - 1, 1] == runs[n, 0]:
                spans[count - 1, 1] = runs[n, 1]
            else:
                spans[count, 0], spans[count, 1] = runs[n, 0], runs[n, 1]
                count += 1
        starts[column + 1] = count
    boxes = np.empty((count, 6), np.int32)
    found = 0
    for i in range(rows):
        for j in range(width):
            for span in range(starts[i * width + j], starts[i * width + j + 1]):
                if spans[span, 2]:
                    continue
                k, k1 = spans[span, 0], spans[span, 1]
                spans[span, 2] = 1
                j1 = j + 1
                while j1 < width:
                    same = _find(starts, spans, i * width + j1, k, k1)
                    if same < 0:
                        break
                    spans[same, 2] = 1
                    j1 += 1
                i1 = i + 1
                while i1 < rows:
                    y = j
                    while y < j1 and _find(starts, spans, i1 * width + y, k, k1) >= 0:
                        y += 1
                    if y < j1:
                        break
                    for y in range(j, j1):
                        spans[_find(starts, spans, i1 * width + y, k, k1), 2] = 1
                    i1 += 1
                boxes[found, 0], boxes[found, 1], boxes[found, 2] = i, j, k
                boxes[found, 3], boxes[found, 4], boxes[found, 5] = i1, j1, k1
                found += 1
    return boxes[:found].copy()


@kernel
def greedy_boxes(columns: NDArray[np.int32], runs: NDArray[np.int32], rows: int, width: int) -> NDArray[np.int32]:
    """Cut a part into disjoint boxes, greedily: grow along z, then x, then y from the first cell not yet covered.

    Arguments and result as for ``boxes_of_runs``.
    """
    heads = np.empty(rows * width, np.int32)
    for n in range(heads.size):
        heads[n] = -1
    # Spans of a column form a list: first, stop, next. Columns along x are adjacent in memory, as they are read.
    spans = np.empty((_count_runs(columns) + 64, 3), np.int32)
    count = 0
    for j in range(width):
        for i in range(rows):
            column = i * width + j
            for n in range(columns[column, 0], columns[column, 1]):
                if n > columns[column, 0] and spans[count - 1, 1] == runs[n, 0]:
                    spans[count - 1, 1] = runs[n, 1]
                    continue
                spans[count, 0], spans[count, 1], spans[count, 2] = runs[n, 0], runs[n, 1], -1
                if n == columns[column, 0]:
                    heads[j * rows + i] = count
                else:
                    spans[count - 1, 2] = count
                count += 1
    boxes = np.empty((64, 6), np.int32)
    found = 0
    for i in range(rows):
        for j in range(width):
            while heads[j * rows + i] >= 0:
                k, k1 = spans[heads[j * rows + i], 0], spans[heads[j * rows + i], 1]
                i1 = i + 1
                while i1 < rows and _has(heads, spans, j * rows + i1, k, k1):
                    i1 += 1
                j1 = j + 1
                while j1 < width:
                    x = i
                    while x < i1 and _has(heads, spans, j1 * rows + x, k, k1):
                        x += 1
                    if x < i1:
                        break
                    j1 += 1
                if count + (i1 - i) * (j1 - j) > spans.shape[0]:
                    more = np.empty((2 * (count + (i1 - i) * (j1 - j)), 3), np.int32)
                    for n in range(count):
                        more[n, 0], more[n, 1], more[n, 2] = spans[n, 0], spans[n, 1], spans[n, 2]
                    spans = more
                for x in range(i, i1):
                    for y in range(j, j1):
                        count = _take(heads, spans, y * rows + x, k, k1, count)
                if found == boxes.shape[0]:
                    longer = np.empty((2 * found, 6), np.int32)
                    for n in range(found):
                        for side in range(6):
                            longer[n, side] = boxes[n, side]
                    boxes = longer
                boxes[found, 0], boxes[found, 1], boxes[found, 2] = i, j, k
                boxes[found, 3], boxes[found, 4], boxes[found, 5] = i1, j1, k1
                found += 1
    return boxes[:found].copy()


@kernel
def boxes_of_runs(columns: NDArray[np.int32], runs: NDArray[np.int32], rows: int, width: int) -> NDArray[np.int32]:
    """Cut a part into disjoint boxes whose union is the part.

    Args:
        columns: (rows * width, 2) int32 first run of each column, and one past its last.
        runs: (R, 3) int32 runs, ascending in each column; runs that touch are joined.
        rows: Columns along x.
        width: Columns along y.

    Returns:
        (B, 6) int32 half-open boxes ``x0 y0 z0 x1 y1 z1``, in the part's own cells.
    """
    if _count_runs(columns) <= MANY_RUNS:
        return greedy_boxes(columns, runs, rows, width)
    return whole_run_boxes(columns, runs, rows, width)
