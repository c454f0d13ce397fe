"""The cells of a part as planes of bits: 64 cells of a column in one word, so a run of cells costs as much as one.

A plane is (A, B, ceil(C / 64)) uint64; cell (i, j, k) is bit k % 64 of word (i, j, k // 64).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import inline_kernel, kernel

WORD = 64
"""Cells in a word."""
ONE = np.uint64(1)
NONE = np.uint64(0)
EVERY = np.uint64(0xFFFFFFFFFFFFFFFF)

_PAIRS = np.uint64(0x5555555555555555)
_FOURS = np.uint64(0x3333333333333333)
_EIGHTS = np.uint64(0x0F0F0F0F0F0F0F0F)
_BYTES = np.uint64(0x0101010101010101)
_BY_2 = np.uint64(2)
_BY_4 = np.uint64(4)
_TOP_BYTE = np.uint64(56)


class CellPlanes(NamedTuple):
    """The cells of a part, sorted into three planes of bits; no cell is in two of them.

    Attributes:
        met: (A, B, W) uint64, cells that the surface meets.
        inside: (A, B, W) uint64, cells inside the solid.
        border: (A, B, W) uint64, cells that belong to the part by the half-open rule only (``borders.py``).
        height: Cells of a column.
    """

    met: NDArray[np.uint64]
    inside: NDArray[np.uint64]
    border: NDArray[np.uint64]
    height: int


@inline_kernel
def population(word: np.uint64) -> int:
    """Return how many bits are set (Warren 2012, "Hacker's Delight", 5-1; compilers turn it into one instruction)."""
    pairs = word - (word >> ONE & _PAIRS)
    fours = (pairs & _FOURS) + (pairs >> _BY_2 & _FOURS)
    return int(np.int64((fours + (fours >> _BY_4) & _EIGHTS) * _BYTES >> _TOP_BYTE))


@inline_kernel
def lowest(word: np.uint64) -> int:
    """Return the index of the lowest set bit; the word must not be 0."""
    return population((word & (~word + ONE)) - ONE)


@inline_kernel
def stretch(first: int, stop: int) -> np.uint64:
    """Return a word with the bits first <= k < stop set, 0 <= first < stop <= 64."""
    return (EVERY << np.uint64(first)) & (EVERY >> np.uint64(WORD - stop))


@inline_kernel
def has(plane: NDArray[np.uint64], i: int, j: int, k: int) -> bool:
    """Return whether a cell's bit is set."""
    return bool(plane[i, j, k >> 6] >> np.uint64(k & 63) & ONE)


@inline_kernel
def set_run(plane: NDArray[np.uint64], i: int, j: int, first: int, last: int) -> None:
    """Set the bits of the cells first <= k <= last of a column."""
    w = first >> 6
    w_last = last >> 6
    low = EVERY << np.uint64(first & 63)
    high = EVERY >> np.uint64(63 - (last & 63))
    if w == w_last:
        plane[i, j, w] |= low & high
        return
    plane[i, j, w] |= low
    for n in range(w + 1, w_last):
        plane[i, j, n] = EVERY
    plane[i, j, w_last] |= high


def empty_plane(a: int, b: int, c: int) -> NDArray[np.uint64]:
    """Return a plane of zeros for (a, b, c) cells; pages take memory when they are first written to."""
    return np.zeros((a, b, (c + WORD - 1) // WORD), np.uint64)


def empty_planes(a: int, b: int, c: int) -> CellPlanes:
    """Return planes of zeros for (a, b, c) cells."""
    return CellPlanes(empty_plane(a, b, c), empty_plane(a, b, c), empty_plane(a, b, c), c)


@kernel
def pack(cells: NDArray[np.bool_]) -> NDArray[np.uint64]:
    """Return the plane of an (A, B, C) array of booleans."""
    plane = np.zeros((cells.shape[0], cells.shape[1], (cells.shape[2] + WORD - 1) // WORD), np.uint64)
    for i in range(cells.shape[0]):
        for j in range(cells.shape[1]):
            for k in range(cells.shape[2]):
                if cells[i, j, k]:
                    plane[i, j, k >> 6] |= ONE << np.uint64(k & 63)
    return plane


@kernel
def unpack(plane: NDArray[np.uint64], c: int) -> NDArray[np.bool_]:
    """Return a plane as an (A, B, c) array of booleans."""
    cells = np.zeros((plane.shape[0], plane.shape[1], c), np.bool_)
    for i in range(plane.shape[0]):
        for j in range(plane.shape[1]):
            for w in range(plane.shape[2]):
                word = plane[i, j, w]
                while word != NONE:
                    cells[i, j, WORD * w + lowest(word)] = True
                    word &= word - ONE
    return cells
