"""Cells that an obstruction occupies: every cell that it may touch; faces on a cell border do not spill over."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import replace
from enum import Enum
from functools import lru_cache
from math import ceil, floor
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.grid.frame import GridFrame
from bimvox.site.checks import shown_m
from bimvox.site.collision import grown_cells
from bimvox.site.component import IntVec
from bimvox.site.obstructions.obstruction_set import Box, Cylinder, Obstruction, Points, Voxels

MOST_NAMED = 99
"""So many notes name their obstruction."""


class Where(Enum):
    """Where an obstruction is."""

    INSIDE = 0
    CLIPPED = 1
    OUTSIDE = 2


KINDS = {Where.CLIPPED: "clipped to the site", Where.OUTSIDE: "outside the site"}
"""What is counted."""


def note_about(name: str, where: Where, frame: GridFrame, shape: IntVec) -> str:
    """Return the note about an obstruction of an id that is not wholly inside the site."""
    if where is Where.OUTSIDE:
        return f"obstruction {name!r} lies outside the site, which is {_extent(frame, shape)}"
    return f"obstruction {name!r} is clipped to the site"


class Notes:
    """Gathers notes."""

    def __init__(self) -> None:
        self._named: list[str] = []
        self._left = MOST_NAMED
        self._more: Counter[str] = Counter()

    def add(self, kind: str, note: Callable[[], str], *, always: bool) -> None:
        """Add a note.

        Args:
            kind: What is counted if the note does not fit.
            note: Makes the note; there may be a million of them.
            always: Whether it is kept even if it does not fit.
        """
        self._left -= not always
        if always or self._left >= 0:
            self._named.append(note())
        else:
            self._more[kind] += 1

    def lines(self) -> tuple[str, ...]:
        """Return the notes in their order, and one about the others."""
        if not self._more:
            return tuple(self._named)
        counts = ", ".join(f"{count:,} {kind}" for kind, count in sorted(self._more.items()))
        return (*self._named, f"more obstructions: {counts}")


@lru_cache(maxsize=16)
def _extent(frame: GridFrame, shape: IntVec) -> str:
    """Return from where to where a grid reaches, as messages state it; a million obstructions may lie outside."""
    low, high = (shown_m(frame.corner_of(np.array(cell))) for cell in ((0, 0, 0), shape))
    return f"from {low} to {high} m"


TOLERANCE_M = 1e-4
"""How deep a form must reach into a cell to occupy it; as the voxelizer, so that faces on a border do not spill."""
FAR_M = 1e12
"""Farther than any site reaches; nothing overflows here."""

Rasterise: TypeAlias = Callable[[TriangleMesh, GridFrame, IntVec], "NDArray[np.int32]"]
"""(mesh in the site frame, frame, shape) -> (N, 3) int32 cells inside the grid that the solid occupies."""


def obstruction_cells(
    obstruction: Obstruction,
    frame: GridFrame,
    shape: IntVec,
    rasterise: Rasterise,
    *,
    grow_vox: int = 0,
    ground_vox: NDArray[np.int32] | None = None,
) -> tuple[NDArray[np.int32], Where]:
    """Return the cells of the grid that an obstruction occupies.

    Args:
        obstruction: In the site frame.
        frame: Frame of the grid.
        shape: (X, Y, Z) of the grid.
        rasterise: Turns a mesh into cells.
        grow_vox: Clearance in whole cells: every cell within it, in any direction, is occupied too.
        ground_vox: (X, Y) the highest layer of the ground in each column; default: nothing is known of it. What is in
            the ground needs no clearance: parts lie and stand on it. A point at its height is of the ground.

    Returns:
        (N, 3) int32 cells in ascending order, each once, and where the obstruction is.
    """
    if ground_vox is not None and isinstance(obstruction.form, Points):
        obstruction = _above_ground(obstruction, obstruction.form, frame, ground_vox)
    if grow_vox == 0:
        cells, outside = _cells(obstruction, frame, shape, rasterise, 0)
        return np.ascontiguousarray(cells), _where(len(cells), cut=outside)
    # Computed in a grid larger by the clearance, so that the clearance of an obstruction just outside also counts.
    wide_frame = GridFrame(_tuple(np.array(frame.origin_m) - grow_vox * frame.voxel_size_m), frame.voxel_size_m)
    x, y, z = (n + 2 * grow_vox for n in shape)
    raw, outside = _cells(obstruction, wide_frame, (x, y, z), rasterise, grow_vox)
    above = raw
    if ground_vox is not None:
        inwards = np.clip(raw[:, :2] - grow_vox, 0, np.array(shape[:2]) - 1)
        above = raw[raw[:, 2] - grow_vox > ground_vox[tuple(inwards.T)]]
    cells = grown_cells(above, grow_vox) - grow_vox
    cells = cells[((cells >= 0) & (cells < np.array(shape))).all(axis=1)].astype(np.int32)
    inside = raw[((raw >= grow_vox) & (raw < np.array(shape) + grow_vox)).all(axis=1)]
    return cells, _where(len(inside), cut=outside or len(inside) < len(raw))


def _above_ground(
    obstruction: Obstruction, points: Points, frame: GridFrame, ground_vox: NDArray[np.int32]
) -> Obstruction:
    """Return a point cloud whose points on the ground are in its highest layer."""
    column = np.clip(frame.cell_of(points.points_m)[:, :2], 0, np.array(ground_vox.shape) - 1)
    ground_m = frame.origin_m[2] + frame.voxel_size_m * (ground_vox[tuple(column.T)] + 1)
    height_m = points.points_m[:, 2] - ground_m
    on_it = np.abs(height_m) <= TOLERANCE_M
    if not on_it.any():
        return obstruction
    lowered_m = points.points_m.copy()
    lowered_m[on_it, 2] = ground_m[on_it] - TOLERANCE_M
    return replace(obstruction, form=Points(lowered_m))


def _where(inside: int, *, cut: bool) -> Where:
    """Return where an obstruction is of which so many cells are inside the site."""
    return (Where.CLIPPED if cut else Where.INSIDE) if inside else Where.OUTSIDE


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
    base = np.clip(np.array(form.base_m), -FAR_M, FAR_M)
    radius_m, height_m = min(form.radius_m, FAR_M), min(form.height_m, FAR_M)
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
    """Return the half-open cell range, cut to the grid, of an open box in metres; a thin box counts as one cell."""
    starts, stops, cut = [0, 0, 0], [0, 0, 0], False
    ends = zip(low_m, high_m, frame.origin_m, shape, strict=True)
    for axis, (lowest, highest, origin, limit) in enumerate(ends):
        low, high = min(max(float(lowest), -FAR_M), FAR_M), min(max(float(highest), -FAR_M), FAR_M)
        thin = high - low < 3 * TOLERANCE_M
        first, last = ((low + high) / 2,) * 2 if thin else (low + TOLERANCE_M, high - TOLERANCE_M)
        start = min(max(floor((first - origin) / frame.voxel_size_m), -1), limit)
        stop = min(max(ceil((last - origin) / frame.voxel_size_m), start + 1, 0), limit + 1)
        cut |= start < 0 or stop > limit
        starts[axis], stops[axis] = max(start, 0), min(stop, limit)
    return np.array(starts, np.int64), np.array(stops, np.int64), cut


def _block(low: NDArray[np.int64], high: NDArray[np.int64]) -> NDArray[np.int32]:
    block = np.indices(np.maximum(high - low, 0), dtype=np.int32).reshape(3, -1).T
    return block + low.astype(np.int32)


def _inside(cells: NDArray[np.int64], shape: IntVec) -> tuple[NDArray[np.int32], bool]:
    inside = ((cells >= 0) & (cells < np.array(shape))).all(axis=1)
    return np.unique(cells[inside], axis=0).astype(np.int32).reshape(-1, 3), not bool(inside.all())


def _tuple(values: NDArray[np.float64]) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return (x, y, z)
