"""One part: its cells, how much of each it fills, and how its interior was found."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.errors import InputError
from bimvox.grid.limits import CELL_LIMIT
from bimvox.voxelization.bits import set_run
from bimvox.voxelization.columns import HEIGHT_LIMIT
from bimvox.voxelization.lattice import cell_of_middle, cell_range, lattice_triangles, tolerance_vox
from bimvox.voxelization.limits import require_fit
from bimvox.voxelization.run_boxes import boxes_of_runs
from bimvox.voxelization.runs import dense_cells, dense_fractions, filled_of, runs_of
from bimvox.voxelization.solid import SolidFill, fill_solid
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

        The same as ``bimvox.grid.boxes.boxes_of`` gives, except for parts of very many runs (``run_boxes.py``).
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
        i, j, k = cell_of_middle(bounds, low, high)
        set_run(solid.filled.cells.border, i, j, k, k)
    columns, runs, shares, count = runs_of(solid.filled, kept_low - low, kept_high - low)
    volume = solid.volume
    if volume is None:
        full, filled = filled_of(columns, runs, shares)
        volume = full + filled / FULL
    a, b, c = (int(n) for n in kept_high - kept_low)
    return PartVoxels(kept_low, (a, b, c), columns, runs, shares, count, solid.fill.value, volume * voxel_size_m**3)


def _marks_nothing(solid: SolidFill) -> bool:
    cells = solid.filled.cells
    return len(solid.filled.shares) == 0 and not cells.inside.any() and not cells.border.any()
