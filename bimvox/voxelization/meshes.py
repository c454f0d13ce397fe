"""The meshes of many parts in one set of arrays, and how many go into one batch."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.compiled import kernel
from bimvox.voxelization.lattice import all_rounded

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
