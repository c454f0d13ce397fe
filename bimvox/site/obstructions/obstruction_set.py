"""Obstructions, temporary objects in the way, as values in the site frame."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh

Vec3: TypeAlias = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Box:
    """An upright box, metres.

    Attributes:
        low_m: Lowest corner.
        high_m: Highest corner.
    """

    low_m: Vec3
    high_m: Vec3


@dataclass(frozen=True, slots=True)
class Voxels:
    """Single cells of the site's grid.

    Attributes:
        cells: Cell indices, sorted, each once.
    """

    cells: tuple[tuple[int, int, int], ...]


@dataclass(frozen=True, slots=True)
class Cylinder:
    """An upright cylinder, metres.

    Attributes:
        base_m: Centre of its base.
        radius_m: Its radius.
        height_m: Its height.
    """

    base_m: Vec3
    radius_m: float
    height_m: float


@dataclass(frozen=True, slots=True, eq=False)
class Points:
    """A point cloud.

    Attributes:
        points_m: (N, 3) float64.
    """

    points_m: NDArray[np.float64]


Form: TypeAlias = Box | Voxels | Cylinder | TriangleMesh | Points


@dataclass(frozen=True, slots=True, eq=False)
class Obstruction:
    """One obstruction.

    Attributes:
        id: Unique in its set.
        form: Its form and position, in the site frame.
    """

    id: str
    form: Form

    def content(self) -> bytes:
        """Return bytes that are equal for equal obstructions."""
        form = self.form
        if isinstance(form, TriangleMesh):
            kind = "mesh"
            body = _bytes(form.vertices_m, "<f8") + b"|" + _bytes(form.faces, "<i4")
        elif isinstance(form, Points):
            kind, body = "points", _bytes(form.points_m, "<f8")
        else:
            kind, body = type(form).__name__.lower(), repr(form).encode()
        return f"{self.id!r}:{kind}:{len(body)}:".encode() + body


@dataclass(frozen=True, eq=False)
class ObstructionSet:
    """All obstructions of a site at one moment.

    Attributes:
        obstructions: Sorted by id, each id once; the order in the file does not matter.
        name: Name of their file, without folder.
        files: The referenced mesh and point files, to be watched with it.
    """

    obstructions: tuple[Obstruction, ...] = ()
    name: str = ""
    files: tuple[Path, ...] = field(default=(), repr=False)

    @classmethod
    def of(cls, obstructions: Iterable[Obstruction], name: str = "", files: tuple[Path, ...] = ()) -> ObstructionSet:
        """Return a set of obstructions given in any order."""
        return cls(tuple(sorted(obstructions, key=lambda one: one.id)), name, files)

    @classmethod
    def from_meshes(cls, meshes: Iterable[tuple[str, TriangleMesh]], name: str = "") -> ObstructionSet:
        """Return a set with one obstruction per (id, mesh in the site frame).

        The second, third ... occurrence of an id gets ``#2``, ``#3`` ... appended.
        """
        seen: dict[str, int] = {}
        one_each = []
        for name_of_mesh, mesh in meshes:
            seen[name_of_mesh] = number = seen.get(name_of_mesh, 0) + 1
            one_each.append(Obstruction(name_of_mesh if number == 1 else f"{name_of_mesh}#{number}", mesh))
        return cls.of(one_each, name)

    @cached_property
    def digest(self) -> str:
        """SHA-256 over the content, independent of the file's order, unit and format."""
        hashed = hashlib.sha256(b"obstructions 1\n")
        for obstruction in self.obstructions:
            hashed.update(obstruction.content())
        return hashed.hexdigest()


EMPTY = ObstructionSet()
"""No obstructions."""


def _bytes(array: NDArray[np.generic], dtype: str) -> bytes:
    return np.ascontiguousarray(array, dtype=np.dtype(dtype)).tobytes()
