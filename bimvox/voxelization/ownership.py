"""The owner of a cell that several parts meet: the part that fills most of it.

Parts are entered in the order of their indices, straight into bricks of 8 x 8 x 8 cells. A brick that lies wholly
inside one part takes no memory. For the other bricks, each owner's share is kept until all parts are entered.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.grid.bricks import BRICK, Bricks
from bimvox.voxelization.owner_kernels import (
    AIR,
    EnterScratch,
    OwnerBricks,
    PartQueue,
    PartRuns,
    SharedRows,
    enter,
    enter_batch,
    settle,
    sorted_rows,
)
from bimvox.voxelization.part import Batch, PartVoxels

# Initial room, in bricks and in rows of the list of shared cells.
_RESERVED = 1 << 20


class Ownership:
    """Collects parts, in the order of their indices, into owners and a list of shared cells.

    Args:
        low: (3,) lattice cell of the grid's cell (0, 0, 0).
        high: (3,) one past its highest cell.
        parts: Number of parts that will be added.
    """

    def __init__(self, low: NDArray[np.int64], high: NDArray[np.int64], parts: int) -> None:
        x, y, z = (int(n) for n in high - low)
        self._low = low
        self._shape = (x, y, z)
        self._parts = parts
        self._index = np.full((-(-x // BRICK), -(-y // BRICK), -(-z // BRICK)), AIR, np.int32)
        # Zeros take no memory until they are first written to.
        reserved = min(self._index.size, _RESERVED) * BRICK**3
        self._cells: NDArray[Any] = np.zeros(reserved, np.uint16 if parts < 1 << 16 else np.uint32)
        self._marks = np.zeros(reserved, np.uint16)
        self._row_ranks = np.empty(_RESERVED, np.int64)
        self._row_parts = np.empty(_RESERVED, np.int32)
        self._row_shares = np.empty(_RESERVED, np.uint16)
        self._own = np.empty((2, BRICK), self._cells.dtype)
        self._held = np.empty(BRICK, np.uint16)
        self._used = 0
        self._rows = 0

    def add(self, index: int, voxels: PartVoxels) -> None:
        """Add the next part: it takes air, and cells of which it fills more than their owner so far."""
        if voxels.count == 0:
            return
        x, y, z = (int(n) for n in voxels.low - self._low)
        a, b, c = voxels.shape
        stacks = ((x + a - 1) // BRICK - x // BRICK + 1) * ((y + b - 1) // BRICK - y // BRICK + 1)
        stack = 0
        scratch = self._scratch(c)
        runs = PartRuns((x, y, z), voxels.shape, voxels.columns, voxels.runs, voxels.shares)
        while stack < stacks:
            stack, self._used, self._rows = enter(
                self._bricks(), self._shared_rows(), scratch, runs, index, stack, self._used, self._rows
            )
            if stack < stacks:
                self._make_room(c)

    def add_batch(
        self,
        first_index: int,
        batch: Batch,
        places: NDArray[np.int64],
        lows: NDArray[np.int64],
        first: int,
        stop: int,
    ) -> None:
        """Add some parts of a batch, or repeats of them, in their order.

        Args:
            first_index: Index of the part with number 0.
            batch: The voxels of the parts.
            places: (P,) for each part, the part of the batch that it is like.
            lows: (P, 3) lattice cell of the lowest corner of each part's box.
            first: Number of the first part to add.
            stop: One past the last.
        """
        heights = batch.shapes[places[first:stop], 2]
        scratch = self._scratch(int(heights.max(initial=0)))
        queue = PartQueue(first_index, stop, self._low, places, lows, batch)
        part, stack = first, 0
        while part < stop:
            part, stack, self._used, self._rows = enter_batch(
                self._bricks(), self._shared_rows(), scratch, queue, part, stack, self._used, self._rows
            )
            if part < stop:
                self._make_room(int(heights[part - first]))

    def _bricks(self) -> OwnerBricks:
        words, mark_words = self._cells.view(np.uint64), self._marks.view(np.uint64)
        return OwnerBricks(self._index, self._cells, words, self._marks, mark_words, self._shape)

    def _shared_rows(self) -> SharedRows:
        return SharedRows(self._row_ranks, self._row_parts, self._row_shares)

    def _scratch(self, height: int) -> EnterScratch:
        """Return scratch for parts of up to this many cells along z."""
        whole = np.empty(height // BRICK + 3, np.int32)
        return EnterScratch(whole, self._own, self._own.view(np.uint64), self._held, self._held.view(np.uint64))

    def _make_room(self, height: int) -> None:
        """Make room for at least one more stack of bricks of a part of this height."""
        # In place: a copy would need the memory twice.
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
        """Return the owners. No part can be added afterwards."""
        dtype = np.min_scalar_type(self._parts)
        # Writing never overtakes reading, and the marks are no longer needed.
        if dtype.itemsize <= self._marks.itemsize:
            out = self._marks.view(dtype)
        else:
            out = np.empty(self._used * BRICK**3, dtype)
        same = dtype == self._cells.dtype
        words, out_words = (a.view(np.uint64) if same else np.empty(0, np.uint64) for a in (self._cells, out))
        used = settle(self._index, self._cells, self._shape, out, words, out_words)
        del words, out_words
        self._cells = np.zeros(0, self._cells.dtype)
        if dtype.itemsize <= self._marks.itemsize:
            del out
            kept, self._marks = self._marks, np.zeros(0, np.uint16)
            kept.resize(used * BRICK**3 * dtype.itemsize // kept.itemsize, refcheck=False)
            out = kept.view(dtype)
        else:
            out.resize(used * BRICK**3, refcheck=False)
        return Bricks(self._shape, self._index, out.reshape(used, BRICK, BRICK, BRICK))

    def shared(self) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.float32]]:
        """Return the rows of the cells that several parts meet, by cell, then part: cells, parts, fractions."""
        # The rows of a cell are in the order of the parts already.
        return sorted_rows(
            self._row_ranks[: self._rows], self._row_parts[: self._rows], self._row_shares[: self._rows], self._shape
        )
