"""Triangles for the page: on a fine lattice, without duplicates, equal shapes once, with the visible edges."""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.records.declared import Count

FINEST_M = 0.001
_COARSER = (1, 2, 5, 10, 20, 50, 100)
"""Multiples of the finest lattice, tried in turn until the shapes fit the budget."""
_STEPS = 65_535
_FLAT_COS = 0.94
"""Cosine (20 degrees) above which two faces count as flat: the edge between them is not drawn."""


@dataclass(frozen=True, slots=True, eq=False)
class _Geometry:
    """A shape on a lattice, its lowest corner at the origin.

    Attributes:
        step_m: Spacing of the lattice.
        points: (V, 3) uint16 lattice points, distinct.
        faces: (F, 3) uint32 indices into ``points``, none degenerate.
        edges: (E, 2) uint32 indices: borders, and where faces meet at an angle.
    """

    step_m: float
    points: NDArray[np.uint16]
    faces: NDArray[np.uint32]
    edges: NDArray[np.uint32]

    @property
    def key(self) -> tuple[float, bytes, bytes]:
        """Key that equal shapes share."""
        return (self.step_m, self.points.tobytes(), self.faces.tobytes())


@dataclass(frozen=True, slots=True, eq=False)
class Shapes:
    """Distinct shapes, and which mesh has which.

    Attributes:
        geometries: The distinct ones, in order of first use.
        of_mesh: (M,) index into them for every mesh.
        low_m: (M, 3) lowest corner of every mesh.
        step_m: The finest lattice used.
    """

    geometries: tuple[_Geometry, ...]
    of_mesh: tuple[int, ...]
    low_m: NDArray[np.float64]
    step_m: float


def shapes_of(meshes: Sequence[TriangleMesh], budget_bytes: int) -> Shapes:
    """Return meshes on the finest lattice whose compressed size is within a budget; the coarsest may exceed it."""
    for times in _COARSER:
        made = [geometry_of(mesh, times * FINEST_M) for mesh in meshes]
        found: dict[tuple[float, bytes, bytes], int] = {}
        distinct: list[_Geometry] = []
        of_mesh = []
        for geometry in made:
            if geometry.key not in found:
                found[geometry.key] = len(distinct)
                distinct.append(geometry)
            of_mesh.append(found[geometry.key])
        size = sum(len(zlib.compress(g.points.tobytes() + g.faces.tobytes() + g.edges.tobytes())) for g in distinct)
        if size <= budget_bytes:
            break
    low_m = np.array([mesh.bounds_m[0] for mesh in meshes]).reshape(-1, 3)
    return Shapes(tuple(distinct), tuple(of_mesh), low_m, times * FINEST_M)


def geometry_of(mesh: TriangleMesh, step_m: float) -> _Geometry:
    """Return a mesh on a lattice of ``step_m``, or a coarser one if the mesh is too large for 16 bits."""
    low_m, high_m = mesh.bounds_m
    step_m = max(step_m, float((high_m - low_m).max()) / _STEPS)
    used, faces = np.unique(mesh.faces, return_inverse=True)
    lattice = np.rint((mesh.vertices_m[used] - low_m) / step_m).astype(np.uint16)
    points, place = np.unique(lattice, axis=0, return_inverse=True)
    corners = place.reshape(-1)[faces.reshape(-1, 3)]
    a, b, c = corners.T
    corners = corners[(a != b) & (b != c) & (c != a)]
    _, first = np.unique(np.sort(corners, axis=1), axis=0, return_index=True)
    corners = corners[np.sort(first)]
    return _Geometry(step_m, points, corners.astype(np.uint32), _edges(points, corners).astype(np.uint32))


def _edges(points: NDArray[np.uint16], faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the (E, 2) edges of a single face, or of faces in different planes."""
    if not len(faces):
        return np.zeros((0, 2), np.int64)
    at = points.astype(np.float64)[faces]
    normals = np.cross(at[:, 1] - at[:, 0], at[:, 2] - at[:, 0])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.divide(normals, length, out=np.zeros_like(normals), where=length > 0.0)
    sides = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    owner = np.repeat(np.arange(len(faces)), 3)
    order = np.lexsort((owner, sides[:, 1], sides[:, 0]))
    sides, owner = sides[order], owner[order]
    first = np.r_[True, (np.diff(sides, axis=0) != 0).any(axis=1)]
    group = np.cumsum(first) - 1
    # The sign of a normal is ignored: some sources flip faces.
    along = np.abs(np.einsum("ij,ij->i", normals[owner], normals[owner[first][group]]))
    bent = np.zeros(group[-1] + 1, np.bool_)
    np.logical_or.at(bent, group, along < _FLAT_COS)
    alone = np.bincount(group) == 1
    edges: NDArray[np.int64] = sides[first][bent | alone]
    return edges


# Arrays as one block of bytes that a browser reads as typed arrays; equal arrays are stored once.

_ALIGNMENT = 4
_CODES = {"uint8": "u8", "uint16": "u16", "uint32": "u32", "int32": "i32", "float32": "f32"}

_Reference = list[int | str]
"""Type code, offset in bytes, number of values."""
NUMBERS: Any = tuple[Literal["u8", "u16", "u32", "i32", "f32"], Count, Count]
"""The type of a reference."""
COLOUR: Any = tuple[Count, Count, Count]


class Blob:
    """Collects arrays."""

    def __init__(self) -> None:
        self._bytes = bytearray()
        self._known: dict[tuple[str, bytes], _Reference] = {}

    def put(self, array: NDArray[Any]) -> _Reference:
        """Add an array of uint8, uint16, uint32, int32 or float32, of any shape; return a reference to it."""
        code = _CODES[array.dtype.name]
        data = np.ascontiguousarray(array, array.dtype.newbyteorder("<")).tobytes()
        if (code, data) not in self._known:
            self._bytes += bytes(-len(self._bytes) % _ALIGNMENT)
            self._known[code, data] = [code, len(self._bytes), array.size]
            self._bytes += data
        return self._known[code, data]

    def put_steps(self, rows: NDArray[np.int64]) -> _Reference:
        """Add (N, C) integers column by column, delta-encoded, which compresses well."""
        steps = np.diff(rows, axis=0, prepend=np.zeros((1, rows.shape[1]), np.int64))
        if steps.size and np.abs(steps).max() > np.iinfo(np.int32).max:
            raise OverflowError("a step does not fit 32 bits")
        return self.put(steps.T.astype(np.int32))

    def to_bytes(self) -> bytes:
        """Return all bytes so far."""
        return bytes(self._bytes)


def rounded(values: Iterable[float]) -> list[float]:
    """Return values for JSON, with six decimals and without negative zeros."""
    return [round(float(value), 6) + 0.0 for value in values]
