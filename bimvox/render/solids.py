"""Painting solids: a volume of numbers and the colour of each number."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.site.construction import Rgb


def index_type(count: int) -> type[np.unsignedinteger]:
    """Return the smallest type for that many solids, 0 included."""
    return np.uint16 if count <= 1 << 16 else np.uint32


class Canvas:
    """A volume that is painted solid by solid.

    Args:
        shape: (X, Y, Z).
        count: Most solids that will be painted.
    """

    def __init__(self, shape: tuple[int, int, int], count: int) -> None:
        self.solids: NDArray[np.unsignedinteger] = np.zeros(shape, index_type(count + 1))
        self._rgb: list[Rgb] = [(0, 0, 0)]

    def paint(self, cells: NDArray[np.integer], rgb: Rgb, *, over: bool = False) -> None:
        """Paint a solid.

        Args:
            cells: (N, 3); those outside the volume are left out.
            rgb: Its colour.
            over: Whether it takes cells that another solid has already.
        """
        inside = ((cells >= 0) & (cells < self.solids.shape)).all(axis=1)
        at = tuple(cells[inside].T)
        number = len(self._rgb)
        self._rgb.append(rgb)
        if over:
            self.solids[at] = number
        else:
            self.solids[at] = np.where(self.solids[at] == 0, number, self.solids[at])

    def paint_mask(self, mask: NDArray[np.bool_], layer: int, rgb: Rgb) -> None:
        """Paint the (X, Y) cells of a layer."""
        self.solids[:, :, layer][mask] = len(self._rgb)
        self._rgb.append(rgb)

    @property
    def palette(self) -> NDArray[np.uint8]:
        """(N, 3) uint8 colours of what was painted."""
        return np.array(self._rgb, np.uint8)
