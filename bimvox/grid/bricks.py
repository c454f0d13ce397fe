"""The owners of a large grid in bricks: memory grows with the parts, not with the box around them.

A brick of 8 x 8 x 8 cells with one value throughout (air, the inside of a part) takes four bytes; the others are stored
cell by cell. A value is the index of the owner plus one, 0 for none, in the narrowest unsigned type that holds it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.compiled import kernel
from bimvox.errors import shown

BRICK = 8
"""Edge of a brick, cells."""


@kernel
def _read(
    index: NDArray[np.int32],
    cells: NDArray[np.unsignedinteger],
    low: NDArray[np.int64],
    table: NDArray[np.generic],
    out: NDArray[np.generic],
) -> bool:
    """Fill ``out`` with ``table[owner + 1]``, or with the owners if the table is empty.

    ``out`` is a box inside the grid that starts at ``low``. Return whether every owner is in the table.
    """
    owners = table.size == 0
    for i in range(out.shape[0]):
        x = low[0] + i
        for j in range(out.shape[1]):
            y = low[1] + j
            k = 0
            while k < out.shape[2]:
                z = low[2] + k
                stop = min(out.shape[2], k + BRICK - z % BRICK)
                at = index[x // BRICK, y // BRICK, z // BRICK]
                for n in range(k, stop):
                    value = -at - 1 if at < 0 else np.int64(cells[at, x % BRICK, y % BRICK, (low[2] + n) % BRICK])
                    if owners:
                        out[i, j, n] = value - 1
                    elif value < table.size:
                        out[i, j, n] = table[value]
                    else:
                        return False
                k = stop
    return True


@kernel
def _read_layers(
    index: NDArray[np.int32],
    cells: NDArray[np.unsignedinteger],
    low: int,
    table: NDArray[np.generic],
    out: NDArray[np.generic],
) -> None:
    """Fill ``out``, indexed [z, y, x], with ``table[owner + 1]`` of horizontal cell layers in one layer of bricks.

    ``low`` is the z index of the first layer; ``table`` has a row for every owner.
    """
    layer = low // BRICK
    for b in range(index.shape[1]):
        for a in range(index.shape[0]):
            at = index[a, b, layer]
            for k in range(out.shape[0]):
                for y in range(b * BRICK, min(b * BRICK + BRICK, out.shape[1])):
                    for x in range(a * BRICK, min(a * BRICK + BRICK, out.shape[2])):
                        value = -at - 1 if at < 0 else np.int64(cells[at, x % BRICK, y % BRICK, low % BRICK + k])
                        out[k, y, x] = table[value]


@kernel
def _enter_owners(
    owners: NDArray[np.int32],
    low: NDArray[np.int64],
    index: NDArray[np.int32],
    cells: NDArray[np.unsignedinteger],
    row: int,
    parts: int,
) -> int:
    """Store a dense box of whole bricks that starts at the brick ``low``; return the next free row of ``cells``.

    Return -1, with some of the bricks stored, if an owner is neither -1 nor below ``parts``.
    """
    nx, ny, nz = owners.shape
    for x0 in range(0, nx, BRICK):
        x1 = min(x0 + BRICK, nx)
        for y0 in range(0, ny, BRICK):
            y1 = min(y0 + BRICK, ny)
            for z0 in range(0, nz, BRICK):
                z1 = min(z0 + BRICK, nz)
                first = owners[x0, y0, z0]
                same = True
                for x in range(x0, x1):
                    for y in range(y0, y1):
                        for z in range(z0, z1):
                            owner = owners[x, y, z]
                            if owner < -1 or owner >= parts:
                                return -1
                            same &= owner == first
                at = -2 - first
                if not same:
                    at = row
                    row += 1
                    cells[at] = 0
                    for x in range(x0, x1):
                        for y in range(y0, y1):
                            for z in range(z0, z1):
                                cells[at, x - x0, y - y0, z - z0] = owners[x, y, z] + 1
                index[low[0] + x0 // BRICK, low[1] + y0 // BRICK, low[2] + z0 // BRICK] = at
    return row


@kernel
def _count_owners(
    index: NDArray[np.int32],
    cells: NDArray[np.unsignedinteger],
    shape: tuple[int, int, int],
    counts: NDArray[np.int64],
) -> None:
    """Add the number of cells of every owner to ``counts``; owner n has index n + 1."""
    for a in range(index.shape[0]):
        nx = min(BRICK, shape[0] - a * BRICK)
        for b in range(index.shape[1]):
            ny = min(BRICK, shape[1] - b * BRICK)
            for c in range(index.shape[2]):
                nz = min(BRICK, shape[2] - c * BRICK)
                at = index[a, b, c]
                if at < 0:
                    counts[-at - 1] += nx * ny * nz
                else:
                    for x in range(nx):
                        for y in range(ny):
                            for z in range(nz):
                                counts[cells[at, x, y, z]] += 1


@kernel
def _list_occupied(owners: NDArray[np.int32], x0: int, cells: NDArray[np.int32], found: NDArray[np.int32]) -> int:
    """Write the cells of a dense slab that have an owner, and the owners; return how many."""
    row = 0
    for i in range(owners.shape[0]):
        for j in range(owners.shape[1]):
            for k in range(owners.shape[2]):
                if owners[i, j, k] >= 0:
                    cells[row, 0], cells[row, 1], cells[row, 2] = x0 + i, j, k
                    found[row] = owners[i, j, k]
                    row += 1
    return row


@kernel
def _owners_at(
    index: NDArray[np.int32],
    cells: NDArray[np.unsignedinteger],
    points: NDArray[np.int32],
    out: NDArray[np.int32],
) -> None:
    """Fill ``out`` with the owners of single cells inside the grid."""
    for n in range(points.shape[0]):
        x, y, z = points[n, 0], points[n, 1], points[n, 2]
        at = index[x // BRICK, y // BRICK, z // BRICK]
        out[n] = -at - 2 if at < 0 else np.int32(cells[at, x % BRICK, y % BRICK, z % BRICK]) - 1


Integer = TypeVar("Integer", bound=np.integer)


def distinct(values: NDArray[Integer]) -> NDArray[Integer]:
    """Return the distinct values in ascending order, as ``numpy.unique`` does.

    Since version 2.3 ``numpy.unique`` uses a hash table for integers, which is two hundred times slower for the indices
    of cells: four seconds for 1.7 million of them.

    ``values``: (N,) integers.
    """
    ascending = np.sort(values)
    return ascending[np.concatenate([[True], ascending[1:] != ascending[:-1]])] if len(ascending) else ascending


_NO_TABLE = np.empty(0, np.int32)
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

        Raises ValueError: if an owner is below ``NO_OWNER``.
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
        _read(self.index, self.cells, start, _NO_TABLE, out)
        return out

    def mapped_box(self, low: ArrayLike, high: ArrayLike, table: NDArray[Any]) -> NDArray[Any]:
        """Return ``table[owner + 1]`` of every cell of the half-open box [low, high), in the table's type."""
        start, shape = self._inside(low, high)
        out = np.empty(shape, table.dtype)
        if not _read(self.index, self.cells, start, table, out):
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
            _list_occupied(owners, x, cells, found)
            yield cells, found

    def layers(self, table: NDArray[Any]) -> Iterator[tuple[int, NDArray[Any]]]:
        """Yield the grid in at most 8 horizontal layers at a time: the first z, and ``table[owner + 1]``, (8, Y, X)."""
        if len(table) <= self.highest + 1:
            raise IndexError(f"a table of {len(table)} rows for owners up to {self.highest}")
        x, y, z = self.shape
        for low in range(0, z, BRICK):
            out = np.empty((min(BRICK, z - low), y, x), table.dtype)
            _read_layers(self.index, self.cells, low, table, out)
            yield low, out

    def at(self, cells: NDArray[np.int32]) -> NDArray[np.int32]:
        """Return the owners of cells inside the grid: (N, 3) int32 -> (N,) int32."""
        if len(cells) and (cells.min() < 0 or np.any(cells.max(axis=0) >= self.shape)):
            raise IndexError(f"a cell is not inside {self.shape}")
        out = np.empty(len(cells), np.int32)
        _owners_at(self.index, self.cells, np.ascontiguousarray(cells, np.int32), out)
        return out

    @property
    def highest(self) -> int:
        """The highest owner of a cell; ``NO_OWNER`` if all cells are air."""
        return max(int(self.cells.max(initial=0)) - 1, -2 - int(self.index.min(initial=-1)))

    def counts(self, parts: int) -> NDArray[np.int64]:
        """Return the number of cells that each part owns, (parts + 1,) int64: part n at n + 1, air at 0."""
        counts = np.zeros(max(parts, self.highest + 1) + 1, np.int64)
        _count_owners(self.index, self.cells, self.shape, counts)
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

        Raises ValueError: if an owner is not one of the parts, or the box does not consist of whole bricks.
        """
        high = [start + size for start, size in zip(low, owners.shape, strict=True)]
        for start, stop, size in zip(low, high, self._shape, strict=True):
            if start % BRICK or start < 0 or stop > size or (stop % BRICK and stop != size):
                raise ValueError(
                    f"the box from {shown(low)} to {shown(high)} is not made of whole bricks of {self._shape}"
                )
        self._reserve(int(np.prod([-(-n // BRICK) for n in owners.shape])))
        at = np.array(low, np.int64) // BRICK
        rows: int = _enter_owners(owners, at, self._index, self._cells, self._rows, self._parts)
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
