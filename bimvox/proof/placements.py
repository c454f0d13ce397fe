"""The whole placements around a load's continuous positions: what the proof of a motion looks up cells for."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import inline_kernel, kernel

_ROOM = 4096
"""Initial size of the cell table, a power of two."""


class Placements:
    """The whole placements whose cells together cover a load at continuous reference cells: up to eight per position.

    Args:
        positions: (N, 3) float64 reference cells.
        slack_vox: (N,) positions this close to a whole cell are snapped to it.

    Attributes:
        cells: (U, 3) int64 unique reference cells of the placements.
    """

    def __init__(self, positions: NDArray[np.float64], slack_vox: NDArray[np.float64]) -> None:
        self._positions = np.ascontiguousarray(positions, np.float64)
        self._slack_vox = np.ascontiguousarray(slack_vox, np.float64)
        self.cells: NDArray[np.int64] = _numbered(self._positions, self._slack_vox, False)[0]

    @cached_property
    def around(self) -> NDArray[np.int64]:
        """(8, N) int64 rows of ``cells`` around each position; some may be equal."""
        around: NDArray[np.int64] = _numbered(self._positions, self._slack_vox, True)[1]
        return around

    def at_positions(self, found: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return (N,) whether ``found`` ((U,) bool) holds for any placement around each position."""
        if not found.any():
            return np.zeros(len(self._positions), np.bool_)
        at: NDArray[np.bool_] = _any_around(found, self.around)
        return at

    def at(self, position: int) -> NDArray[np.int64]:
        """Return (M, 3) the placements around one position."""
        placements: NDArray[np.int64] = self.cells[np.unique(self.around[:, position])]
        return placements


@kernel
def _numbered(
    cells: NDArray[np.float64], slack_vox: NDArray[np.float64], with_numbers: bool
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Number the whole cells around positions in order of appearance; optionally list those around each position.

    Most positions are between the same whole cells as the previous one; the cells of others are found in a hash table.
    """
    count = cells.shape[0]
    at = np.empty((8, count if with_numbers else 0), np.int64)
    whole, table, total = np.empty((_ROOM // 2, 3), np.int64), np.zeros(_ROOM, np.int32), 0
    ends, before = np.zeros((2, 3), np.int64), np.zeros((2, 3), np.int64)
    for n in range(count):
        anew = n == 0
        for k in range(3):
            ends[0, k] = int(np.floor(cells[n, k] + slack_vox[n]))
            ends[1, k] = int(np.ceil(cells[n, k] - slack_vox[n]))
            anew |= ends[0, k] != before[0, k] or ends[1, k] != before[1, k]
            before[0, k], before[1, k] = ends[0, k], ends[1, k]
        if not anew:
            for c in range(8 if with_numbers else 0):
                at[c, n] = at[c, n - 1]
            continue
        if total + 8 > whole.shape[0]:
            whole, table = _with_more_room(whole, total)
        for c in range(8):
            x, y, z = ends[c // 4, 0], ends[c // 2 % 2, 1], ends[c % 2, 2]
            slot = _slot(table, whole, x, y, z)
            if table[slot] == 0:
                whole[total, 0], whole[total, 1], whole[total, 2] = x, y, z
                total += 1
                table[slot] = total
            if with_numbers:
                at[c, n] = table[slot] - 1
    return whole[:total].copy(), at


@inline_kernel
def _slot(table: NDArray[np.int32], whole: NDArray[np.int64], x: int, y: int, z: int) -> int:
    """Return the slot of a cell's number plus one in a hash table that is at least half empty; a free slot if absent.

    Open addressing; the hash is that of Teschner et al., Optimized Spatial Hashing for Collision Detection of
    Deformable Objects (2003).
    """
    last = table.shape[0] - 1
    slot: int = (x * 73856093 ^ y * 19349663 ^ z * 83492791) & last
    while table[slot] > 0:
        number = table[slot] - 1
        if whole[number, 0] == x and whole[number, 1] == y and whole[number, 2] == z:
            break
        slot = (slot + 1) & last
    return slot


@kernel
def _with_more_room(whole: NDArray[np.int64], total: int) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Return arrays for four times as many cells, with the table of the existing ones."""
    more = np.empty((4 * whole.shape[0], 3), np.int64)
    table = np.zeros(2 * more.shape[0], np.int32)
    for n in range(total):
        more[n] = whole[n]
        table[_slot(table, more, more[n, 0], more[n, 1], more[n, 2])] = n + 1
    return more, table


@kernel
def _any_around(found: NDArray[np.bool_], around: NDArray[np.int64]) -> NDArray[np.bool_]:
    at = np.zeros(around.shape[1], np.bool_)
    for c in range(around.shape[0]):
        for n in range(around.shape[1]):
            at[n] |= found[around[c, n]]
    return at
