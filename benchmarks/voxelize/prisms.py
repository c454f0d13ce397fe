"""Closed solids from a few numbers: straight prisms over rectangles with holes, over polygons, and pipes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.bim.building import TriangleMesh

# A rectangle's corners in order, its two triangles, and the steps to the neighbour across each of its edges.
_CORNERS = ((0, 0), (1, 0), (1, 1), (0, 1))
_ACROSS = ((0, -1), (1, 0), (0, 1), (-1, 0))


def lattice_prism(
    xs: Sequence[float], ys: Sequence[float], filled: ArrayLike, bottom: float, top: float
) -> TriangleMesh:
    """Extrude the filled rectangles of a lattice along z: slabs with openings, walls, steps, rolled sections.

    Every rectangle is cut at all the lattice's lines, so no corner lies on another's edge: the mesh is closed.

    Args:
        xs: (A + 1,) ascending positions of the lattice's lines, metres.
        ys: (B + 1,) the same in y.
        filled: (A, B) bool; filled rectangles must not touch at a corner only.
        bottom: Lowest z, metres.
        top: Highest z, metres.
    """
    full = np.pad(np.asarray(filled, dtype=np.bool_), 1)
    number: dict[tuple[int, int, int], int] = {}
    faces: list[tuple[int, int, int]] = []

    def vertex(i: int, j: int, k: int) -> int:
        return number.setdefault((i, j, k), len(number))

    for i, j in np.argwhere(full[1:-1, 1:-1]).tolist():
        low = [vertex(i + a, j + b, 0) for a, b in _CORNERS]
        high = [vertex(i + a, j + b, 1) for a, b in _CORNERS]
        faces += [(low[0], low[2], low[1]), (low[0], low[3], low[2])]
        faces += [(high[0], high[1], high[2]), (high[0], high[2], high[3])]
        for edge, (a, b) in enumerate(_ACROSS):
            if not full[1 + i + a, 1 + j + b]:
                after = (edge + 1) % 4
                faces += [(low[edge], low[after], high[after]), (low[edge], high[after], high[edge])]
    z = (bottom, top)
    vertices = np.array([(xs[i], ys[j], z[k]) for i, j, k in number], np.float64)
    return TriangleMesh(vertices, np.array(faces, np.int32))


def box(size: Sequence[float]) -> TriangleMesh:
    """Return a box from the origin to ``size``, metres."""
    return lattice_prism((0.0, size[0]), (0.0, size[1]), [[True]], 0.0, size[2])


def round_prism(radius: float, height: float, sides: int) -> TriangleMesh:
    """Return an upright prism over a regular polygon around the z axis."""
    angle = np.arange(sides) * 2.0 * np.pi / sides
    ring = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)
    low, high = np.insert(ring, 2, 0.0, axis=1), np.insert(ring, 2, height, axis=1)
    here = np.arange(sides)
    after = (here + 1) % sides
    walls = [np.stack([here, after, after + sides], 1), np.stack([here, after + sides, here + sides], 1)]
    fan = np.arange(1, sides - 1)
    caps = [
        np.stack([np.zeros_like(fan), fan + 1, fan], 1),
        np.stack([np.zeros_like(fan), fan, fan + 1], 1) + sides,
    ]
    return TriangleMesh(np.concatenate([low, high]), np.concatenate([*walls, *caps]).astype(np.int32))


def pipe(radius: float, wall: float, length: float, sides: int) -> TriangleMesh:
    """Return a hollow round pipe along z, from 0 to ``length``."""
    angle = np.arange(sides) * 2.0 * np.pi / sides
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    rings = [
        np.insert(r * circle, 2, z, axis=1)
        for r, z in ((radius, 0.0), (radius, length), (radius - wall, length), (radius - wall, 0.0))
    ]
    here = np.arange(sides)
    after = (here + 1) % sides
    faces = []
    for ring in range(4):
        a, b = ring * sides, (ring + 1) % 4 * sides
        faces += [np.stack([here + a, after + a, after + b], 1), np.stack([here + a, after + b, here + b], 1)]
    return TriangleMesh(np.concatenate(rings), np.concatenate(faces).astype(np.int32))


def stood_up(mesh: TriangleMesh) -> TriangleMesh:
    """Rotate a mesh drawn in x, y and extruded along z to x, z and -y: walls and profiles drawn in elevation."""
    x, y, z = mesh.vertices_m.T
    return TriangleMesh(np.stack([x, -z, y], axis=-1), mesh.faces)


def turned(mesh: TriangleMesh, angle_rad: float, axis: int = 2) -> TriangleMesh:
    """Rotate a mesh about a coordinate axis through the origin."""
    a, b = (axis + 1) % 3, (axis + 2) % 3
    turn = np.eye(3)
    turn[a, a] = turn[b, b] = np.cos(angle_rad)
    turn[b, a] = np.sin(angle_rad)
    turn[a, b] = -turn[b, a]
    return TriangleMesh(mesh.vertices_m @ turn.T, mesh.faces)


def moved(mesh: TriangleMesh, x: float, y: float, z: float) -> TriangleMesh:
    """Move a mesh by metres."""
    return TriangleMesh(mesh.vertices_m + np.array([x, y, z]), mesh.faces)


def joined(*meshes: TriangleMesh) -> TriangleMesh:
    """Put several bodies into one mesh."""
    starts = np.cumsum([0, *(len(mesh.vertices_m) for mesh in meshes)])
    faces: list[NDArray[np.int32]] = [
        (mesh.faces + start).astype(np.int32) for mesh, start in zip(meshes, starts, strict=False)
    ]
    return TriangleMesh(np.concatenate([mesh.vertices_m for mesh in meshes]), np.concatenate(faces))
