"""The contents of a mesh file, as its format states them: every reader of a mesh format returns this."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bimvox.errors import MeshError

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


def text_of(data: bytes) -> str:
    """Return decoded text: UTF-8, with or without a byte order mark, otherwise Latin-1, which accepts every byte."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def numbers(path: Path, words: str, where: str) -> NDArray[np.float64]:
    """Return the numbers of a text, separated by white space.

    ``where``: names the text in the message.

    Raises:
        MeshError: If a word is not a number.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)
        try:
            return np.fromstring(words, dtype=np.float64, sep=" ")
        except (DeprecationWarning, ValueError):
            pass
    for word in words.split():
        try:
            float(word)
        except ValueError:
            raise MeshError(
                path, f"{where}: {word[:40]!r} is not a number", hint="the file is damaged: export it again"
            ) from None
    return np.array(words.split(), dtype=np.float64)


def rows_of_numbers(path: Path, rows: Sequence[str], columns: int, where: str) -> NDArray[np.float64]:
    """Return (len(rows), columns) numbers, the first ``columns`` of every row.

    Raises:
        MeshError: If a row has too few numbers, or a word that is not a number.
    """
    found = numbers(path, " ".join(rows), where)
    if rows and len(found) == len(rows) * columns:
        return found.reshape(-1, columns)
    cut = []
    for row in rows:
        words = row.split()[:columns]
        if len(words) < columns:
            raise MeshError(
                path,
                f"{where}: {row.strip()[:40]!r} has fewer than {columns} numbers",
                hint="the file is damaged or cut off: export it again",
            )
        cut += words
    return numbers(path, " ".join(cut), where).reshape(-1, columns)


REPEATED_MOST = 20_000_000
"""A file whose instances expand to more triangles or vertices than this is refused."""

CORNERS_MOST = 1_000_000
"""A face of a text format with more corners than this is refused before it is read."""


def damaged(path: Path, what: str) -> MeshError:
    """Return the error for a file that is damaged or truncated; ``what`` says what is wrong in it."""
    return MeshError(path, what, hint="the file is damaged or truncated: export it again")


def too_many_corners(path: Path, what: str) -> MeshError:
    """Return the error for a face with more than ``CORNERS_MOST`` corners; ``what`` names the face."""
    return MeshError(path, f"{what} has more than {CORNERS_MOST:,} corners", hint="export it with triangles")


@dataclass(frozen=True, slots=True, eq=False)
class RawBody:
    """One body of a mesh file.

    Attributes:
        name: As in the file; empty for a triangle soup, which may contain several bodies.
        vertices: (V, 3) float64, in the file's unit and axes.
        faces: (F, 3) int32; may be out of range, degenerate or inside out.
        rounding: Largest rounding error of a coordinate that the file stores in single precision, in the file's unit;
            0 for text and double precision.
    """

    name: str
    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    rounding: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class MeshContents:
    """All bodies of a mesh file.

    Attributes:
        bodies: In the order of the file.
        unit: Unit that the file states or its standard fixes; None if neither does.
        up: Axis that points up by the format's standard; None if the standard does not fix it.
        left_out: (name, reason) of what the file contains that is not a surface.
        notes: What the user should know, one sentence each.
        external: Bytes of the external files that it references, in the order of their use.
    """

    bodies: tuple[RawBody, ...]
    unit: str | None = None
    up: Literal["y", "z"] | None = None
    left_out: tuple[tuple[str, str], ...] = ()
    notes: tuple[str, ...] = ()
    external: tuple[bytes, ...] = ()


def body_of_polygons(
    name: str, vertices: NDArray[np.float64], polygons: Sequence[Sequence[int]] | NDArray[np.int64]
) -> RawBody:
    """Return a body from faces with any number of corners, with only the vertices that they use.

    ``vertices``: (V, 3); ``polygons``: corner indices of every face; an index out of range drops the face.
    """
    if isinstance(polygons, np.ndarray):
        sizes = np.full(len(polygons), polygons.shape[1], dtype=np.int64)
        corners = polygons.reshape(-1)
    else:
        sizes = np.fromiter((len(polygon) for polygon in polygons), dtype=np.int64, count=len(polygons))
        # Clamped as Python integers: a damaged file may contain one of any size.
        count = len(vertices)
        clamped = (-1 if corner < 0 else min(corner, count) for polygon in polygons for corner in polygon)
        corners = np.fromiter(clamped, np.int64, int(sizes.sum()))
    used, local = np.unique(np.clip(corners, -1, len(vertices)), return_inverse=True)
    missing = (used < 0) | (used >= len(vertices))
    # A missing corner becomes a NaN vertex: the cleaning of the mesh drops and counts its faces.
    kept = np.where(missing[:, None], np.nan, vertices[np.where(missing, 0, used)] if len(vertices) else np.nan)
    return RawBody(name, kept, triangulated(kept, sizes, local.reshape(-1)))
