"""Obstructions, temporary objects in the way, as values in the site frame."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.errors import InputError

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

    def __post_init__(self) -> None:
        """Refuse a box without volume."""
        low_m, high_m = _point(self.low_m, "Box.low_m"), _point(self.high_m, "Box.high_m")
        if low_m[0] >= high_m[0] or low_m[1] >= high_m[1] or low_m[2] >= high_m[2]:
            raise InputError(f"Box: {low_m} to {high_m} has no volume", hint="high_m is above low_m in x, y and z")
        object.__setattr__(self, "low_m", low_m)
        object.__setattr__(self, "high_m", high_m)


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

    def __post_init__(self) -> None:
        """Refuse a cylinder without volume."""
        object.__setattr__(self, "base_m", _point(self.base_m, "Cylinder.base_m"))
        for name in ("radius_m", "height_m"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise InputError(f"Cylinder.{name} is {getattr(self, name)}", hint="give a positive length in metres")


@dataclass(frozen=True, slots=True, eq=False)
class Points:
    """A point cloud.

    Attributes:
        points_m: (N, 3) float64.
    """

    points_m: NDArray[np.float64]

    def __post_init__(self) -> None:
        """Refuse points without a place."""
        if self.points_m.ndim != 2 or self.points_m.shape[1] != 3 or not np.isfinite(self.points_m).all():
            raise InputError("Points.points_m is not an (N, 3) array of finite numbers")


Form: TypeAlias = Box | Voxels | Cylinder | TriangleMesh | Points
_FORMS = (Box, Voxels, Cylinder, TriangleMesh, Points)


@dataclass(frozen=True, slots=True, eq=False)
class Obstruction:
    """One obstruction.

    Attributes:
        id: Unique in its set.
        form: Its form and position, in the site frame.
    """

    id: str
    form: Form

    def __post_init__(self) -> None:
        """Refuse what has no name or no form."""
        if not isinstance(self.id, str) or not self.id:
            raise InputError(f"Obstruction.id is {self.id!r}", hint="give every obstruction a name of its own")
        if not isinstance(self.form, _FORMS):
            raise InputError(
                f"obstruction {self.id!r}: its form is a {type(self.form).__name__}",
                hint="give a Box, Voxels, Cylinder, TriangleMesh or Points",
            )

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
        """Return a set of obstructions given in any order.

        Raises:
            InputError: If two have the same id.
        """
        ordered = tuple(sorted(obstructions, key=lambda one: one.id))
        for one, other in pairwise(ordered):
            if one.id == other.id:
                raise InputError(f"two obstructions have the id {one.id!r}", hint="give each an id of its own")
        return cls(ordered, name, files)

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


def _point(values: Vec3, name: str) -> Vec3:
    """Return three finite coordinates as plain floats."""
    point = tuple(map(float, values))
    if len(point) != 3 or not all(map(math.isfinite, point)):
        raise InputError(f"{name} is {tuple(values)}", hint="give three finite numbers, in metres")
    return point


def _bytes(array: NDArray[np.generic], dtype: str) -> bytes:
    return np.ascontiguousarray(array, dtype=np.dtype(dtype)).tobytes()
