"""Cut faces with more than three corners, also concave ones, into triangles that cover exactly the face."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

CLIPPED_MOST = 4096
"""A face with more corners than this is always cut as a fan: ear clipping is quadratic."""

WORK = 30_000_000
"""Comparisons of corners that ear clipping may make for a mesh, and ``WORK_A_CORNER`` more for each corner of it."""
WORK_A_CORNER = 1000
_WORK_A_TRY = 500
"""What a corner that is not an ear costs at least, in such comparisons."""


def triangulated(
    vertices: NDArray[np.float64], sizes: NDArray[np.int64], corners: NDArray[np.int64]
) -> NDArray[np.int32]:
    """Return the triangles of polygons, in their order, with their orientation.

    If the first corner sees all others, the polygon is cut as a fan, otherwise by ear clipping. Spirals of which that
    would take minutes are cut as fans too. Faces with fewer than three corners are dropped.

    Args:
        vertices: (V, 3).
        sizes: (P,) number of corners of every polygon.
        corners: (sum of sizes,) indices into ``vertices``, polygon after polygon.

    Returns:
        (F, 3) int32.
    """
    if (sizes == 3).all():
        return corners.reshape(-1, 3).astype(np.int32)
    starts = np.cumsum(sizes) - sizes
    cuts = np.maximum(sizes - 2, 0)
    polygon = np.repeat(np.arange(len(sizes)), cuts)
    first_cut = np.cumsum(cuts) - cuts
    step = np.arange(len(polygon)) - first_cut[polygon]
    first = starts[polygon]
    faces = np.stack([corners[first], corners[first + step + 1], corners[first + step + 2]], axis=1)

    with np.errstate(invalid="ignore", over="ignore"):
        a, b, c = vertices[faces[:, 0]], vertices[faces[:, 1]], vertices[faces[:, 2]]
        cross = np.cross(b - a, c - a)
        # For any shape, the area vectors of the fan add up to that of the polygon.
        normals = np.zeros((len(sizes), 3))
        np.add.at(normals, polygon, cross)
        seen = np.einsum("ij,ij->i", cross, normals[polygon]) > 0.0
    wrong = np.zeros(len(sizes), dtype=bool)
    wrong[polygon[~seen]] = True
    work_left = WORK + WORK_A_CORNER * len(corners)
    for index in np.flatnonzero(wrong & (sizes > 3) & (sizes <= CLIPPED_MOST)):
        ring = corners[starts[index] : starts[index] + sizes[index]]
        ears, work_left = _ears(_flat(vertices[ring], normals[index]), work_left)
        if ears is not None:
            faces[first_cut[index] : first_cut[index] + cuts[index]] = ring[ears]
    return faces.astype(np.int32)


def _flat(points: NDArray[np.float64], normal: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the points without the main axis of the normal: (n, 2), counter-clockwise, coordinates unchanged."""
    axis = int(np.argmax(np.abs(normal)))
    u, v = (axis + 1) % 3, (axis + 2) % 3
    return points[:, [u, v]] if normal[axis] > 0 else points[:, [v, u]]


def _ears(points: NDArray[np.float64], work_left: int) -> tuple[NDArray[np.int64] | None, int]:
    """Return the ears of a counter-clockwise polygon, (n - 2, 3) indices, and how much work is left.

    There are no ears if it is not a polygon, or if no work is left.

    Corners at the same place (the two sides of a bridge to a hole) do not block an ear. If possible, corners on a
    straight line are used by adjacent ears, so that the face still meets its neighbours corner to corner.
    """
    if not np.isfinite(points).all():
        return None, work_left
    ring = list(range(len(points)))
    ears: list[tuple[int, int, int]] = []
    while len(ring) > 3:
        tried = range(min(len(ring), 1 + max(work_left, 0) // (_WORK_A_TRY + len(ring))))
        at = next((place for place in tried if _is_ear(points, ring, place)), None)
        work_left -= (len(tried) if at is None else at) * (_WORK_A_TRY + len(ring))
        if work_left < 0:
            return None, work_left
        if at is None:
            straight = [place for place in range(len(ring)) if _turn(points, _three(ring, place)) == 0.0]
            if not straight:
                return None, work_left
            at = straight[0]
        ears.append(_three(ring, at))
        del ring[at]
    return np.array([*ears, tuple(ring)], dtype=np.int64), work_left


def _three(ring: list[int], place: int) -> tuple[int, int, int]:
    return ring[place - 1], ring[place], ring[(place + 1) % len(ring)]


def _turn(points: NDArray[np.float64], three: tuple[int, int, int]) -> float:
    """Return twice the signed area of a triangle."""
    (ax, ay), (bx, by), (cx, cy) = points[list(three)].tolist()
    return float((bx - ax) * (cy - ay) - (by - ay) * (cx - ax))


def _is_ear(points: NDArray[np.float64], ring: list[int], place: int) -> bool:
    """Return whether a corner is convex and no other corner is in its triangle."""
    three = _three(ring, place)
    if _turn(points, three) <= 0.0:
        return False
    corners = points[list(three)]
    others = points[ring]
    side = np.roll(corners, -1, axis=0) - corners
    away = others[:, None] - corners[None]
    inside = (side[None, :, 0] * away[:, :, 1] - side[None, :, 1] * away[:, :, 0] >= 0.0).all(axis=1)
    same = (others[:, None] == corners[None]).all(axis=2).any(axis=1)
    return not (inside & ~same).any()
