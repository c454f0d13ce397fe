"""Cells that an obstruction occupies: every cell that it may touch; faces on a cell border do not spill over."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import lru_cache
from itertools import product
from math import ceil, floor
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.grid.frame import GridFrame
from bimvox.site.checks import shown_m
from bimvox.site.component import IntVec
from bimvox.site.obstructions.obstruction_set import Box, Cylinder, Obstruction, Voxels
from bimvox.site.transit_clearance import grown_cells

TOLERANCE_M = 1e-4
"""How deep a form must reach into a cell to occupy it; as the voxelizer, so that faces on a border do not spill."""
_FEW_CELLS = 64
"""Up to so many cells of a box are listed without arrays, which is faster."""
_MANY = 1000
"""From so many boxes on, the cells of all are computed at once."""
_MOST_AT_ONCE = 5_000_000
"""Cells that are computed at once."""
_FAR_M = 1e12
"""Farther than any site reaches; nothing overflows here."""

Rasterise: TypeAlias = Callable[[TriangleMesh, GridFrame, IntVec], "NDArray[np.int32]"]
"""(mesh in the site frame, frame, shape) -> (N, 3) int32 cells inside the grid that the solid occupies."""


def obstruction_cells(
    obstruction: Obstruction, frame: GridFrame, shape: IntVec, rasterise: Rasterise, *, grow_vox: int = 0
) -> tuple[NDArray[np.int32], str | None]:
    """Return the cells of the grid that an obstruction occupies.

    Args:
        obstruction: In the site frame.
        frame: Frame of the grid.
        shape: (X, Y, Z) of the grid.
        rasterise: Turns a mesh into cells.
        grow_vox: Clearance in whole cells: every cell within it, in any direction, is occupied too.

    Returns:
        (N, 3) int32 cells in ascending order, each once, and a note if the obstruction is not wholly inside the site.
    """
    if isinstance(obstruction.form, Box) and _is_far(obstruction.form, frame, shape, grow_vox):
        return np.zeros((0, 3), np.int32), _note(obstruction, 0, frame, shape, cut=True)
    if grow_vox == 0:
        cells, outside = _cells(obstruction, frame, shape, rasterise, 0)
        return np.ascontiguousarray(cells), _note(obstruction, len(cells), frame, shape, cut=outside)
    # Computed in a grid larger by the clearance, so that the clearance of an obstruction just outside also counts.
    wide_frame = GridFrame(_tuple(np.array(frame.origin_m) - grow_vox * frame.voxel_size_m), frame.voxel_size_m)
    x, y, z = (n + 2 * grow_vox for n in shape)
    raw, outside = _cells(obstruction, wide_frame, (x, y, z), rasterise, grow_vox)
    cells = grown_cells(raw, grow_vox) - grow_vox
    cells = cells[((cells >= 0) & (cells < np.array(shape))).all(axis=1)].astype(np.int32)
    inside = raw[((raw >= grow_vox) & (raw < np.array(shape) + grow_vox)).all(axis=1)]
    return cells, _note(obstruction, len(inside), frame, shape, cut=outside or len(inside) < len(raw))


def cells_of_all(
    obstructions: Sequence[Obstruction], frame: GridFrame, shape: IntVec, rasterise: Rasterise, *, grow_vox: int = 0
) -> Iterator[tuple[NDArray[np.int32], str | None]]:
    """Yield what :func:`obstruction_cells` returns for each obstruction; a million boxes take seconds."""
    for first in range(0, len(obstructions), _MANY):
        some = obstructions[first : first + _MANY]
        boxes = [one.form for one in some if isinstance(one.form, Box)]
        if len(boxes) == _MANY:
            yield from _cells_of_boxes(some, boxes, frame, shape, grow_vox)
        else:
            yield from (obstruction_cells(one, frame, shape, rasterise, grow_vox=grow_vox) for one in some)


def _cells_of_boxes(
    obstructions: Sequence[Obstruction], boxes: Sequence[Box], frame: GridFrame, shape: IntVec, grow_vox: int
) -> Iterator[tuple[NDArray[np.int32], str | None]]:
    """Yield cells and note of boxes, each found as by ``_range``."""
    low_m, high_m = (np.clip(end, -_FAR_M, _FAR_M) for end in ([b.low_m for b in boxes], [b.high_m for b in boxes]))
    origin_m = np.array(frame.origin_m) - grow_vox * frame.voxel_size_m
    limit = np.array(shape) + 2 * grow_vox
    thin = high_m - low_m < 3 * TOLERANCE_M
    first_m = np.where(thin, (low_m + high_m) / 2, low_m + TOLERANCE_M)
    last_m = np.where(thin, (low_m + high_m) / 2, high_m - TOLERANCE_M)
    start = np.clip(np.floor((first_m - origin_m) / frame.voxel_size_m), -1, limit).astype(np.int64)
    above = np.ceil((last_m - origin_m) / frame.voxel_size_m)
    stop = np.clip(np.maximum(above, start + 1), 0, limit + 1).astype(np.int64)
    cut = ((start < 0) | (stop > limit)).any(axis=1)
    start, stop = np.maximum(start, 0), np.minimum(stop, limit)
    there = (stop > start).all(axis=1)
    inside = there & ((start < limit - grow_vox) & (stop > grow_vox)).all(axis=1)
    cut |= ((start < grow_vox) | (stop > limit - grow_vox)).any(axis=1)
    # In cells of the grid, grown by the clearance.
    start, stop = np.maximum(start - 2 * grow_vox, 0), np.minimum(stop, shape)
    size = np.where((there & (stop > start).all(axis=1))[:, None], stop - start, 0)
    counts = size.prod(axis=1)
    cells = _cells_of_blocks(start, size) if counts.sum() <= _MOST_AT_ONCE else None
    at = 0
    for n, (one, count) in enumerate(zip(obstructions, counts.tolist(), strict=True)):
        own = _cells_of_blocks(start[n : n + 1], size[n : n + 1]) if cells is None else cells[at : at + count]
        at += count
        yield own, _note(one, int(inside[n]), frame, shape, cut=bool(cut[n]))


def _cells_of_blocks(start: NDArray[np.int64], size: NDArray[np.int64]) -> NDArray[np.int32]:
    """Return the (N, 3) cells of blocks of cells, block by block."""
    counts = size.prod(axis=1)
    number = np.repeat(np.arange(len(size)), counts)
    place = np.arange(len(number)) - (np.cumsum(counts) - counts)[number]
    cells = np.empty((len(number), 3), np.int32)
    for axis in (2, 1, 0):
        along = size[number, axis]
        cells[:, axis] = place % along + start[number, axis]
        place //= along
    return cells


def _note(obstruction: Obstruction, inside: int, frame: GridFrame, shape: IntVec, *, cut: bool) -> str | None:
    """Return the note about an obstruction of which so many cells are inside the site."""
    if inside == 0:
        return outside_note(obstruction.id, frame, shape)
    return clipped_note(obstruction.id) if cut else None


def clipped_note(name: str) -> str:
    """Return the note about an obstruction of an id that has cells inside the site and outside it."""
    return f"obstruction {name!r} is clipped to the site"


def outside_note(name: str, frame: GridFrame, shape: IntVec) -> str:
    """Return the note about an obstruction of an id that has no cell inside the site."""
    return f"obstruction {name!r} lies outside the site, which is {_extent(frame, shape)}"


@lru_cache(maxsize=16)
def _extent(frame: GridFrame, shape: IntVec) -> str:
    """Return from where to where a grid reaches, as messages state it; a million obstructions may lie outside."""
    low, high = (shown_m(frame.corner_of(np.array(cell))) for cell in ((0, 0, 0), shape))
    return f"from {low} to {high} m"


def _is_far(box: Box, frame: GridFrame, shape: IntVec, grow_vox: int) -> bool:
    """Return whether a box is certainly outside; without arrays, because there may be a million of them."""
    away_m, cell_m = (grow_vox + 2) * frame.voxel_size_m, frame.voxel_size_m
    return any(
        high < origin - away_m or low > origin + count * cell_m + away_m
        for low, high, origin, count in zip(box.low_m, box.high_m, frame.origin_m, shape, strict=True)
    )


def _cells(
    obstruction: Obstruction, frame: GridFrame, shape: IntVec, rasterise: Rasterise, shift: int
) -> tuple[NDArray[np.int32], bool]:
    """Return cells inside the grid in ascending order, each once, and whether any part lies outside it."""
    form = obstruction.form
    if isinstance(form, Voxels):
        return _inside(np.array(form.cells, np.int64) + shift, shape)
    if isinstance(form, Box):
        low, high, cut = _range(form.low_m, form.high_m, frame, shape)
        return _block(low, high), cut
    if isinstance(form, Cylinder):
        return _cylinder_cells(form, frame, shape)
    if isinstance(form, TriangleMesh):
        cut = _range(form.bounds_m[0], form.bounds_m[1], frame, shape)[2]
        return np.unique(rasterise(form, frame, shape), axis=0).astype(np.int32).reshape(-1, 3), cut
    reachable_m = np.clip(form.points_m, frame.corner_of([-2, -2, -2]), frame.corner_of(np.array(shape) + 2))
    return _inside(frame.cell_of(reachable_m), shape)


def _cylinder_cells(form: Cylinder, frame: GridFrame, shape: IntVec) -> tuple[NDArray[np.int32], bool]:
    base = np.clip(np.array(form.base_m), -_FAR_M, _FAR_M)
    radius_m, height_m = min(form.radius_m, _FAR_M), min(form.height_m, _FAR_M)
    arm = np.array([radius_m, radius_m, 0.0])
    low, high, cut = _range(base - arm, base + arm + [0.0, 0.0, height_m], frame, shape)
    corners = np.moveaxis(np.indices(np.maximum(high - low, 0)[:2]), 0, -1) + low[:2]
    corners_m = frame.voxel_size_m * corners + np.array(frame.origin_m)[:2]
    # A cell meets the disc if its point nearest to the axis does (the cell shrunk by the tolerance).
    nearest = np.clip(base[:2], corners_m + TOLERANCE_M, corners_m + frame.voxel_size_m - TOLERANCE_M)
    meets = np.hypot(*np.moveaxis(nearest - base[:2], -1, 0)) < max(radius_m, 2 * TOLERANCE_M)
    columns = np.argwhere(meets) + low[:2]
    levels = np.arange(low[2], high[2])
    cells = np.column_stack([np.repeat(columns, len(levels), axis=0), np.tile(levels, len(columns))])
    return cells.astype(np.int32), cut


def _range(
    low_m: Iterable[float], high_m: Iterable[float], frame: GridFrame, shape: IntVec
) -> tuple[NDArray[np.int64], NDArray[np.int64], bool]:
    """Return the half-open cell range, cut to the grid, of an open box in metres; a thin box counts as one cell.

    Computed without arrays, because there may be a million boxes.
    """
    starts, stops, cut = [0, 0, 0], [0, 0, 0], False
    ends = zip(low_m, high_m, frame.origin_m, shape, strict=True)
    for axis, (lowest, highest, origin, limit) in enumerate(ends):
        low, high = min(max(float(lowest), -_FAR_M), _FAR_M), min(max(float(highest), -_FAR_M), _FAR_M)
        thin = high - low < 3 * TOLERANCE_M
        first, last = ((low + high) / 2,) * 2 if thin else (low + TOLERANCE_M, high - TOLERANCE_M)
        start = min(max(floor((first - origin) / frame.voxel_size_m), -1), limit)
        stop = min(max(ceil((last - origin) / frame.voxel_size_m), start + 1, 0), limit + 1)
        cut |= start < 0 or stop > limit
        starts[axis], stops[axis] = max(start, 0), min(stop, limit)
    return np.array(starts, np.int64), np.array(stops, np.int64), cut


def _block(low: NDArray[np.int64], high: NDArray[np.int64]) -> NDArray[np.int32]:
    x, y, z = (range(first, last) for first, last in zip(low.tolist(), high.tolist(), strict=True))
    if len(x) * len(y) * len(z) <= _FEW_CELLS:
        return np.array(list(product(x, y, z)), np.int32).reshape(-1, 3)
    block = np.indices(np.maximum(high - low, 0), dtype=np.int32).reshape(3, -1).T
    return block + low.astype(np.int32)


def _inside(cells: NDArray[np.int64], shape: IntVec) -> tuple[NDArray[np.int32], bool]:
    inside = ((cells >= 0) & (cells < np.array(shape))).all(axis=1)
    return np.unique(cells[inside], axis=0).astype(np.int32).reshape(-1, 3), not bool(inside.all())


def _tuple(values: NDArray[np.float64]) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return (x, y, z)
