"""Dense solids: single closed bodies that are nearly all interior."""

from __future__ import annotations

import numpy as np

from benchmarks.voxelize.prisms import box
from bimvox.bim.building import Building, Element, Role, Source, TriangleMesh

_DENSITY = 2400.0


def of_one(name: str, mesh: TriangleMesh) -> Building:
    """Return a building of one component."""
    element = Element(
        id=name,
        global_id=name,
        ifc_class="Mesh",
        name=name,
        mesh=mesh,
        role=Role.COMPONENT,
        mass_kg=mesh.signed_volume_m3 * _DENSITY,
        mass_source="default",
    )
    return Building((element,), (), Source(name, "0" * 64, "generated", "m"))


def cube(edge_m: float) -> Building:
    """Return a cube whose faces do not lie on cell borders."""
    mesh = box((edge_m, edge_m, edge_m))
    return of_one("cube", TriangleMesh(mesh.vertices_m + np.array([0.013, 0.027, 0.041]), mesh.faces))


def blob(radius_m: float, sides: int = 64) -> Building:
    """Return a lumpy ball of ``12 * sides**2`` triangles: a cube's lattice pushed out to a wavy sphere."""
    step = np.arange(sides + 1)
    surface = np.stack(np.meshgrid(step, step, step, indexing="ij"), axis=-1).reshape(-1, 3)
    surface = surface[((surface == 0) | (surface == sides)).any(axis=1)]
    number = -np.ones((sides + 1,) * 3, np.int64)
    number[tuple(surface.T)] = np.arange(len(surface))
    faces = []
    u, v = (n.ravel() for n in np.meshgrid(step[:-1], step[:-1], indexing="ij"))
    for axis in range(3):
        for side in (0, sides):
            corners = []
            for a, b in ((0, 0), (1, 0), (1, 1), (0, 1)):
                at = np.full((len(u), 3), side)
                at[:, (axis + 1) % 3], at[:, (axis + 2) % 3] = u + a, v + b
                corners.append(number[tuple(at.T)])
            p, q, r, s = corners if side else corners[::-1]
            faces += [np.stack([p, q, r], 1), np.stack([p, r, s], 1)]
    # Tangent spacing gives triangles of similar size.
    direction = np.tan((surface / sides - 0.5) * np.pi / 2)
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    x, y, z = direction.T
    wave = np.sin(5 * x + 1) * np.cos(4 * y) + 0.6 * np.sin(9 * z + 3 * x) + 0.25 * np.cos(17 * y - 11 * z)
    vertices = direction * (radius_m * (1.0 + 0.07 * wave))[:, None]
    return of_one("blob", TriangleMesh(vertices, np.concatenate(faces).astype(np.int32)))


def terrain(length_m: float, depth_m: float, sides: int = 156) -> Building:
    """Return a square piece of ground of ``2 * sides**2`` triangles on top, with upright sides and a flat bottom."""
    step = np.arange(sides + 1)
    i, j = (n.ravel() for n in np.meshgrid(step, step, indexing="ij"))
    x, y = i * length_m / sides, j * length_m / sides
    hills = np.sin(x / 7.0) * np.cos(y / 9.0) + 0.5 * np.sin(x / 2.9 + y / 4.1) + 0.1 * np.cos(1.7 * x - 2.3 * y)
    top = np.stack([x, y, 0.12 * depth_m * hills], axis=-1)
    # The rim, counter-clockwise; the bottom is a fan from its middle.
    along, still = step[:-1], np.zeros(sides, np.int64)
    ring = np.concatenate(
        [
            along * (sides + 1) + still,
            sides * (sides + 1) + along,
            (sides - along) * (sides + 1) + sides,
            sides - along,
        ]
    )
    low = top[ring] * (1.0, 1.0, 0.0) - (0.0, 0.0, depth_m)
    middle = np.array([[length_m / 2, length_m / 2, -depth_m]])
    a, b = (n.ravel() for n in np.meshgrid(along, along, indexing="ij"))
    corner = a * (sides + 1) + b
    after = np.roll(ring, -1)
    under = len(top) + np.arange(len(ring))
    under_after = np.roll(under, -1)
    faces = [
        np.stack([corner, corner + sides + 1, corner + sides + 2], 1),
        np.stack([corner, corner + sides + 2, corner + 1], 1),
        np.stack([under, under_after, after], 1),
        np.stack([under, after, ring], 1),
        np.stack([under_after, under, np.full(len(ring), len(top) + len(ring))], 1),
    ]
    mesh = TriangleMesh(np.concatenate([top, low, middle]), np.concatenate(faces).astype(np.int32))
    return of_one("terrain", mesh)
