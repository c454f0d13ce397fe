"""Who owns a cell that several parts meet: the part that fills most of it.

Parts are entered one after the other, in the order of their indices, straight into bricks of 8 x 8 x 8 cells: a brick
that lies wholly inside one part, and nothing else, never takes memory. While parts are entered every cell of the other
bricks has its owner's share beside it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import inline_kernel, kernel, leaf_kernel
from bimvox.grid.bricks import BRICK, Bricks
from bimvox.voxelize.part import PartVoxels
from bimvox.voxelize.sweep import FULL

# Set in a cell's mark, beside its owner's share, once its first part has a row in the list of shared cells.
_LISTED = 1 << 15
_SHARE = _LISTED - 1
_AIR = -1
# Bricks that there is room for from the start.
_RESERVED = 1 << 20


@inline_kernel
def _enter_run(
    cells: NDArray[Any],
    marks: NDArray[np.uint16],
    first: int,
    stop: int,
    part: int,
    shares: NDArray[np.uint16],
    share_at: int,
    rank: int,
    row_ranks: NDArray[np.int64],
    row_parts: NDArray[np.int32],
    row_shares: NDArray[np.uint16],
    rows: int,
) -> int:
    """Enter a run of a part's cells within one brick; returns the number of rows of the list of shared cells."""
    for at in range(first, stop):
        share = FULL
        if share_at >= 0:
            share = int(np.int64(shares[share_at + at - first]))
        owner = int(np.int64(cells[at]))
        if owner == 0:
            cells[at] = part + 1
            marks[at] = share
            continue
        mark = int(np.int64(marks[at]))
        held = mark & _SHARE
        if mark & _LISTED == 0:
            row_ranks[rows], row_parts[rows], row_shares[rows] = rank + at - first, owner - 1, held
            rows += 1
        row_ranks[rows], row_parts[rows], row_shares[rows] = rank + at - first, part, share
        rows += 1
        if share > held:
            cells[at] = part + 1
            held = share
        marks[at] = held | _LISTED
    return rows


@leaf_kernel
def _enter(
    index: NDArray[np.int32],
    cells: NDArray[Any],
    marks: NDArray[np.uint16],
    used: int,
    shape: tuple[int, int, int],
    start: tuple[int, int, int],
    size: tuple[int, int, int],
    columns: NDArray[np.int32],
    runs: NDArray[np.int32],
    shares: NDArray[np.uint16],
    part: int,
    row_ranks: NDArray[np.int64],
    row_parts: NDArray[np.int32],
    row_shares: NDArray[np.uint16],
    rows: int,
    first: int,
    whole: NDArray[np.int32],
) -> tuple[int, int, int]:
    """Enter one part, stack of bricks by stack of bricks, from number ``first`` of those under its box.

    ``whole`` is scratch: one number for each brick of a stack, and one more.

    Returns:
        The stack to go on with when there is more room (the number of stacks, when all are done), the bricks used and
        the rows used.
    """
    bx0, by0, bz0 = start[0] // BRICK, start[1] // BRICK, start[2] // BRICK
    nx = (start[0] + size[0] - 1) // BRICK - bx0 + 1
    ny = (start[1] + size[1] - 1) // BRICK - by0 + 1
    nz = (start[2] + size[2] - 1) // BRICK - bz0 + 1
    room = cells.size // BRICK**3
    bulky = False
    for n in range(runs.shape[0]):
        bulky = bulky or (runs[n, 2] < 0 and runs[n, 1] - runs[n, 0] >= BRICK)
    for stack in range(first, nx * ny):
        bx, by = bx0 + stack // ny, by0 + stack % ny
        i0, i1 = max(bx * BRICK, start[0]), min(bx * BRICK + BRICK, start[0] + size[0])
        j0, j1 = max(by * BRICK, start[1]), min(by * BRICK + BRICK, start[1] + size[1])
        if used + nz > room or rows + 2 * (i1 - i0) * (j1 - j0) * size[2] > row_ranks.size:
            return stack, used, rows
        # How many columns of the part fill each brick from bottom to top.
        for b in range(nz + 1):
            whole[b] = 0
        for x in range(i0, i1 if bulky else i0):
            for y in range(j0, j1):
                column = (x - start[0]) * size[1] + y - start[1]
                for n in range(columns[column], columns[column + 1]):
                    if runs[n, 2] < 0:
                        low, high = runs[n, 0] + start[2], runs[n, 1] + start[2]
                        b0 = (low + BRICK - 1) // BRICK
                        b1 = (high + BRICK - 1 if high == shape[2] else high) // BRICK
                        if b0 < b1:
                            whole[b0 - bz0] += 1
                            whole[b1 - bz0] -= 1
        in_grid = min(BRICK, shape[0] - bx * BRICK) * min(BRICK, shape[1] - by * BRICK)
        for b in range(nz):
            if b > 0:
                whole[b] += whole[b - 1]
        for b in range(nz):
            filled = whole[b] == in_grid and index[bx, by, bz0 + b] == _AIR
            if filled:
                index[bx, by, bz0 + b] = -part - 2
            whole[b] = int(filled)
        for x in range(i0, i1):
            for y in range(j0, j1):
                column = (x - start[0]) * size[1] + y - start[1]
                row_rank = (x * shape[1] + y) * shape[2]
                for n in range(columns[column], columns[column + 1]):
                    share_at = runs[n, 2]
                    z, stop = runs[n, 0] + start[2], runs[n, 1] + start[2]
                    while z < stop:
                        b = z // BRICK
                        until = min(b * BRICK + BRICK, stop)
                        if whole[b - bz0]:
                            z = until
                            continue
                        brick = index[bx, by, b]
                        if brick < 0:
                            if brick != _AIR:
                                for at in range(used * BRICK**3, (used + 1) * BRICK**3):
                                    cells[at] = -brick - 1
                                    marks[at] = FULL
                            brick = used
                            index[bx, by, b] = brick
                            used += 1
                        base = ((brick * BRICK + x % BRICK) * BRICK + y % BRICK) * BRICK - b * BRICK
                        rows = _enter_run(
                            cells,
                            marks,
                            base + z,
                            base + until,
                            part,
                            shares,
                            share_at,
                            row_rank + z,
                            row_ranks,
                            row_parts,
                            row_shares,
                            rows,
                        )
                        if share_at >= 0:
                            share_at += until - z
                        z = until
    return nx * ny, used, rows


@kernel
def _settle(index: NDArray[np.int32], cells: NDArray[Any], shape: tuple[int, int, int], out: NDArray[Any]) -> int:
    """Copy the bricks that hold several owners to ``out``, in order, and turn the others into plain numbers."""
    used = 0
    for bx in range(index.shape[0]):
        x1 = min(BRICK, shape[0] - bx * BRICK)
        for by in range(index.shape[1]):
            y1 = min(BRICK, shape[1] - by * BRICK)
            for bz in range(index.shape[2]):
                brick = index[bx, by, bz]
                if brick < 0:
                    continue
                z1 = min(BRICK, shape[2] - bz * BRICK)
                base, to = brick * BRICK**3, used * BRICK**3
                owner = cells[base]
                others = 0
                if x1 * y1 * z1 == BRICK**3:
                    for n in range(BRICK**3):
                        others |= cells[base + n] ^ owner
                        out[to + n] = cells[base + n]
                else:
                    # Cells beyond the grid are nobody's.
                    for n in range(BRICK**3):
                        out[to + n] = 0
                    for x in range(x1):
                        for y in range(y1):
                            for n in range((x * BRICK + y) * BRICK, (x * BRICK + y) * BRICK + z1):
                                others |= cells[base + n] ^ owner
                                out[to + n] = cells[base + n]
                if others == 0:
                    index[bx, by, bz] = -np.int64(owner) - 1
                else:
                    index[bx, by, bz] = used
                    used += 1
    return used


class Ownership:
    """Collects parts, in the order of their indices, into owners and the list of shared cells.

    Args:
        low: (3,) lattice cell of the grid's cell (0, 0, 0).
        high: (3,) one past its highest cell.
        parts: Number of parts to come.
    """

    def __init__(self, low: NDArray[np.int64], high: NDArray[np.int64], parts: int) -> None:
        x, y, z = (int(n) for n in high - low)
        self._low = low
        self._shape = (x, y, z)
        self._parts = parts
        self._index = np.full((-(-x // BRICK), -(-y // BRICK), -(-z // BRICK)), _AIR, np.int32)
        # Zeros take no memory until they are written to.
        reserved = min(self._index.size, _RESERVED) * BRICK**3
        self._cells: NDArray[Any] = np.zeros(reserved, np.uint16 if parts < 1 << 16 else np.uint32)
        self._marks = np.zeros(reserved, np.uint16)
        self._row_ranks = np.zeros(0, np.int64)
        self._row_parts = np.zeros(0, np.int32)
        self._row_shares = np.zeros(0, np.uint16)
        self._used = 0
        self._rows = 0

    def add(self, index: int, voxels: PartVoxels) -> None:
        """Enter the next part: it takes air, and cells of which it fills more than their owner so far."""
        if voxels.count == 0:
            return
        x, y, z = (int(n) for n in voxels.low - self._low)
        a, b, _ = voxels.shape
        stacks = ((x + a - 1) // BRICK - x // BRICK + 1) * ((y + b - 1) // BRICK - y // BRICK + 1)
        stack = 0
        whole = np.empty(voxels.shape[2] // BRICK + 3, np.int32)
        while True:
            stack, self._used, self._rows = _enter(
                self._index,
                self._cells,
                self._marks,
                self._used,
                self._shape,
                (x, y, z),
                voxels.shape,
                voxels.columns,
                voxels.runs,
                voxels.shares,
                index,
                self._row_ranks,
                self._row_parts,
                self._row_shares,
                self._rows,
                stack,
                whole,
            )
            if stack == stacks:
                return
            self._make_room(voxels.shape[2])

    def _make_room(self, height: int) -> None:
        """Make room for at least one more stack of bricks of a part of this height."""
        # In place: a copy would take the memory twice.
        bricks = self._used + height // BRICK + 2
        if bricks * BRICK**3 > self._cells.size:
            bricks = max(bricks, self._used + self._used // 2) * BRICK**3
            self._cells.resize(bricks, refcheck=False)
            self._marks.resize(bricks, refcheck=False)
        rows = self._rows + 2 * BRICK * BRICK * height
        if rows > self._row_ranks.size:
            rows = max(rows, self._rows + self._rows // 2)
            self._row_ranks.resize(rows, refcheck=False)
            self._row_parts.resize(rows, refcheck=False)
            self._row_shares.resize(rows, refcheck=False)

    def owners(self) -> Bricks:
        """Return the owners; parts can no longer be added."""
        self._marks = np.zeros(0, np.uint16)
        # One more: what turns out to hold one owner is written, then written over.
        out = np.empty((self._used + 1) * BRICK**3, np.min_scalar_type(self._parts))
        used = _settle(self._index, self._cells, self._shape, out)
        self._cells = np.zeros(0, self._cells.dtype)
        out.resize(used * BRICK**3, refcheck=False)
        return Bricks(self._shape, self._index, out.reshape(used, BRICK, BRICK, BRICK))

    def shared(self) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.float32]]:
        """Return the rows of the cells met by several parts, sorted by cell, then part: cells, parts, shares."""
        # Rows of one cell are in the order of the parts already.
        order = np.argsort(self._row_ranks[: self._rows], kind="stable")
        cells = np.stack(np.unravel_index(self._row_ranks[order], self._shape), axis=1).astype(np.int32)
        return cells, self._row_parts[order], (self._row_shares[order] / np.float32(FULL)).astype(np.float32)
