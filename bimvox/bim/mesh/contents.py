"""The contents of a mesh file, as its format states them: every reader of a mesh format returns this."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.mesh.polygons import triangulated
from bimvox.errors import MeshError

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

    Args:
        name: Its name.
        vertices: (V, 3).
        polygons: Corner indices of every face; an index out of range drops the face.
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
