"""One part, or many in one compiled call: its cells, how much of each it fills, and how its interior was found."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.compiled import kernel, leaf_kernel
from bimvox.errors import InputError
from bimvox.grid.frame import CELL_LIMIT
from bimvox.voxelization.bits import CellPlanes, set_run
from bimvox.voxelization.lattice import (
    cell_range,
    lattice_triangles,
    part_triangles,
    require_fit,
    sample_lines,
    tolerance_vox,
)
from bimvox.voxelization.meshes import Meshes, corner_keys, edges_match
from bimvox.voxelization.runs import (
    FilledCells,
    Runs,
    boxes_of_runs,
    dense_cells,
    dense_fractions,
    longer,
    runs_of,
    write_runs,
)
from bimvox.voxelization.solid import HEIGHT_LIMIT, SolidFill, covers_once, fill_columns, fill_solid, signed_volume
from bimvox.voxelization.surface import mark_borders, mark_surface
from bimvox.voxelization.sweep import FULL


@dataclass(frozen=True, slots=True, eq=False)
class PartVoxels:
    """The cells of one part, as runs along z: memory grows with its surface.

    Attributes:
        low: (3,) int64 lattice cell of the lowest corner of its box.
        shape: (A, B, C) cells of its box.
        columns: (A * B, 2) int32, first run of each column of the box, and one past its last. Neighbouring columns that
            are equal have the same runs.
        runs: (R, 3) int32 ``first stop share``: cells first <= k < stop of the column; the index in ``shares`` of the
            first of them, or -1 for cells inside the solid, which are full.
        shares: (S,) uint16, filled share of a cell in 2^-14, measured on 16 lines a cell and exact along z.
        count: Number of cells.
        fill: How the interior was found: ``winding``, ``vote``, ``flood`` or ``surface``.
        solid_volume_m3: Volume of the whole solid: exact for a closed mesh that does not overlap itself, otherwise the
            sum of the fractions (inside the clip box).
    """

    low: NDArray[np.int64]
    shape: tuple[int, int, int]
    columns: NDArray[np.int32]
    runs: NDArray[np.int32]
    shares: NDArray[np.uint16]
    count: int
    fill: str
    solid_volume_m3: float

    @property
    def cells(self) -> NDArray[np.bool_]:
        """(A, B, C) bool, computed on each call: cells that the part meets.

        Its surface reaches more than the tolerance into them, or they lie inside it.
        """
        return dense_cells(self.shape, self.columns, self.runs)

    @property
    def fractions(self) -> NDArray[np.float32]:
        """(A, B, C) float32, computed on each call: filled share of the cell, 0..1; 0 where ``cells`` is False."""
        return dense_fractions(self.shape, self.columns, self.runs, self.shares)

    def boxes(self) -> NDArray[np.int32]:
        """Return (B, 6) disjoint half-open boxes ``x0 y0 z0 x1 y1 z1``, from ``low``, whose union is the part's cells.

        The same as ``bimvox.grid.summed_area.boxes_of`` gives, except for parts of very many runs (``run_boxes.py``).
        """
        return boxes_of_runs(self.columns, self.runs, self.shape[0], self.shape[1])


def voxelize_mesh(
    mesh: TriangleMesh,
    voxel_size_m: float,
    origin_m: ArrayLike = (0.0, 0.0, 0.0),
    *,
    clip: tuple[ArrayLike, ArrayLike] | None = None,
    cell_limit: int = CELL_LIMIT,
) -> PartVoxels:
    """Voxelize one mesh: its surface and its solid.

    The lattice is anchored in the world, not at the mesh: cell (i, j, k) covers ``origin_m + h * [i, i + 1)`` and so
    on. The part's box spans the mesh's bounds. A sheet, or a plate thinner than the tolerance, on a border between
    cells belongs to the cell above, so nothing disappears.

    Args:
        mesh: Triangles in metres; may be open, inverted or self-intersecting.
        voxel_size_m: Edge of a cell, h.
        origin_m: (3,) anchor of the lattice.
        clip: Half-open box of lattice cells (low, high) outside of which nothing is returned.
        cell_limit: Largest number of cells in the part's box.

    Raises:
        InputError: If the mesh has no triangles, a coordinate or the cell size cannot be used, or the part is longer
            than 2^23 cells.
        GridTooLargeError: If the part's box has more cells than ``cell_limit``.
    """
    triangles, bounds = lattice_triangles(mesh.vertices_m, mesh.faces, voxel_size_m, origin_m)
    part_low, part_high = cell_range(bounds[0], bounds[1], voxel_size_m)
    low = kept_low = part_low
    high = kept_high = part_high
    if clip is not None:
        kept_low = np.maximum(part_low, np.asarray(clip[0], dtype=np.int64))
        kept_high = np.minimum(part_high, np.asarray(clip[1], dtype=np.int64))
        if (kept_high <= kept_low).any():
            kept_high = kept_low
        # One more cell on each side: whether a border cell is in the part depends on the cell across the border.
        low, high = np.maximum(part_low, kept_low - 1), np.minimum(part_high, kept_high + 1)
        high = np.maximum(low, high)
    require_fit(low, high, voxel_size_m, cell_limit)
    if max(high - low) > HEIGHT_LIMIT:
        raise InputError(f"the part is more than {HEIGHT_LIMIT:,} cells of {voxel_size_m:g} m long")
    triangles -= low
    a, b, c = (int(n) for n in high - low)
    solid = fill_solid((a, b, c), triangles, tolerance_vox(voxel_size_m), part_high - low)
    if _marks_nothing(solid) and (low == part_low).all() and (high == part_high).all():
        # Smaller than the tolerance, across a corner or an edge of cells: the cell at its middle.
        i, j, k = _cell_of_middle(bounds, low, high)
        set_run(solid.filled.cells.border, i, j, k, k)
    columns, runs, shares, count = runs_of(solid.filled, kept_low - low, kept_high - low)
    volume = solid.volume
    if volume is None:
        full, filled = _filled_of(columns, runs, shares)
        volume = full + filled / FULL
    a, b, c = (int(n) for n in kept_high - kept_low)
    return PartVoxels(kept_low, (a, b, c), columns, runs, shares, count, solid.fill.value, volume * voxel_size_m**3)


def _marks_nothing(solid: SolidFill) -> bool:
    cells = solid.filled.cells
    return len(solid.filled.shares) == 0 and not cells.inside.any() and not cells.border.any()


# Many parts in one compiled call.
#
# Parts with closed meshes are filled by winding (``solid.py``), a whole batch at a time. The batch tells which parts
# are left (open meshes, inverted shells, too large, unusable coordinates): these go one by one through
# ``part.voxelize_mesh``, which gives the same result for every part that is done here.

# Planes of at least this many words are large.
_LARGE_WORDS = 1 << 17


class Batch(NamedTuple):
    """The cells of several parts, their ``PartVoxels`` in one set of arrays; a named tuple, so that kernels accept it.

    Attributes:
        done: (P,) bool, whether the part is here; otherwise its rows mean nothing.
        lows: (P, 3) int64 lattice cell of the lowest corner of its box.
        shapes: (P, 3) int64 cells of its box.
        counts: (P,) int64 number of its cells.
        volumes: (P,) float64 volume of its solid in cells.
        columns: (N, 2) int32, first run of each column, and one past its last, part after part.
        column_starts: (P + 1,) int64 first column of each part.
        runs: (R, 3) int32.
        shares: (S,) uint16.
        boxes: (B, 6) int32 half-open boxes, in cells from the part's lowest corner.
        box_starts: (P + 1,) int64 first box of each part.
    """

    done: NDArray[np.bool_]
    lows: NDArray[np.int64]
    shapes: NDArray[np.int64]
    counts: NDArray[np.int64]
    volumes: NDArray[np.float64]
    columns: NDArray[np.int32]
    column_starts: NDArray[np.int64]
    runs: NDArray[np.int32]
    shares: NDArray[np.uint16]
    boxes: NDArray[np.int32]
    box_starts: NDArray[np.int64]


class _Lattice(NamedTuple):
    """The lattice, and which of its cells are asked for.

    Attributes:
        voxel_size_m: Edge of a cell.
        origin_m: (3,) float64.
        tolerance: In cells.
        clip: (2, 3) int64 half-open box of cells.
        cell_limit: Parts with more cells in their box are left.
    """

    voxel_size_m: float
    origin_m: NDArray[np.float64]
    tolerance: float
    clip: NDArray[np.int64]
    cell_limit: float


class _PartBox(NamedTuple):
    """The cells of one part, each (3,) int64.

    Attributes:
        low: Lowest cell to look at.
        high: One past the highest.
        kept_low: Lowest cell to keep.
        kept_high: One past the highest.
        top: One past the highest cell of the part's whole range, from ``low``.
    """

    low: NDArray[np.int64]
    high: NDArray[np.int64]
    kept_low: NDArray[np.int64]
    kept_high: NDArray[np.int64]
    top: NDArray[np.int64]


@leaf_kernel
def _find_box(bounds: NDArray[np.float64], lattice: _Lattice, box: _PartBox) -> tuple[bool, bool]:
    """Write the cells to look at and to keep, as ``voxelize_mesh`` does.

    Whether there are no more than the limits allow, and whether none is cut off.
    """
    low, high, kept_low, kept_high, top = box
    clip, tolerance = lattice.clip, lattice.tolerance
    cells = 1.0
    whole = True
    nothing = False
    for axis in range(3):
        part_low = int(np.floor(bounds[0, axis] + tolerance))
        part_high = max(int(np.ceil(bounds[1, axis] - tolerance)), part_low + 1)
        kept_low[axis], kept_high[axis] = max(part_low, clip[0, axis]), min(part_high, clip[1, axis])
        nothing = nothing or kept_high[axis] <= kept_low[axis]
        top[axis] = part_high
        low[axis], high[axis] = part_low, part_high
    for axis in range(3):
        if nothing:
            kept_high[axis] = kept_low[axis]
        part_low, part_high = low[axis], high[axis]
        low[axis] = max(part_low, kept_low[axis] - 1)
        high[axis] = max(min(part_high, kept_high[axis] + 1), low[axis])
        whole = whole and low[axis] == part_low and high[axis] == part_high
        top[axis] -= low[axis]
        cells *= float(high[axis] - low[axis])
        if high[axis] - low[axis] > HEIGHT_LIMIT:
            return False, whole
    return cells <= lattice.cell_limit, whole


@leaf_kernel
def _is_empty(plane: NDArray[np.uint64]) -> bool:
    for i in range(plane.shape[0]):
        for j in range(plane.shape[1]):
            for w in range(plane.shape[2]):
                if plane[i, j, w] != 0:
                    return False
    return True


@kernel
def _grown(rows: NDArray[np.int32], used: int, count: int) -> NDArray[np.int32]:
    """Return rows with room for ``count`` more than the ``used`` ones."""
    if used + count <= rows.shape[0]:
        return rows
    more = np.empty((2 * (used + count), rows.shape[1]), np.int32)
    for n in range(used):
        for field in range(rows.shape[1]):
            more[n, field] = rows[n, field]
    return more


@kernel
def _wind_batch(
    meshes: Meshes,
    bounds: NDArray[np.float64],
    lattice: _Lattice,
    samples: NDArray[np.float64],
    planes: NDArray[np.uint64],
    batch: Batch,
) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.uint16], NDArray[np.int32]]:
    """Fill the arrays of ``batch`` with a row for each part; return its columns, runs, shares and boxes.

    ``planes`` (3, A, B, W) are zeros for the planes of the only part, or empty.
    """
    vertices_m, faces, vertex_starts, face_starts = meshes
    done, lows, shapes, counts, volumes = batch.done, batch.lows, batch.shapes, batch.counts, batch.volumes
    column_starts, box_starts = batch.column_starts, batch.box_starts
    # Rooms that grow, shared by all parts of the batch.
    columns = np.empty((1 << 12, 2), np.int32)
    boxes = np.empty((1 << 10, 6), np.int32)
    sums = np.zeros(3, np.int64)
    room = Runs(columns[:0], np.empty((1 << 12, 3), np.int32), np.empty(1 << 14, np.uint16), sums)
    low, high = np.empty(3, np.int64), np.empty(3, np.int64)
    kept_low, kept_high = np.empty(3, np.int64), np.empty(3, np.int64)
    top = np.empty(3, np.int64)
    box = _PartBox(low, high, kept_low, kept_high, top)
    used = found = 0
    for part in range(done.size):
        done[part] = False
        column_starts[part + 1], box_starts[part + 1] = used, found
        # A part without triangles, or with a box that does not fit, is left to the caller: done stays False.
        if not bounds[part, 0, 0] <= bounds[part, 1, 0]:
            continue
        fits, whole = _find_box(bounds[part], lattice, box)
        if not fits:
            continue
        triangles = part_triangles(
            vertices_m[vertex_starts[part] : vertex_starts[part + 1]],
            faces[face_starts[part] : face_starts[part + 1]],
            lattice.voxel_size_m,
            lattice.origin_m,
            low,
        )
        # The cells that its surface meets.
        a, b, c = high[0] - low[0], high[1] - low[1], high[2] - low[2]
        words = (c + 63) // 64
        own_planes = planes if planes.shape[1:] == (a, b, words) else np.zeros((3, a, b, words), np.uint64)
        cells = CellPlanes(own_planes[0], own_planes[1], own_planes[2], c)
        mark_surface(cells, triangles, lattice.tolerance)
        if not edges_match(corner_keys(triangles)):
            continue
        # The cells inside; a surface that leaks, or winds both ways, is left to the caller.
        inverted = np.zeros(triangles.shape[0], np.bool_)
        starts = np.empty(a * b + 1, np.int64)
        closed = np.empty((a, b), np.bool_)
        for i in range(a):
            for j in range(b):
                closed[i, j] = True
        shares, leaks, least, most = fill_columns(cells, triangles, inverted, samples, closed, starts, True)
        if leaks > 0 or least < 0 < most:
            continue
        # The cells on whose border the surface lies; a part that has no cell by now gets that of its middle.
        filled = FilledCells(cells, starts, shares, 0)
        mark_borders(cells, triangles, lattice.tolerance, top)
        if whole and filled.shares.size == 0 and _is_empty(cells.inside) and _is_empty(cells.border):
            x, y, z = _cell_of_middle(bounds[part], low, high)
            set_run(cells.border, x, y, z, z)
        # Write its box, its runs and its share of each cell.
        for axis in range(3):
            lows[part, axis], shapes[part, axis] = kept_low[axis], kept_high[axis] - kept_low[axis]
            kept_low[axis] -= low[axis]
            kept_high[axis] -= low[axis]
        count = shapes[part, 0] * shapes[part, 1]
        columns = _grown(columns, used, count)
        room = Runs(columns[used : used + count], room.rows, room.shares, sums)
        sums[2] = 0
        column = 0
        while column < count:
            column = write_runs(filled, kept_low, kept_high, column, room)
            if column < count:
                room = longer(room, shapes[part, 2])
        counts[part] = sums[2]
        # Its volume: of the mesh if that covers each point at most once, otherwise of the cells.
        if covers_once(least, most):
            volumes[part] = abs(signed_volume(triangles, inverted))
        else:
            full, rest = _filled_of(room.columns, room.rows, room.shares)
            volumes[part] = full + rest / FULL
        # Its boxes, for collisions.
        cut = boxes_of_runs(room.columns, room.rows, shapes[part, 0], shapes[part, 1])
        boxes = _grown(boxes, found, cut.shape[0])
        for n in range(cut.shape[0]):
            for field in range(6):
                boxes[found + n, field] = cut[n, field]
        used += count
        found += cut.shape[0]
        column_starts[part + 1], box_starts[part + 1] = used, found
        done[part] = True
    return columns[:used], room.rows[: sums[0]], room.shares[: sums[1]], boxes[:found]


def _planes_for(
    bounds: NDArray[np.float64], tolerance: float, clip: tuple[NDArray[np.int64], NDArray[np.int64]]
) -> NDArray[np.uint64]:
    """Return planes for a batch's only part if it is large and not cut off: NumPy allocates them in large pages."""
    low, high = np.floor(bounds[0, 0] + tolerance), np.ceil(bounds[0, 1] - tolerance)
    a, b, c = (int(n) for n in high - low) if len(bounds) == 1 and np.isfinite(bounds[0]).all() else (0, 0, 0)
    if a * b * ((c + 63) // 64) < _LARGE_WORDS or np.any(low < clip[0]) or np.any(high > clip[1]):
        return np.empty((3, 0, 0, 0), np.uint64)
    return np.zeros((3, a, b, (c + 63) // 64), np.uint64)


def wind_batch(
    meshes: Meshes,
    bounds: NDArray[np.float64],
    voxel_size_m: float,
    origin_m: NDArray[np.float64],
    *,
    clip: tuple[NDArray[np.int64], NDArray[np.int64]],
    cell_limit: int,
) -> Batch:
    """Voxelize the parts of a batch that winding fills.

    Args:
        meshes: The parts.
        bounds: (P, 2, 3) float64 boxes around them in cells, see ``Meshes.bounds``.
        voxel_size_m: Edge of a cell.
        origin_m: (3,) float64 anchor of the lattice.
        clip: Half-open box of lattice cells (low, high); nothing outside is returned.
        cell_limit: Parts with more cells in their box are left.
    """
    parts = len(bounds)
    tolerance = tolerance_vox(voxel_size_m)
    clip_box = np.stack(clip).astype(np.int64)
    lattice = _Lattice(float(voxel_size_m), origin_m, tolerance, clip_box, float(cell_limit))
    batch = Batch(
        done=np.empty(parts, np.bool_),
        lows=np.empty((parts, 3), np.int64),
        shapes=np.empty((parts, 3), np.int64),
        counts=np.empty(parts, np.int64),
        volumes=np.empty(parts, np.float64),
        columns=np.empty((0, 2), np.int32),
        column_starts=np.zeros(parts + 1, np.int64),
        runs=np.empty((0, 3), np.int32),
        shares=np.empty(0, np.uint16),
        boxes=np.empty((0, 6), np.int32),
        box_starts=np.zeros(parts + 1, np.int64),
    )
    planes = _planes_for(bounds, tolerance, clip)
    columns, runs, shares, boxes = _wind_batch(meshes, bounds, lattice, sample_lines(), planes, batch)
    return batch._replace(columns=columns, runs=runs, shares=shares, boxes=boxes)


@kernel
def _cell_of_middle(
    bounds: NDArray[np.float64], low: NDArray[np.int64], high: NDArray[np.int64]
) -> tuple[int, int, int]:
    """Return the cell in the middle of a (2, 3) box, relative to the cell ``low`` and below ``high``."""
    cell = np.empty(3, np.int64)
    for axis in range(3):
        middle = int(np.floor((bounds[0, axis] + bounds[1, axis]) / 2.0)) - low[axis]
        cell[axis] = min(max(middle, 0), high[axis] - low[axis] - 1)
    return cell[0], cell[1], cell[2]


@kernel
def _filled_of(columns: NDArray[np.int32], runs: NDArray[np.int32], shares: NDArray[np.uint16]) -> tuple[int, int]:
    """Return the number of cells inside, and the sum of the shares of the others."""
    full = total = 0
    for column in range(columns.shape[0]):
        for n in range(columns[column, 0], columns[column, 1]):
            size = runs[n, 1] - runs[n, 0]
            if runs[n, 2] < 0:
                full += size
            else:
                for k in range(size):
                    total += int(np.int64(shares[runs[n, 2] + k]))
    return full, total
