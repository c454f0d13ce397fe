"""The owners of a large grid in bricks: memory grows with the parts, not with the box around them.

A brick of 8 x 8 x 8 cells with one value throughout (air, the inside of a part) takes four bytes; the others are stored
cell by cell. A value is the index of the owner plus one, 0 for none, in the narrowest unsigned type that holds it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.errors import shown
from bimvox.grid import brick_kernels as kernels
from bimvox.grid.brick_kernels import BRICK as BRICK  # re-exported

NO_OWNER = -1
"""Owner of a cell that no part meets."""


@dataclass(frozen=True, slots=True, eq=False)
class Bricks:
    """Owners of the cells of a grid, in bricks.

    Attributes:
        shape: (X, Y, Z) cells.
        index: (ceil(X / 8), ceil(Y / 8), ceil(Z / 8)) int32. From 0: the row of ``cells``. Below 0: every cell of the
            brick has the owner ``-2 - index`` (so -1 is a brick of air).
        cells: (N, 8, 8, 8) uint8, uint16 or uint32: owner + 1, 0 for none. Cells outside the grid are 0.
    """

    shape: tuple[int, int, int]
    index: NDArray[np.int32] = field(repr=False)
    cells: NDArray[np.unsignedinteger] = field(repr=False)

    @classmethod
    def of(cls, owners: NDArray[np.int32]) -> Bricks:
        """Return the bricks of a dense (X, Y, Z) int32 array of owners.

        Raises:
            ValueError: If an owner is below ``NO_OWNER``.
        """
        builder = BrickBuilder(owners.shape, int(owners.max(initial=NO_OWNER)) + 1)
        builder.enter((0, 0, 0), owners)
        return builder.bricks()

    @property
    def nbytes(self) -> int:
        """Bytes in memory."""
        return self.index.nbytes + self.cells.nbytes

    def box(self, low: ArrayLike, high: ArrayLike) -> NDArray[np.int32]:
        """Return the owners of the half-open box [low, high), which lies inside the grid, as a dense int32 array."""
        start, shape = self._inside(low, high)
        out = np.empty(shape, np.int32)
        kernels.read_owners(self.index, self.cells, start, out)
        return out

    def mapped_box(self, low: ArrayLike, high: ArrayLike, table: NDArray[Any]) -> NDArray[Any]:
        """Return ``table[owner + 1]`` of every cell of the half-open box [low, high), in the table's type."""
        start, shape = self._inside(low, high)
        out = np.empty(shape, table.dtype)
        if not kernels.read_mapped(self.index, self.cells, start, table, out):
            raise IndexError(f"a table of {len(table)} rows for owners up to {self.highest}")
        return out

    def mapped(self, table: NDArray[Any]) -> NDArray[Any]:
        """Return ``table[owner + 1]`` of every cell, (X, Y, Z) in the table's type."""
        return self.mapped_box((0, 0, 0), self.shape, table)

    def dense(self) -> NDArray[np.int32]:
        """Return all owners, (X, Y, Z) int32; takes four bytes per cell."""
        return self.box((0, 0, 0), self.shape)

    def slabs(self) -> Iterator[tuple[int, NDArray[np.int32]]]:
        """Yield the grid in dense slabs of at most 8 cells along x: the first x, and (8, Y, Z) owners."""
        for x in range(0, self.shape[0], BRICK):
            yield x, self.box((x, 0, 0), (min(x + BRICK, self.shape[0]), *self.shape[1:]))

    def occupied(self) -> Iterator[tuple[NDArray[np.int32], NDArray[np.int32]]]:
        """Yield the cells that have an owner, slab by slab, in ascending order: (N, 3) int32 cells, (N,) owners."""
        for x, owners in self.slabs():
            count = int(np.count_nonzero(owners >= 0))
            cells, found = np.empty((count, 3), np.int32), np.empty(count, np.int32)
            kernels.list_occupied(owners, x, cells, found)
            yield cells, found

    def layers(self, table: NDArray[Any]) -> Iterator[tuple[int, NDArray[Any]]]:
        """Yield the grid in at most 8 horizontal layers at a time: the first z, and ``table[owner + 1]``, (8, Y, X)."""
        if len(table) <= self.highest + 1:
            raise IndexError(f"a table of {len(table)} rows for owners up to {self.highest}")
        x, y, z = self.shape
        for low in range(0, z, BRICK):
            out = np.empty((min(BRICK, z - low), y, x), table.dtype)
            kernels.read_layers(self.index, self.cells, low, table, out)
            yield low, out

    def at(self, cells: NDArray[np.int32]) -> NDArray[np.int32]:
        """Return the owners of cells inside the grid: (N, 3) int32 -> (N,) int32."""
        if len(cells) and (cells.min() < 0 or np.any(cells.max(axis=0) >= self.shape)):
            raise IndexError(f"a cell is not inside {self.shape}")
        out = np.empty(len(cells), np.int32)
        kernels.owners_at(self.index, self.cells, np.ascontiguousarray(cells, np.int32), out)
        return out

    @property
    def highest(self) -> int:
        """The highest owner of a cell; ``NO_OWNER`` if all cells are air."""
        return max(int(self.cells.max(initial=0)) - 1, -2 - int(self.index.min(initial=-1)))

    def counts(self, parts: int) -> NDArray[np.int64]:
        """Return the number of cells that each part owns, (parts + 1,) int64: part n at n + 1, air at 0."""
        counts = np.zeros(max(parts, self.highest + 1) + 1, np.int64)
        kernels.count_owners(self.index, self.cells, self.shape, counts)
        return counts

    def _inside(self, low: ArrayLike, high: ArrayLike) -> tuple[NDArray[np.int64], tuple[int, int, int]]:
        start, stop = np.asarray(low, np.int64), np.asarray(high, np.int64)
        if np.any(start < 0) or np.any(stop > self.shape) or np.any(stop < start):
            raise IndexError(f"the box from {start.tolist()} to {stop.tolist()} is not inside {self.shape}")
        x, y, z = (int(n) for n in stop - start)
        return start, (x, y, z)


class BrickBuilder:
    """Collects dense boxes of owners into bricks; the whole grid is never dense in memory.

    Args:
        shape: (X, Y, Z) cells of the grid; initially all air.
        parts: Number of parts, which decides the type of the cells.
    """

    def __init__(self, shape: tuple[int, ...], parts: int) -> None:
        x, y, z = shape
        self._shape = (x, y, z)
        self._parts = parts
        self._rows = 0
        self._clear()

    def enter(self, low: tuple[int, int, int], owners: NDArray[np.int32]) -> None:
        """Enter a box that starts at the cell ``low``; each brick only once.

        Raises:
            ValueError: If an owner is not one of the parts, or the box does not consist of whole bricks.
        """
        high = [start + size for start, size in zip(low, owners.shape, strict=True)]
        for start, stop, size in zip(low, high, self._shape, strict=True):
            if start % BRICK or start < 0 or stop > size or (stop % BRICK and stop != size):
                raise ValueError(
                    f"the box from {shown(low)} to {shown(high)} is not made of whole bricks of {self._shape}"
                )
        self._reserve(int(np.prod([-(-n // BRICK) for n in owners.shape])))
        at = np.array(low, np.int64) // BRICK
        rows: int = kernels.enter_owners(owners, at, self._index, self._cells, self._rows, self._parts)
        if rows < 0:
            raise ValueError(f"an owner is out of range of the {self._parts} parts")
        self._rows = rows

    def bricks(self) -> Bricks:
        """Return the bricks; the builder is empty afterwards."""
        self._cells.resize((self._rows, BRICK, BRICK, BRICK), refcheck=False)
        made = Bricks(self._shape, self._index, self._cells)
        self._clear()
        return made

    def _clear(self) -> None:
        self._index = np.full([-(-n // BRICK) for n in self._shape], -1, np.int32)
        self._cells = np.zeros((0, BRICK, BRICK, BRICK), np.min_scalar_type(self._parts))
        self._rows = 0

    def _reserve(self, more: int) -> None:
        """Make room for this many more bricks, without copying what is there where the system can move pages."""
        if self._rows + more > len(self._cells):
            rows = self._rows + max(more, self._rows // 2)
            self._cells.resize((rows, BRICK, BRICK, BRICK), refcheck=False)
