"""An independent brute-force voxelizer in float64 metres, and shapes for tests."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh

BOX_FACES = np.array(
    [
        [0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7], [0, 1, 5], [0, 5, 4],
        [1, 2, 6], [1, 6, 5], [2, 3, 7], [2, 7, 6], [3, 0, 4], [3, 4, 7],
    ],
    np.int32,
)  # fmt: skip


def box_mesh(low, high) -> TriangleMesh:
    """Return an axis-aligned box, faces outward."""
    (a, b, c), (d, e, f) = low, high
    corners = [(a, b, c), (d, b, c), (d, e, c), (a, e, c), (a, b, f), (d, b, f), (d, e, f), (a, e, f)]
    return TriangleMesh(np.array(corners, np.float64), BOX_FACES)


def moved(mesh: TriangleMesh, *, turn=None, by=(0.0, 0.0, 0.0)) -> TriangleMesh:
    vertices = mesh.vertices_m if turn is None else mesh.vertices_m @ np.asarray(turn, np.float64).T
    return TriangleMesh(vertices + np.asarray(by), mesh.faces)


def inverted(mesh: TriangleMesh) -> TriangleMesh:
    return TriangleMesh(mesh.vertices_m, np.ascontiguousarray(mesh.faces[:, ::-1]))


def joined(*meshes: TriangleMesh) -> TriangleMesh:
    starts = np.cumsum([0] + [len(mesh.vertices_m) for mesh in meshes])
    faces = [mesh.faces + start for mesh, start in zip(meshes, starts, strict=False)]
    return TriangleMesh(np.concatenate([mesh.vertices_m for mesh in meshes]), np.concatenate(faces).astype(np.int32))


def without_faces(mesh: TriangleMesh, *drop: int) -> TriangleMesh:
    return TriangleMesh(mesh.vertices_m, np.delete(mesh.faces, drop, axis=0))


def rotation(rng: np.random.Generator) -> NDArray[np.float64]:
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q *= np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0 else q[:, [1, 0, 2]]


def sphere_mesh(radius: float, rings: int = 24) -> TriangleMesh:
    """Return a closed sphere of latitude rings."""
    around = 2 * rings
    polar = np.linspace(0.0, np.pi, rings + 1)[1:-1]
    angle = np.arange(around) * 2.0 * np.pi / around
    grid = np.stack(
        [
            np.outer(np.sin(polar), np.cos(angle)),
            np.outer(np.sin(polar), np.sin(angle)),
            np.outer(np.cos(polar), np.ones(around)),
        ],
        axis=-1,
    ).reshape(-1, 3)
    vertices = np.concatenate([grid, [[0, 0, 1], [0, 0, -1]]]) * radius
    top, bottom = len(grid), len(grid) + 1
    faces = []
    for j in range(around):
        k = (j + 1) % around
        faces += [[top, j, k], [bottom, len(grid) - around + k, len(grid) - around + j]]
        for i in range(rings - 2):
            a, b = i * around + j, i * around + k
            faces += [[a, a + around, b], [b, a + around, b + around]]
    return TriangleMesh(vertices, np.array(faces, np.int32))


def surface_cells(mesh: TriangleMesh, h: float, tolerance_m: float) -> set[tuple[int, int, int]]:
    """Return the cells whose box, shrunk by the tolerance, is not separated from a triangle by one of 13 axes."""
    cells: set[tuple[int, int, int]] = set()
    for triangle in mesh.vertices_m[mesh.faces]:
        low = np.floor(triangle.min(axis=0) / h).astype(int) - 1
        high = np.ceil(triangle.max(axis=0) / h).astype(int) + 1
        candidates = np.stack(np.meshgrid(*map(np.arange, low, high), indexing="ij"), axis=-1).reshape(-1, 3)
        edges = np.roll(triangle, -1, axis=0) - triangle
        longest = np.linalg.norm(edges, axis=1).max()
        axes = [*np.eye(3), np.cross(edges[0], edges[1])]
        axes += [np.cross(edge, unit) for edge, unit in itertools.product(edges, np.eye(3))]
        lengths = [1.0, 1.0, 1.0, longest**2] + [longest] * 9
        centres = (candidates + 0.5) * h
        met = np.ones(len(candidates), bool)
        for axis, length in zip(axes, lengths, strict=True):
            if np.linalg.norm(axis) <= 1e-11 * length:
                continue
            radius = (h / 2.0 - tolerance_m) * np.abs(axis).sum()
            corners = (triangle[None] - centres[:, None]) @ axis
            met &= (corners.max(axis=1) > -radius) & (corners.min(axis=1) < radius)
        cells.update(map(tuple, candidates[met].tolist()))
    return cells


def cell_set(voxels) -> set[tuple[int, int, int]]:
    """Return the lattice cells of a PartVoxels."""
    return set(map(tuple, (np.argwhere(voxels.cells) + voxels.low).tolist()))


def winding_numbers(mesh: TriangleMesh, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how often the surface winds around each point: the sum of its triangles' solid angles over 4 pi.

    After Van Oosterom and Strackee 1983: without rays, parity or ties.
    """
    total = np.zeros(len(points))
    for triangle in mesh.vertices_m[mesh.faces]:
        a, b, c = (corner - points for corner in triangle)
        la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
        det = np.einsum("ij,ij->i", a, np.cross(b, c))
        ab, bc, ca = (np.einsum("ij,ij->i", *pair) for pair in ((a, b), (b, c), (c, a)))
        total += 2.0 * np.arctan2(det, la * lb * lc + ab * lc + bc * la + ca * lb)
    return total / (4.0 * np.pi)


def solid_cells(mesh: TriangleMesh, h: float, tolerance_m: float) -> set[tuple[int, int, int]]:
    """Return the cells of a closed mesh: those that the surface meets, or around whose middle it winds."""
    cells = surface_cells(mesh, h, tolerance_m)
    corners = mesh.vertices_m[mesh.faces].reshape(-1, 3)
    low = np.floor(corners.min(axis=0) / h).astype(int) - 1
    high = np.ceil(corners.max(axis=0) / h).astype(int) + 1
    every = np.stack(np.meshgrid(*map(np.arange, low, high), indexing="ij"), axis=-1).reshape(-1, 3)
    rest = np.array([cell for cell in map(tuple, every.tolist()) if cell not in cells]).reshape(-1, 3)
    inside = np.abs(winding_numbers(mesh, (rest + 0.5) * h)) > 0.5
    return cells | set(map(tuple, rest[inside].tolist()))


def border_cells(mesh: TriangleMesh, h: float, tolerance_m: float) -> set[tuple[int, int, int]]:
    """Return the cells above borders that contain whole triangles.

    The rule as documented: except where a cell on either side is in the part anyway, or where none is above.
    """
    part = solid_cells(mesh, h, tolerance_m)
    corners = mesh.vertices_m[mesh.faces].reshape(-1, 3)
    top = np.ceil((corners.max(axis=0) - tolerance_m) / h)
    top = np.maximum(top, np.floor((corners.min(axis=0) + tolerance_m) / h) + 1)
    found: set[tuple[int, int, int]] = set()
    for triangle in mesh.vertices_m[mesh.faces]:
        planes = {}
        flat = triangle.copy()
        for axis in range(3):
            border = round(triangle[0, axis] / h)
            if np.all(np.abs(triangle[:, axis] - border * h) <= tolerance_m):
                planes[axis] = border
                flat[:, axis] = (border + (0.5 if border < top[axis] else -0.5)) * h
        if not planes:
            continue
        sheet = TriangleMesh(flat, np.array([[0, 1, 2]], np.int32))
        for cell in surface_cells(sheet, h, tolerance_m):
            beside = [(planes[axis] - 1, planes[axis]) if axis in planes else (cell[axis],) for axis in range(3)]
            if not any(other in part for other in itertools.product(*beside)):
                found.add(cell)
    return found


def tetrahedra(corners: NDArray[np.float64]) -> TriangleMesh:
    """Return a closed mesh of tetrahedra with these (N, 4, 3) corners, facing outward; they may overlap."""
    faces = []
    for n, (a, b, c, d) in enumerate(corners):
        outward = np.dot(np.cross(b - a, c - a), d - a) < 0.0
        sides = ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0))
        faces += [[4 * n + v for v in (side if outward else side[::-1])] for side in sides]
    return TriangleMesh(corners.reshape(-1, 3), np.array(faces, np.int32))


def split(mesh: TriangleMesh, rng: np.random.Generator) -> TriangleMesh:
    """Return every triangle split at the middle of a random side; corners must be even to stay exact."""
    triangles = []
    for triangle in mesh.vertices_m[mesh.faces]:
        a, b, c = np.roll(triangle, rng.integers(3), axis=0)
        middle = (a + b) / 2.0
        triangles += [(a, middle, c), (middle, b, c)]
    return soup_of(np.array(triangles))


def soup_of(triangles: NDArray[np.float64]) -> TriangleMesh:
    """Return (F, 3, 3) triangles as a mesh without shared vertices."""
    return TriangleMesh(triangles.reshape(-1, 3).copy(), np.arange(3 * len(triangles), dtype=np.int32).reshape(-1, 3))


def shuffled(mesh: TriangleMesh, rng: np.random.Generator) -> TriangleMesh:
    """Return the same triangles in another order, each starting at another corner."""
    triangles = mesh.vertices_m[mesh.faces]
    turned = [np.roll(triangle, rng.integers(3), axis=0) for triangle in triangles]
    return soup_of(np.array(turned)[rng.permutation(len(triangles))])
