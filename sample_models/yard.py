"""A mesh site: six 20-foot containers to set, an excavator as obstruction, the ground. z up, metres."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sample_models.mesh_files import Body, glb_bytes, stl_text

CONTAINER_M = (6.058, 2.438, 2.591)
"""Outer size of a 20-foot container (ISO 668, 1CC)."""
RIBS, RIB_DEPTH_M = 5, 0.036
WALL_M = 0.02
"""Least thickness of walls, floor and lid: at the default density of a mesh, a container weighs about 5 t."""
GAP_M = 0.112
"""Gap between neighbouring containers: the row's pitch is 2.55 m."""

Vector = tuple[float, float, float]
Mesh = tuple[NDArray[np.float64], NDArray[np.int32]]

_BOX_FACES = np.array(
    [
        *([0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7], [0, 1, 5], [0, 5, 4]),
        *([1, 2, 6], [1, 6, 5], [2, 3, 7], [2, 7, 6], [3, 0, 4], [3, 4, 7]),
    ],
    dtype=np.int32,
)


def yard_bodies() -> tuple[Body, ...]:
    """Return the bodies of the site."""
    pitch = CONTAINER_M[1] + GAP_M
    # Four on the ground in a row, the fifth and the sixth on top of the first and the second.
    places = [(20.0, 4.0 + pitch * i, 0.0) for i in range(4)] + [
        (20.0, 4.0 + pitch * i, CONTAINER_M[2]) for i in (0, 1)
    ]
    vertices, faces = _joined(_container(), _cavity())
    containers = [Body(f"container-{i}", "container-20ft", vertices, faces, at) for i, at in enumerate(places, start=1)]
    excavator = Body("excavator", "excavator", *_excavator(), (13.0, 8.0, 0.0))
    ground = Body("ground", "ground", *_box((0, 0, -0.2), (40, 30, 0)))
    return (*containers, excavator, ground)


def yard_glb() -> bytes:
    """Return the site as binary glTF: named nodes, the containers one mesh at six places."""
    return glb_bytes(yard_bodies())


def yard_stl() -> bytes:
    """Return the site as ASCII STL: named solids."""
    return stl_text(yard_bodies())


def _box(low: Vector, high: Vector) -> Mesh:
    (x0, y0, z0), (x1, y1, z1) = low, high
    floor = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
    return np.array([(*p, z) for z in (z0, z1) for p in floor], dtype=np.float64), _BOX_FACES


def _container() -> Mesh:
    """Return a container with corrugated long sides: an extruded plan outline, corrugations within the outer size."""
    length, width, height = CONTAINER_M
    # One rib: out, slope in, in, slope out; whole ribs between plain ends.
    end, slope = 0.3, 0.07
    pitch = (length - 2 * end) / RIBS
    inward = [(end + pitch * i + x, d) for i in range(RIBS) for x, d in _rib(pitch, slope)]
    front = [(0.0, 0.0), *inward, (length, 0.0)]
    back = [(x, width - d) for x, d in reversed(front)]
    outline = np.array([*front, *back])
    n = len(outline)
    half = n // 2
    vertices = np.array([(x, y, z) for z in (0.0, height) for x, y in outline])
    sides = [[(i, (i + 1) % n, n + (i + 1) % n), (i, n + (i + 1) % n, n + i)] for i in range(n)]
    # The outline is a strip: point i of the front faces point n - 1 - i of the back.
    lid = [[(n + i, n + i + 1, 2 * n - 2 - i), (n + i, 2 * n - 2 - i, 2 * n - 1 - i)] for i in range(half - 1)]
    floor = [[(i + 1, i, n - 2 - i), (n - 2 - i, i, n - 1 - i)] for i in range(half - 1)]
    return vertices, np.array([t for pair in (*sides, *lid, *floor) for t in pair], dtype=np.int32)


def _cavity() -> Mesh:
    """Return the inside of a container, facing inwards: walls, floor and lid have a mass of their own."""
    (length, width, height), wall = CONTAINER_M, WALL_M + RIB_DEPTH_M
    vertices, faces = _box((WALL_M, wall, WALL_M), (length - WALL_M, width - wall, height - WALL_M))
    return vertices, faces[:, ::-1]


def _rib(pitch_m: float, slope_m: float) -> list[tuple[float, float]]:
    flat = (pitch_m - 2 * slope_m) / 2
    return [
        (flat / 2, 0.0),
        (flat / 2 + slope_m, RIB_DEPTH_M),
        (1.5 * flat + slope_m, RIB_DEPTH_M),
        (1.5 * flat + 2 * slope_m, 0.0),
    ]


def _excavator() -> Mesh:
    """Return a boxy tracked excavator of the 20-tonne class; its boxes overlap, as in many machine models."""
    return _joined(
        _box((-2.1, -1.4, 0.0), (2.1, -0.8, 0.9)),
        _box((-2.1, 0.8, 0.0), (2.1, 1.4, 0.9)),
        _box((-1.2, -0.9, 0.3), (1.2, 0.9, 0.8)),
        _box((-2.6, -1.3, 0.8), (1.3, 1.3, 2.0)),
        _box((0.0, 0.3, 1.9), (1.5, 1.3, 3.0)),
        _arm((1.0, 1.7), (4.0, 4.6), 0.50, 0.30),
        _arm((4.0, 4.6), (6.2, 1.6), 0.40, 0.25),
        _box((5.5, -0.55, 0.7), (6.6, 0.55, 1.7)),
    )


def _arm(start: tuple[float, float], end: tuple[float, float], depth_m: float, half_width_m: float) -> Mesh:
    """Return a beam in the x-z plane from ``start`` to ``end``."""
    a, b = np.array(start), np.array(end)
    along = (b - a) / np.linalg.norm(b - a)
    across = np.array([-along[1], along[0]]) * depth_m / 2
    if across[1] < 0:
        across = -across
    # Bottom face first, like a box seen from above.
    corners = [
        (*(p + s * across)[[0]], y, *(p + s * across)[[1]])
        for s in (-1, 1)
        for p, y in ((a, -half_width_m), (b, -half_width_m), (b, half_width_m), (a, half_width_m))
    ]
    return np.array(corners, dtype=np.float64), _BOX_FACES


def _joined(*meshes: Mesh) -> Mesh:
    offsets = np.cumsum([0, *(len(vertices) for vertices, _ in meshes[:-1])])
    faces = np.concatenate([faces + offset for (_, faces), offset in zip(meshes, offsets, strict=True)])
    return np.concatenate([vertices for vertices, _ in meshes]), faces.astype(np.int32)
