"""Obstructions, temporary objects in the way, as values in the site frame."""

from __future__ import annotations

import hashlib
import math
from array import array
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal, TypeAlias, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.errors import InputError, shown

Vec3: TypeAlias = tuple[float, float, float]
Coordinates: TypeAlias = Literal["site", "model", "map"]
"""Whose coordinates: the site's, the model's or the map's."""


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
        cells: Cell indices; given as (N, 3) whole numbers, kept sorted and each once.
    """

    cells: tuple[tuple[int, int, int], ...]

    def __post_init__(self) -> None:
        """Refuse what is not a list of cells."""
        found = _array(self.cells)
        if found.ndim != 2 or found.shape[1] != 3 or not len(found) or (np.trunc(found) != found).any():
            raise InputError(
                f"Voxels.cells is {_what(self.cells)}", hint="give cell indices: (N, 3) whole numbers, at least one row"
            )
        if found.min() < _INT32.min or found.max() > _INT32.max:
            raise InputError("Voxels.cells: there is an index outside the range of 32-bit numbers")
        cells = tuple(sorted(set(map(tuple, found.astype(np.int64).tolist()))))
        object.__setattr__(self, "cells", cells)


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
            (length_m,) = _numbers((getattr(self, name),)) or (math.nan,)
            if not 0.0 < length_m < math.inf:
                said = f"Cylinder.{name} is {shown(getattr(self, name))}"
                raise InputError(said, hint="give a positive length in metres")
            object.__setattr__(self, name, length_m)


@dataclass(frozen=True, slots=True, eq=False)
class Points:
    """A point cloud.

    Attributes:
        points_m: (N, 3) float64; any (N, 3) numbers may be given.
    """

    points_m: NDArray[np.float64]

    def __post_init__(self) -> None:
        """Refuse points without a place."""
        object.__setattr__(self, "points_m", _rows_of_3(self.points_m, "Points.points_m"))


Form: TypeAlias = Box | Voxels | Cylinder | TriangleMesh | Points
_FORMS = (Box, Voxels, Cylinder, TriangleMesh, Points)
_INT32 = np.iinfo(np.int32)


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
        if isinstance(self.form, TriangleMesh):
            object.__setattr__(self, "form", _checked(self.form, f"obstruction {self.id!r}: TriangleMesh"))

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
        coordinates: In which they are; None if their file does not state it.
        notes: What was assumed when they were put into the site frame.
    """

    obstructions: Sequence[Obstruction] = ()
    name: str = ""
    files: tuple[Path, ...] = field(default=(), repr=False)
    coordinates: Coordinates | None = "site"
    notes: tuple[str, ...] = field(default=(), repr=False)

    @classmethod
    def of(cls, obstructions: Iterable[Obstruction], name: str = "", files: tuple[Path, ...] = ()) -> ObstructionSet:
        """Return a set of obstructions given in any order.

        Raises:
            InputError: If something else than obstructions is given, or two have the same id.
        """
        given = tuple(obstructions) if isinstance(obstructions, Iterable) else (None,)
        if not all(isinstance(one, Obstruction) for one in given):
            raise InputError(
                f"ObstructionSet.of() takes several obstructions, not {_what(obstructions)}",
                hint='give a list: ObstructionSet.of([Obstruction("crate", Box(...))])',
            )
        ordered = tuple(sorted(given, key=lambda one: one.id))
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
    point = _numbers(values)
    if len(point) != 3 or not all(map(math.isfinite, point)):
        raise InputError(f"{name} is {shown(values)}", hint="give three finite numbers, in metres")
    return point[0], point[1], point[2]


def _numbers(values: Iterable[float]) -> tuple[float, ...]:
    """Return numbers as plain floats; none if one of them is not a number."""
    try:
        listed = tuple(values)
        return () if any(isinstance(one, str | bytes) for one in listed) else tuple(map(float, listed))
    except (TypeError, ValueError, OverflowError):
        return ()


def _checked(mesh: TriangleMesh, name: str) -> TriangleMesh:
    """Return a mesh whose faces are corners that it has, as arrays of the types that everything expects."""
    vertices_m, faces = _rows_of_3(mesh.vertices_m, f"{name}.vertices_m"), _array(mesh.faces)
    if faces.dtype.kind not in "iu" or faces.ndim != 2 or faces.shape[1] != 3:
        raise InputError(f"{name}.faces is {_what(mesh.faces)}", hint="give (F, 3) indices into vertices_m")
    if faces.size and not 0 <= faces.min() <= faces.max() < len(vertices_m):
        worst = faces.min() if faces.min() < 0 else faces.max()
        raise InputError(
            f"{name}.faces has the index {worst} of {len(vertices_m):,} vertices", hint="indices start at 0"
        )
    faces = np.asarray(faces, np.int32)
    same = vertices_m is mesh.vertices_m and faces is mesh.faces
    return mesh if same else TriangleMesh(vertices_m, faces)


def _rows_of_3(values: ArrayLike, name: str) -> NDArray[np.float64]:
    """Return (N, 3) finite numbers as float64."""
    found = _array(values)
    if found.ndim != 2 or found.shape[1] != 3 or not np.isfinite(found).all():
        raise InputError(f"{name} is {_what(values)}", hint="give (N, 3) finite numbers, in metres")
    return np.asarray(found, np.float64)


def _array(values: ArrayLike) -> NDArray[Any]:
    """Return values as an array of numbers; without a row if they are something else."""
    try:
        found = np.asarray(values)
    except (TypeError, ValueError):
        return np.empty(0)
    return found if found.dtype.kind in "iuf" and np.isfinite(found).all() else np.empty(0)


def _what(values: object) -> str:
    """Return a wrong value as a message names it."""
    shape = getattr(values, "shape", None)
    return shown(values) if shape is None else f"an array of {values.dtype} with the shape {shape}"  # type: ignore[attr-defined]


def _bytes(array: NDArray[np.generic], dtype: str) -> bytes:
    return np.ascontiguousarray(array, dtype=np.dtype(dtype)).tobytes()


BOX, CYLINDER, VOXELS, OTHER = range(4)
"""What a row holds. Plain numbers, because there may be a million of them."""


@dataclass(frozen=True, slots=True, eq=False)
class Rows(Sequence[Obstruction]):
    """Obstructions in the site frame.

    Attributes:
        ids: Their ids.
        kinds: (N,) uint8, as above.
        numbers_m: (N, 6) float64: low and high corner of a box; base, radius and height of a cylinder, and 0.
        cells: (M, 3) int32: the cells of all voxels, row by row, as they were given.
        first: (N + 1,) int64: where the cells of each row begin, and the end.
        others: What has another form, by the number of its row.
    """

    ids: Sequence[str]
    kinds: NDArray[np.uint8]
    numbers_m: NDArray[np.float64]
    cells: NDArray[np.int32]
    first: NDArray[np.int64]
    others: dict[int, Obstruction]

    @classmethod
    def of(cls, obstructions: Iterable[Obstruction]) -> Rows:
        """Return obstructions as rows, in their order."""
        if isinstance(obstructions, Rows):
            return obstructions
        gathered = Gathered()
        for one in obstructions:
            gathered.add(one)
        return gathered.rows()

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self.ids)

    @overload
    def __getitem__(self, number: int) -> Obstruction: ...
    @overload
    def __getitem__(self, number: slice) -> Sequence[Obstruction]: ...
    def __getitem__(self, number: int | slice) -> Obstruction | Sequence[Obstruction]:
        """Return one of them, or a tuple of several."""
        if isinstance(number, slice):
            return tuple(self[n] for n in range(*number.indices(len(self))))
        n = range(len(self))[number]
        if n in self.others:
            return self.others[n]
        if self.kinds[n] == VOXELS:
            return Obstruction(self.ids[n], Voxels(self.cells[self.first[n] : self.first[n + 1]]))  # type: ignore[arg-type]
        x, y, z, a, b, c = self.numbers_m[n].tolist()
        return Obstruction(
            self.ids[n], Box((x, y, z), (a, b, c)) if self.kinds[n] == BOX else Cylinder((x, y, z), a, b)
        )


class Gathered:
    """Obstructions that are gathered one after the other.

    Attributes:
        ids: Their ids.
    """

    def __init__(self) -> None:
        self.ids: list[str] = []
        self._kinds = bytearray()
        self._numbers_m = array("d")
        self._cells = array("i")
        self._counts = array("q", [0])
        self._others: dict[int, Obstruction] = {}

    def box(self, name: str, low: Sequence[float], high: Sequence[float]) -> None:
        """Add a box; nothing is checked, here and below."""
        self._row(name, BOX, (*low, *high))

    def cylinder(self, name: str, base: Sequence[float], radius: float, height: float) -> None:
        """Add a cylinder."""
        self._row(name, CYLINDER, (*base, radius, height, 0.0))

    def voxels(self, name: str, cells: Sequence[Sequence[int]]) -> None:
        """Add single cells."""
        self._row(name, VOXELS, _NO_NUMBERS)
        for cell in cells:
            self._cells.extend(cell)
        self._counts[-1] = len(cells)

    def add(self, one: Obstruction) -> None:
        """Add an obstruction of any form."""
        match one.form:
            case Box(low_m, high_m):
                self.box(one.id, low_m, high_m)
            case Cylinder(base_m, radius_m, height_m):
                self.cylinder(one.id, base_m, radius_m, height_m)
            case Voxels(cells):
                self.voxels(one.id, cells)
            case _:
                self._others[len(self.ids)] = one
                self._row(one.id, OTHER, _NO_NUMBERS)

    def scale(self, factor: float) -> None:
        """Turn all lengths so far into metres.

        Raises:
            InputError: If a box or a cylinder has no volume then; names it.
        """
        if factor == 1.0:
            return
        self._numbers_m = array("d", (np.frombuffer(self._numbers_m) * factor).tobytes())
        scaled = self.rows()
        numbers_m, is_box = scaled.numbers_m, scaled.kinds == BOX
        flat = is_box & (numbers_m[:, :3] >= numbers_m[:, 3:]).any(axis=1)
        flat |= (scaled.kinds == CYLINDER) & (numbers_m[:, 3:5] <= 0.0).any(axis=1)
        for n in np.flatnonzero(flat)[:1].tolist():
            raise InputError(f"obstruction {self.ids[n]!r} has no volume", hint="in metres, its size is rounded to 0")

    def rows(self) -> Rows:
        """Return them in the order in which they were added."""
        return Rows(
            self.ids,
            np.array(self._kinds, np.uint8),
            np.asarray(self._numbers_m, np.float64).reshape(-1, 6),
            np.asarray(self._cells, np.int32).reshape(-1, 3),
            np.cumsum(self._counts, dtype=np.int64),
            self._others,
        )

    def by_id(self) -> Rows:
        """Return them in the order of their ids."""
        given = self.rows()
        order = sorted(range(len(given)), key=given.ids.__getitem__)
        counts = np.diff(given.first)[order]
        first = np.concatenate([[0], np.cumsum(counts)])
        cells = np.repeat(given.first[order] - first[:-1], counts) + np.arange(len(given.cells))
        return Rows(
            [given.ids[n] for n in order],
            given.kinds[order],
            given.numbers_m[order],
            given.cells[cells],
            first,
            {new: given.others[old] for new, old in enumerate(order) if old in given.others},
        )

    def _row(self, name: str, kind: int, numbers_m: Iterable[float]) -> None:
        self.ids.append(name)
        self._kinds.append(kind)
        self._numbers_m.extend(numbers_m)
        self._counts.append(0)


_NO_NUMBERS = (0.0,) * 6
