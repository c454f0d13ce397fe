"""Paints solids: a volume of indices and the colour of each index."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.site.construction import Rgb


def index_type(count: int) -> type[np.unsignedinteger]:
    """Return the smallest unsigned type for this many solids, including 0."""
    return np.uint16 if count <= 1 << 16 else np.uint32


class Canvas:
    """A volume of (X, Y, Z) cells that is painted solid by solid, ``count`` of them at most."""

    def __init__(self, shape: tuple[int, int, int], count: int) -> None:
        self.solids: NDArray[np.unsignedinteger] = np.zeros(shape, index_type(count + 1))
        self._rgb: list[Rgb] = [(0, 0, 0)]
        self._layers: list[str] = [""]

    def paint(self, cells: NDArray[np.integer], rgb: Rgb, *, over: bool = False, layer: str = "") -> int:
        """Paint a solid and return its number.

        Args:
            cells: (N, 3); those outside the volume are ignored.
            rgb: Its colour.
            over: Whether it overwrites other solids.
            layer: Its ``Layer``; empty if it is always drawn.
        """
        inside = ((cells >= 0) & (cells < self.solids.shape)).all(axis=1)
        at = tuple(cells[inside].T)
        number = self._next(rgb, layer)
        if over:
            self.solids[at] = number
        else:
            self.solids[at] = np.where(self.solids[at] == 0, number, self.solids[at])
        return number

    def paint_columns(self, mask: NDArray[np.bool_], layers: NDArray[np.int32], rgb: Rgb, *, layer: str = "") -> None:
        """Paint one cell of each (X, Y) column of a mask, in its layer of ``layers`` (X, Y)."""
        x, y = np.nonzero(mask)
        self.solids[x, y, layers[mask]] = self._next(rgb, layer)

    def copy(self, more: int = 0) -> Canvas:
        """Return a separate canvas with the same solids and room for more."""
        other = Canvas.__new__(Canvas)
        other.solids, other._rgb, other._layers = self.solids.copy(), list(self._rgb), list(self._layers)
        if len(other._rgb) + more > np.iinfo(other.solids.dtype).max:
            other.solids = other.solids.astype(np.uint32)
        return other

    def _next(self, rgb: Rgb, layer: str) -> int:
        self._rgb.append(rgb)
        self._layers.append(str(layer))
        return len(self._rgb) - 1

    @property
    def layers(self) -> tuple[str, ...]:
        """The layer of each solid."""
        return tuple(self._layers)

    @property
    def palette(self) -> NDArray[np.uint8]:
        """(N, 3) uint8 colours of the painted solids."""
        return np.array(self._rgb, np.uint8)
