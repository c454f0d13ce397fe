"""The meshes of many parts in one set of arrays: batches, which meshes are closed, which repeat each other."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.compiled import inline_kernel, kernel, leaf_kernel
from bimvox.voxelization.lattice import STEPS_PER_CELL, all_rounded, rounded

# A batch is full when it has this many triangles, columns of cells in its parts' boxes (both without repeats), or
# parts (repeats included).
_TRIANGLES = 1 << 14
_COLUMNS = 1 << 17
_PARTS = 1 << 12


class Meshes(NamedTuple):
    """Several meshes in one set of arrays.

    Attributes:
        vertices_m: (V, 3) float64.
        faces: (F, 3) int32, indices into the vertices of their own mesh.
        vertex_starts: (P + 1,) int64, first vertex of each mesh, and the number of vertices.
        face_starts: (P + 1,) int64, first face of each mesh, and the number of faces.
    """

    vertices_m: NDArray[np.float64]
    faces: NDArray[np.int32]
    vertex_starts: NDArray[np.int64]
    face_starts: NDArray[np.int64]

    @classmethod
    def of(cls, meshes: Sequence[TriangleMesh]) -> Meshes:
        """Return meshes one after the other."""
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
        """Return (P, 2, 3) float64 boxes around the meshes' triangles in cells; NaN for a mesh that cannot be used."""
        bounds: NDArray[np.float64] = _bounds_of(self, float(voxel_size_m), origin_m)
        return bounds


@kernel
def _bounds_of(meshes: Meshes, voxel_size_m: float, origin_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the boxes of `Meshes.bounds`."""
    vertices_m, faces, vertex_starts, face_starts = meshes
    bounds = np.empty((face_starts.size - 1, 2, 3), np.float64)
    for mesh in range(bounds.shape[0]):
        points = all_rounded(vertices_m[vertex_starts[mesh] : vertex_starts[mesh + 1]], origin_m, voxel_size_m)
        for axis in range(3):
            bounds[mesh, 0, axis], bounds[mesh, 1, axis] = np.inf, -np.inf
        usable = face_starts[mesh] < face_starts[mesh + 1]
        for f in range(face_starts[mesh], face_starts[mesh + 1]):
            for corner in range(3):
                vertex = faces[f, corner]
                for axis in range(3):
                    at = points[vertex, axis]
                    bounds[mesh, 0, axis] = min(bounds[mesh, 0, axis], at)
                    bounds[mesh, 1, axis] = max(bounds[mesh, 1, axis], at)
                    usable = usable and at == at
        for axis in range(3):
            if not usable:
                bounds[mesh, 0, axis] = bounds[mesh, 1, axis] = np.nan
    return bounds


def batches_of(
    triangles: Sequence[int], lows: NDArray[np.int64], highs: NDArray[np.int64], kinds: Sequence[int] | None = None
) -> list[range]:
    """Split a list of parts into batches, so that the memory in use does not grow with the building.

    Args:
        triangles: Number of triangles of each part.
        lows: (P, 3) lowest cell of each part's box.
        highs: (P, 3) one past its highest cell.
        kinds: A number for each part; parts of one number repeat each other (``repeats.py``) and count once per batch.
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


_MIX_A = np.uint64(0xBF58476D1CE4E5B9)
_MIX_B = np.uint64(0x94D049BB133111EB)
_STEP = np.uint64(0x9E3779B97F4A7C15)
_S27 = np.uint64(27)
_S30 = np.uint64(30)
_S31 = np.uint64(31)
# Positions differ by whole steps of the lattice.
_STEPS = STEPS_PER_CELL


@leaf_kernel
def _mixed(value: np.uint64) -> np.uint64:
    """Return a 64-bit hash (SplitMix64, Steele et al. 2014)."""
    value = value + _STEP
    value = (value ^ (value >> _S30)) * _MIX_A
    value = (value ^ (value >> _S27)) * _MIX_B
    return value ^ (value >> _S31)


@kernel
def corner_keys(triangles: NDArray[np.float64]) -> NDArray[np.uint64]:
    """Return a 64-bit key of each corner's position: (F, 3, 3) -> (F, 3) uint64; equal positions get equal keys.

    Corners are compared by position, so meshes need not be welded.
    """
    keys = np.empty((triangles.shape[0], 3), np.uint64)
    for f in range(triangles.shape[0]):
        for corner in range(3):
            key = np.uint64(0)
            for axis in range(3):
                key = _mixed(key ^ np.uint64(np.int64(np.rint(triangles[f, corner, axis] * _STEPS))))
            keys[f, corner] = key
    return keys


@kernel
def edges_match(keys: NDArray[np.uint64]) -> bool:
    """Return whether every directed edge has its opposite: the mesh is closed and consistently oriented.

    Sums a pseudo-random number per edge, negative in the other direction: zero if and only if all edges cancel (with an
    error probability of about 2^-64).

    ``keys``: (F, 3) uint64, of the corners.
    """
    total = np.uint64(0)
    for f in range(keys.shape[0]):
        for corner in range(3):
            a, b = keys[f, corner], keys[f, (corner + 1) % 3]
            if a < b:
                total += _mixed(a ^ _mixed(b))
            elif b < a:
                total -= _mixed(b ^ _mixed(a))
    return bool(total == np.uint64(0))


@kernel
def openness(triangles: NDArray[np.float64]) -> float:
    """Return the share of the surface that faces no other surface: 0 for a closed mesh, 1 for a flat sheet.

    The length of the sum of the area vectors, over the sum of their lengths.
    """
    sum_x = sum_y = sum_z = whole = 0.0
    for f in range(triangles.shape[0]):
        p = triangles[f]
        ux, uy, uz = p[1, 0] - p[0, 0], p[1, 1] - p[0, 1], p[1, 2] - p[0, 2]
        vx, vy, vz = p[2, 0] - p[0, 0], p[2, 1] - p[0, 1], p[2, 2] - p[0, 2]
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        sum_x, sum_y, sum_z = sum_x + nx, sum_y + ny, sum_z + nz
        whole += np.sqrt(nx * nx + ny * ny + nz * nz)
    return float(np.sqrt(sum_x * sum_x + sum_y * sum_y + sum_z * sum_z)) / whole if whole > 0.0 else 1.0


@kernel
def _shells(faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the shell of each face, named by one of its vertices; faces that share a vertex are in one shell."""
    parent = np.arange(faces.max() + 1)
    for f in range(faces.shape[0]):
        root = faces[f, 0]
        while parent[root] != root:
            parent[root] = parent[parent[root]]
            root = parent[root]
        for corner in range(1, 3):
            other = faces[f, corner]
            while parent[other] != other:
                parent[other] = parent[parent[other]]
                other = parent[other]
            parent[max(root, other)] = min(root, other)
            root = min(root, other)
    shells = np.empty(faces.shape[0], np.int64)
    for f in range(faces.shape[0]):
        root = faces[f, 0]
        while parent[root] != root:
            root = parent[root]
        shells[f] = root
    return shells


def inverted_faces(triangles: NDArray[np.float64], keys: NDArray[np.uint64]) -> NDArray[np.bool_]:
    """Return (F,) bool: the faces of inverted shells.

    A shell of negative volume counts as a cavity, and is not inverted, if its box lies inside the box of a shell of
    larger, positive volume.
    """
    faces = np.unique(keys, return_inverse=True)[1].reshape(-1, 3).astype(np.int64)
    shells = np.unique(_shells(faces), return_inverse=True)[1]
    count = int(shells.max()) + 1
    centre = triangles.mean(axis=(0, 1))
    a, b, c = np.moveaxis(triangles - centre, 1, 0)
    volumes = np.bincount(shells, np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0, count)
    low = np.full((count, 3), np.inf)
    high = np.full((count, 3), -np.inf)
    np.minimum.at(low, shells, triangles.min(axis=1))
    np.maximum.at(high, shells, triangles.max(axis=1))
    flip = np.zeros(count, np.bool_)
    for shell in np.flatnonzero(volumes < 0.0):
        around = (low <= low[shell]).all(axis=1) & (high >= high[shell]).all(axis=1)
        flip[shell] = not np.any(around & (volumes > -volumes[shell]))
    result: NDArray[np.bool_] = flip[shells]
    return result


# Parts that repeat each other: the same triangles, moved by whole cells.
#
# The lattice is anchored in the world and coordinates are whole steps of it, so the cells of such parts are the same to
# the last bit, moved by as many cells. They are computed once: storeys, frames and columns on a grid repeat often.

# Odd numbers: the fractions of the golden ratio, sqrt(2) and sqrt(3), and the mixers of MurmurHash3.
_BY_A = np.uint64(0x9E3779B97F4A7C15)
_BY_B = np.uint64(0x6A09E667F3BCC909)
_BY_C = np.uint64(0xBB67AE8584CAA73B)
_PAIR_MIX_A = np.uint64(0xFF51AFD7ED558CCD)
_PAIR_MIX_B = np.uint64(0xC4CEB9FE1A85EC53)
_HIGH = np.uint64(32)


@inline_kernel
def _mixed_pair(one: np.uint64, two: np.uint64, value: np.uint64) -> tuple[np.uint64, np.uint64]:
    """Return both halves of a 128-bit key with a number mixed in."""
    one, two = (one ^ value) * _PAIR_MIX_A, (two + value) * _PAIR_MIX_B
    return one ^ (one >> _HIGH), two ^ (two >> _HIGH)


@kernel
def part_keys(
    meshes: Meshes, voxel_size_m: float, origin_m: NDArray[np.float64], lows: NDArray[np.int64]
) -> NDArray[np.uint64]:
    """Return a 128-bit key of each mesh, (P, 2) uint64, from its triangles relative to the cell ``lows`` (P, 3).

    Meshes with equal keys are the same, moved by whole cells (with an error probability of about 2^-128 per pair). The
    key is 0, 0 if a vertex is unusable.
    """
    vertices_m, faces, vertex_starts, face_starts = meshes
    keys = np.zeros((lows.shape[0], 2), np.uint64)
    for mesh in range(lows.shape[0]):
        one, two = _mixed_pair(_BY_A, _BY_B, np.uint64(vertex_starts[mesh + 1] - vertex_starts[mesh]))
        usable = True
        for vertex in range(vertex_starts[mesh], vertex_starts[mesh + 1]):
            for axis in range(3):
                at = rounded(vertices_m[vertex, axis], origin_m[axis], voxel_size_m) - lows[mesh, axis]
                usable = usable and at == at
                one, two = _mixed_pair(one, two, np.uint64(np.int64(at * _STEPS)) if usable else np.uint64(0))
        for face in range(face_starts[mesh], face_starts[mesh + 1]):
            a, b, c = np.uint64(faces[face, 0]), np.uint64(faces[face, 1]), np.uint64(faces[face, 2])
            one, two = _mixed_pair(one, two, a * _BY_A + b * _BY_B + c * _BY_C)
        if usable:
            keys[mesh, 0], keys[mesh, 1] = one, two
    return keys


def kinds_of(keys: NDArray[np.uint64], alone: NDArray[np.bool_]) -> list[int]:
    """Return the first part that each part repeats; the part itself if it repeats none.

    Args:
        keys: (P, 2) uint64, see ``part_keys``.
        alone: (P,) bool, parts that repeat no other: the grid cuts them off, each differently.
    """
    firsts: dict[tuple[int, int], int] = {}
    unlike = (alone | ~np.any(keys, axis=1)).tolist()
    pairs = zip(keys[:, 0].tolist(), keys[:, 1].tolist(), strict=True)
    return [part if unlike[part] else firsts.setdefault(pair, part) for part, pair in enumerate(pairs)]


def grouped(kinds: Iterable[int]) -> tuple[list[int], NDArray[np.int64]]:
    """Return the numbers of the distinct parts, and for each part its position in that list."""
    places: dict[int, int] = {}
    firsts: list[int] = []
    at: list[int] = []
    for n, kind in enumerate(kinds):
        if kind not in places:
            places[kind] = len(firsts)
            firsts.append(n)
        at.append(places[kind])
    return firsts, np.array(at, np.int64)
