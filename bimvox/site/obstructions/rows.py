"""Very many obstructions as arrays: a row each, and an object only for the one that is asked for."""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import overload

import numpy as np
from numpy.typing import NDArray

from bimvox.errors import InputError
from bimvox.site.obstructions.obstruction_set import Box, Cylinder, Obstruction, Voxels

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
