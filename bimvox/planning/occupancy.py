"""What stands where while the building grows: counts per cell, and the clearance of the next lift."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.grid.occupancy import summed_area_table, top_of_columns
from bimvox.planning.lift import YardPlace
from bimvox.site.clearance import NOTHING_CLEARED, Clearance
from bimvox.site.component import Component
from bimvox.site.hook_room import hook_room
from bimvox.site.site import Site


class Occupancy:
    """How many things occupy each cell at the current stage of assembly.

    Neighbouring parts share cells, so a cell is counted once for each of them.

    Args:
        site: The site; its fixed blockers are there from the start.

    Attributes:
        counts: (X, Y, Z) uint16.
    """

    def __init__(self, site: Site) -> None:
        self._site = site
        self.counts: NDArray[np.uint16] = np.zeros(site.shape, np.uint16)
        for blocker in site.blockers:
            self.add(blocker.cells)

    def add(self, cells: NDArray[np.int32]) -> None:
        """Something now stands on ``cells`` ((N, 3) int32, each once)."""
        self.counts[tuple(cells.T)] += 1

    def remove(self, cells: NDArray[np.int32]) -> None:
        """It no longer stands there."""
        self.counts[tuple(cells.T)] -= 1

    def clearance(self, component: Component) -> Clearance:
        """Return the collision rule for lifting ``component`` now."""
        site = self._site
        occupied = self.counts > 0
        room = hook_room(site, top_of_columns(occupied), component)
        return Clearance(
            summed_area_table(occupied),
            component.shape.boxes,
            np.array(component.hook_offset_vox, np.int32),
            room.floor,
            *NOTHING_CLEARED,
            room.ceiling,
        )


def target_cells(component: Component) -> NDArray[np.int32]:
    """(N, 3) int32 cells of a component at its place."""
    return component.shape.cells + np.array(component.target_vox, np.int32)


def stored_cells(place: YardPlace) -> NDArray[np.int32]:
    """(N, 3) int32 cells of a component in the yard."""
    return place.shape.cells + np.array(place.cell_vox, np.int32)
