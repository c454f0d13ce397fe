"""Many parts in one call: what most parts need, without a step of the interpreter for each.

A part whose mesh is closed is filled by winding (``solid.py``), and that is done here for a whole batch. The parts that
are left (open meshes, shells inside out, too large, coordinates that cannot be used) are told, and go one by one
through ``part.voxelize_mesh``, which gives the same for every part that is done here.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.compiled import kernel, leaf_kernel
from bimvox.voxelization.bits import set_run
from bimvox.voxelization.columns import HEIGHT_LIMIT
from bimvox.voxelization.lattice import cell_of_middle, lattice_bounds_of, part_triangles, tolerance_vox
from bimvox.voxelization.run_boxes import boxes_of_runs
from bimvox.voxelization.runs import filled_of, longer_runs, longer_shares, write_runs
from bimvox.voxelization.samples import sample_lines
from bimvox.voxelization.solid import covers_once, wind
from bimvox.voxelization.sweep import FULL

_TRIANGLES = 1 << 14
_COLUMNS = 1 << 17
"""A batch is full when it has so many triangles, or columns of cells in its parts' boxes, but for repeats."""
_LARGE_WORDS = 1 << 17
"""Planes of so many words are large."""
_PARTS = 1 << 12
"""Or so many parts, repeats among them."""


@dataclass(frozen=True, slots=True, eq=False)
class Meshes:
    """Several meshes in one set of arrays.

    Attributes:
        vertices_m: (V, 3) float64.
        faces: (F, 3) int32, into the vertices of their own mesh.
        vertex_starts: (P + 1,) int64, the first vertex of each mesh, and the number of vertices.
        face_starts: (P + 1,) int64, the first face of each mesh, and the number of faces.
    """

    vertices_m: NDArray[np.float64]
    faces: NDArray[np.int32]
    vertex_starts: NDArray[np.int64]
    face_starts: NDArray[np.int64]

    @classmethod
    def of(cls, meshes: Sequence[TriangleMesh]) -> Meshes:
        """Put meshes one after the other."""
        vertices = [mesh.vertices_m for mesh in meshes]
        faces = [mesh.faces for mesh in meshes]
        starts = np.zeros((2, len(meshes) + 1), np.int64)
        np.cumsum([len(rows) for rows in vertices], out=starts[0, 1:])
        np.cumsum([len(rows) for rows in faces], out=starts[1, 1:])
        return cls(
            np.concatenate(vertices, dtype=np.float64, casting="unsafe").reshape(-1, 3),
            np.concatenate(faces, dtype=np.int32, casting="unsafe").reshape(-1, 3),
            starts[0],
            starts[1],
        )

    def bounds(self, voxel_size_m: float, origin_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (P, 2, 3) float64 boxes around the meshes' triangles in cells; NaN where a mesh cannot be used."""
        return lattice_bounds_of(
            self.vertices_m, self.faces, self.vertex_starts, self.face_starts, float(voxel_size_m), origin_m
        )


@dataclass(frozen=True, slots=True, eq=False)
class Batch:
    """The cells of several parts; ``PartVoxels`` of all of them in one set of arrays.

    Attributes:
        done: (P,) bool, whether a part is here; else its rows mean nothing.
        lows: (P, 3) int64 lattice cell of the lowest corner of its box.
        shapes: (P, 3) int64 cells of its box.
        counts: (P,) int64 number of its cells.
        volumes: (P,) float64 volume of its solid in cells.
        columns: (N, 2) int32, the first run of each column, and one past its last, part after part.
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

    def boxes_of(self, part: int) -> NDArray[np.int32]:
        """Return the boxes of a part, (B, 6), from its lowest corner."""
        return self.boxes[self.box_starts[part] : self.box_starts[part + 1]]


def batches_of(
    triangles: Sequence[int], lows: NDArray[np.int64], highs: NDArray[np.int64], kinds: Sequence[int] | None = None
) -> list[range]:
    """Cut a list of parts into batches, so that what is held at once does not grow with the model.

    Args:
        triangles: Number of each part's triangles.
        lows: (P, 3) lowest cell of each part's box.
        highs: (P, 3) one past its highest cell.
        kinds: A number for each part; parts of one number repeat each other (``repeats.py``), and count once a batch.
    """
    sizes = highs - lows
    columns = (sizes[:, 0].astype(np.float64) * sizes[:, 1]).tolist()
    batches = []
    first, faces, area = 0, 0, 0.0
    seen: set[int] = set()
    for part, count in enumerate(triangles):
        if kinds is not None and kinds[part] in seen and part - first < _PARTS:
            continue
        if part > first and (faces + count > _TRIANGLES or area + columns[part] > _COLUMNS or part - first >= _PARTS):
            batches.append(range(first, part))
            first, faces, area = part, 0, 0.0
            seen.clear()
        if kinds is not None:
            seen.add(kinds[part])
        faces += count
        area += columns[part]
    batches.append(range(first, len(triangles)))
    return batches


@leaf_kernel
def _box_of_part(
    bounds: NDArray[np.float64],
    tolerance: float,
    clip: NDArray[np.int64],
    cell_limit: float,
    low: NDArray[np.int64],
    high: NDArray[np.int64],
    kept_low: NDArray[np.int64],
    kept_high: NDArray[np.int64],
    top: NDArray[np.int64],
) -> tuple[bool, bool]:
    """Find the cells to look at and those to keep, as ``voxelize_mesh`` does; says if they can be, and if none is cut.

    ``top`` is one past the highest cell of the part's whole range, from ``low``.
    """
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
    return cells <= cell_limit, whole


@leaf_kernel
def _is_empty(plane: NDArray[np.uint64]) -> bool:
    for i in range(plane.shape[0]):
        for j in range(plane.shape[1]):
            for w in range(plane.shape[2]):
                if plane[i, j, w] != 0:
                    return False
    return True


@kernel
def _wind_batch(
    vertices_m: NDArray[np.float64],
    faces: NDArray[np.int32],
    vertex_starts: NDArray[np.int64],
    face_starts: NDArray[np.int64],
    bounds: NDArray[np.float64],
    voxel_size_m: float,
    origin_m: NDArray[np.float64],
    tolerance: float,
    clip: NDArray[np.int64],
    cell_limit: float,
    samples: NDArray[np.float64],
    planes: NDArray[np.uint64],
    done: NDArray[np.bool_],
    lows: NDArray[np.int64],
    shapes: NDArray[np.int64],
    counts: NDArray[np.int64],
    volumes: NDArray[np.float64],
    column_starts: NDArray[np.int64],
    box_starts: NDArray[np.int64],
) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.uint16], NDArray[np.int32]]:
    """Fill the arrays of a ``Batch`` that are given; returns its columns, runs, shares and boxes.

    ``planes`` (3, A, B, W) are zeros for the planes of the only part, or empty.
    """
    columns = np.empty((1 << 12, 2), np.int32)
    runs = np.empty((1 << 12, 3), np.int32)
    shares = np.empty(1 << 14, np.uint16)
    boxes = np.empty((1 << 10, 6), np.int32)
    sums = np.zeros(3, np.int64)
    low, high = np.empty(3, np.int64), np.empty(3, np.int64)
    kept_low, kept_high = np.empty(3, np.int64), np.empty(3, np.int64)
    top = np.empty(3, np.int64)
    used = found = 0
    for part in range(done.size):
        done[part] = False
        column_starts[part + 1], box_starts[part + 1] = used, found
        if not bounds[part, 0, 0] <= bounds[part, 1, 0]:
            continue
        fits, whole = _box_of_part(
            bounds[part], tolerance, clip, cell_limit, low, high, kept_low, kept_high, top
        )  # fmt: skip
        if not fits:
            continue
        triangles = part_triangles(
            vertices_m[vertex_starts[part] : vertex_starts[part + 1]],
            faces[face_starts[part] : face_starts[part + 1]],
            voxel_size_m,
            origin_m,
            low,
        )
        a, b, c = high[0] - low[0], high[1] - low[1], high[2] - low[2]
        words = (c + 63) // 64
        own_planes = planes if planes.shape[1:] == (a, b, words) else np.zeros((3, a, b, words), np.uint64)
        met, inside, border = own_planes[0], own_planes[1], own_planes[2]
        closes, starts, part_shares, least, most, volume = wind(
            met, inside, border, c, triangles, samples, tolerance, top
        )
        if not closes:
            continue
        if whole and part_shares.size == 0 and _is_empty(inside) and _is_empty(border):
            x, y, z = cell_of_middle(bounds[part], low, high)
            set_run(border, x, y, z, z)
        for axis in range(3):
            lows[part, axis], shapes[part, axis] = kept_low[axis], kept_high[axis] - kept_low[axis]
            kept_low[axis] -= low[axis]
            kept_high[axis] -= low[axis]
        count = shapes[part, 0] * shapes[part, 1]
        if used + count > columns.shape[0]:
            longer = np.empty((2 * (used + count), 2), np.int32)
            longer[:used] = columns[:used]
            columns = longer
        own = columns[used : used + count]
        sums[2] = 0
        column = 0
        while column < count:
            column = write_runs(
                met, inside, border, starts, part_shares, 0, kept_low, kept_high, column, own, runs, shares, sums
            )
            if column < count:
                runs = longer_runs(runs, sums[0], 2 * sums[0] + shapes[part, 2] + 1)
                shares = longer_shares(shares, sums[1], 2 * sums[1] + shapes[part, 2])
        counts[part] = sums[2]
        if not covers_once(least, most):
            full, filled = filled_of(own, runs, shares)
            volume = full + filled / FULL
        volumes[part] = volume
        cut = boxes_of_runs(own, runs, shapes[part, 0], shapes[part, 1])
        if found + cut.shape[0] > boxes.shape[0]:
            more = np.empty((2 * (found + cut.shape[0]), 6), np.int32)
            more[:found] = boxes[:found]
            boxes = more
        boxes[found : found + cut.shape[0]] = cut
        used += count
        found += cut.shape[0]
        column_starts[part + 1], box_starts[part + 1] = used, found
        done[part] = True
    return columns[:used], runs[: sums[0]], shares[: sums[1]], boxes[:found]


def _planes_for(
    bounds: NDArray[np.float64], tolerance: float, clip: tuple[NDArray[np.int64], NDArray[np.int64]]
) -> NDArray[np.uint64]:
    """Return the planes of a batch's only part where it is large and not cut: NumPy gets them in large pages."""
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
        clip: Half-open box of lattice cells (low, high) outside of which nothing is returned.
        cell_limit: Parts with more cells in their box are left.
    """
    parts = len(bounds)
    done = np.empty(parts, np.bool_)
    lows, shapes = np.empty((parts, 3), np.int64), np.empty((parts, 3), np.int64)
    counts, volumes = np.empty(parts, np.int64), np.empty(parts, np.float64)
    column_starts, box_starts = np.zeros(parts + 1, np.int64), np.zeros(parts + 1, np.int64)
    columns, runs, shares, boxes = _wind_batch(
        meshes.vertices_m,
        meshes.faces,
        meshes.vertex_starts,
        meshes.face_starts,
        bounds,
        float(voxel_size_m),
        origin_m,
        tolerance_vox(voxel_size_m),
        np.stack(clip).astype(np.int64),
        float(cell_limit),
        sample_lines(),
        _planes_for(bounds, tolerance_vox(voxel_size_m), clip),
        done,
        lows,
        shapes,
        counts,
        volumes,
        column_starts,
        box_starts,
    )
    return Batch(done, lows, shapes, counts, volumes, columns, column_starts, runs, shares, boxes, box_starts)
