"""Is a mesh closed, how open is it, and do its shells face outward?"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.voxelization.lattice import STEPS_PER_CELL

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

    Args:
        keys: (F, 3) uint64, of the corners.
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
