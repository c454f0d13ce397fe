"""One part: its cells, how much of each it fills, and how its interior was found."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.errors import InputError
from bimvox.grid.limits import CELL_LIMIT
from bimvox.voxelize.columns import HEIGHT_LIMIT
from bimvox.voxelize.lattice import STEPS_PER_CELL, cell_range, to_lattice, tolerance_vox
from bimvox.voxelize.limits import require_fit
from bimvox.voxelize.solid import fill_solid
from bimvox.voxelize.surface import mark_surface


@dataclass(frozen=True, slots=True, eq=False)
class PartVoxels:
    """The cells of one part.

    Attributes:
        low: (3,) int64 lattice cell of ``cells[0, 0, 0]``.
        cells: (A, B, C) bool, cells that the part meets: its surface reaches more than the tolerance into them, or they
            lie inside it.
        fractions: (A, B, C) float32, share of the cell that its solid fills, 0..1; 0 where ``cells`` is False. Measured
            on 16 lines a cell, exact along z.
        fill: How the interior was found: ``winding``, ``vote``, ``flood`` or ``surface``.
        solid_volume_m3: Volume of the whole solid: exact for closed meshes that do not cover themselves, else the sum
            of the fractions (inside the clip box).
    """

    low: NDArray[np.int64]
    cells: NDArray[np.bool_]
    fractions: NDArray[np.float32]
    fill: str
    solid_volume_m3: float


def lattice_bounds(mesh: TriangleMesh, voxel_size_m: float, origin_m: ArrayLike) -> NDArray[np.float64]:
    """Return (2, 3) float64: lowest and highest corner of the mesh's triangles in lattice coordinates (cells).

    Raises:
        InputError: If the mesh has no triangles, or a coordinate cannot be used.
    """
    if len(mesh.faces) == 0:
        raise InputError("a mesh without triangles cannot be voxelized")
    corners = to_lattice(mesh.vertices_m, voxel_size_m, origin_m)[mesh.faces.ravel()]
    return np.stack([corners.min(axis=0), corners.max(axis=0)])


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
    on. ``cells`` spans the box of the mesh's bounds. Nothing vanishes: a sheet, or a plate thinner than the tolerance,
    that lies on a border between cells belongs to the cell above.

    Args:
        mesh: Triangles in metres; may be open, inverted, or run through itself.
        voxel_size_m: Edge of a cell, h.
        origin_m: (3,) anchor of the lattice.
        clip: Half-open box of lattice cells (low, high) outside of which nothing is returned.
        cell_limit: Largest number of cells in the part's box.

    Raises:
        InputError: If the mesh has no triangles, a coordinate or the cell size cannot be used, or the part is longer
            than 2^23 cells.
        GridTooLargeError: If the part's box has more cells than ``cell_limit``.
    """
    if len(mesh.faces) == 0:
        raise InputError("a mesh without triangles cannot be voxelized")
    faces = np.ascontiguousarray(mesh.faces, dtype=np.int32)
    vertices = to_lattice(mesh.vertices_m, voxel_size_m, origin_m)
    triangles = vertices[faces]
    bounds = np.stack([triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))])
    part_low, part_high = cell_range(bounds[0], bounds[1], voxel_size_m)
    kept_low, kept_high = part_low, part_high
    if clip is not None:
        kept_low = np.maximum(part_low, np.asarray(clip[0], dtype=np.int64))
        kept_high = np.minimum(part_high, np.asarray(clip[1], dtype=np.int64))
        if np.any(kept_high <= kept_low):
            kept_high = kept_low
    # One cell more than kept: whether a border cell is in the part depends on the cell across the border.
    low, high = np.maximum(part_low, kept_low - 1), np.minimum(part_high, kept_high + 1)
    high = np.maximum(low, high)
    require_fit(low, high, voxel_size_m, cell_limit)
    if max(high - low) > HEIGHT_LIMIT:
        raise InputError(f"the part is more than {HEIGHT_LIMIT:,} cells of {voxel_size_m:g} m long")
    triangles -= low
    tolerance = tolerance_vox(voxel_size_m)
    bits = np.zeros(tuple(high - low), np.uint8)
    fractions = np.zeros(bits.shape, np.float32)
    mark_surface(bits, triangles, tolerance)
    steps = np.rint(vertices * STEPS_PER_CELL).astype(np.int64)
    solid = fill_solid(bits, fractions, triangles, steps, faces, tolerance, part_high - low)
    if not bits.any() and np.array_equal(low, part_low) and np.array_equal(high, part_high):
        bits[tuple(np.clip(np.floor(triangles[0, 0]).astype(np.int64), 0, np.array(bits.shape) - 1))] = 1
    volume = float(fractions.sum(dtype=np.float64)) if solid.volume is None else solid.volume
    kept = tuple(slice(int(a), int(b)) for a, b in zip(kept_low - low, kept_high - low, strict=True))
    np.minimum(bits, 1, out=bits)
    cells, fractions = np.ascontiguousarray(bits[kept]).view(np.bool_), np.ascontiguousarray(fractions[kept])
    return PartVoxels(kept_low, cells, fractions, solid.fill.value, volume * voxel_size_m**3)
