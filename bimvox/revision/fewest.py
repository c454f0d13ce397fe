"""Whether the fewest moves of a lift are still known after something on the site has changed.

A kept path witnesses that its number of moves is possible. A path with fewer moves would need a placement that was
blocked before: its cells, or the column above its hook, hold a cell that is free now. So if the shortest way from the
start to the target through the box of all these placements is no shorter, the fewest moves are still the same.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.records.lift import Lift
from bimvox.site.component import IntVec
from bimvox.site.site import Site
from bimvox.site.transit_clearance import margin_vox, rope_margin_vox


class FewestMoves:
    """Tells which lifts have fewest moves that are still known, as cells become free or occupied.

    Args:
        site: The site.
    """

    def __init__(self, site: Site) -> None:
        self._site = site
        self._margin = max(margin_vox(site), rope_margin_vox(site))
        self._boxes: list[tuple[list[int], list[int]]] = []
        self._occupied = False

    def freed(self, cells: NDArray[np.int32]) -> None:
        """Note (N, 3) cells that something has left."""
        if len(cells):
            self._boxes.append((cells.min(axis=0).tolist(), cells.max(axis=0).tolist()))

    def occupied(self, cells: NDArray[np.int32]) -> None:
        """Note (N, 3) cells that something occupies now."""
        self._occupied |= bool(len(cells))

    def are_known(self, lift: Lift) -> bool:
        """Return whether a planned lift's fewest moves are still those that it states."""
        path, fewest = lift.path_vox, lift.shortest_moves
        if path is None or fewest is None:
            return True
        start, target = path[0].tolist(), path[-1].tolist()
        if fewest <= sum(abs(one - other) for one, other in zip(start, target, strict=True)):
            return True
        if self._occupied and len(path) - 1 > fewest:
            return False  # what is occupied now may be on all paths as short as that
        if not self._boxes:
            return True
        size = self._site.components[lift.component].shape.size_vox
        return all(self._least_moves(start, target, size, low, high) >= fewest for low, high in self._boxes)

    def _least_moves(self, start: list[int], target: list[int], size: IntVec, low: list[int], high: list[int]) -> int:
        """Return the fewest moves by a placement at which a part or the rope above it meets a box of cells.

        Args:
            start: Where the path begins.
            target: Where it ends.
            size: The part's size.
            low: The lowest cell of the box.
            high: The highest cell of the box.
        """
        moves, margin = 0, self._margin
        for axis, (one, other) in enumerate(zip(start, target, strict=True)):
            first, last = min(one, other), max(one, other)
            below = 0 if axis == 2 else low[axis] - size[axis] + 1 - margin  # the rope is above the part
            moves += last - first + 2 * max(0, first - high[axis] - margin, below - last)
        return moves
