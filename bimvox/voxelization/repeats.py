"""Parts that repeat each other: the same triangles, moved by whole cells.

The lattice is anchored in the world and coordinates are whole steps of it, so the cells of such parts are the same to
the last bit, moved by as many cells. They are computed once: storeys, frames and columns on a grid repeat often.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import inline_kernel, kernel
from bimvox.voxelization.lattice import STEPS_PER_CELL, rounded
from bimvox.voxelization.meshes import Meshes

# Odd numbers: the fractions of the golden ratio, sqrt(2) and sqrt(3), and the mixers of MurmurHash3.
_BY_A = np.uint64(0x9E3779B97F4A7C15)
_BY_B = np.uint64(0x6A09E667F3BCC909)
_BY_C = np.uint64(0xBB67AE8584CAA73B)
_MIX_A = np.uint64(0xFF51AFD7ED558CCD)
_MIX_B = np.uint64(0xC4CEB9FE1A85EC53)
_HIGH = np.uint64(32)
_STEPS = STEPS_PER_CELL


@inline_kernel
def _mixed(one: np.uint64, two: np.uint64, value: np.uint64) -> tuple[np.uint64, np.uint64]:
    """Return both halves of a 128-bit key with a number mixed in."""
    one, two = (one ^ value) * _MIX_A, (two + value) * _MIX_B
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
        one, two = _mixed(_BY_A, _BY_B, np.uint64(vertex_starts[mesh + 1] - vertex_starts[mesh]))
        usable = True
        for vertex in range(vertex_starts[mesh], vertex_starts[mesh + 1]):
            for axis in range(3):
                at = rounded(vertices_m[vertex, axis], origin_m[axis], voxel_size_m) - lows[mesh, axis]
                usable = usable and at == at
                one, two = _mixed(one, two, np.uint64(np.int64(at * _STEPS)) if usable else np.uint64(0))
        for face in range(face_starts[mesh], face_starts[mesh + 1]):
            a, b, c = np.uint64(faces[face, 0]), np.uint64(faces[face, 1]), np.uint64(faces[face, 2])
            one, two = _mixed(one, two, a * _BY_A + b * _BY_B + c * _BY_C)
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
