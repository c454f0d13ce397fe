"""What stands where while the building grows: counts per cell, and the clearance of the next lift."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from bimvox.grid.summed_area import summed_area_table, top_of_columns, update_table
from bimvox.records.lift import YardPlace
from bimvox.site.collision import NOTHING_CLEARED, CollisionSpace
from bimvox.site.component import Component, IntVec
from bimvox.site.hook_room import hook_room
from bimvox.site.margin import in_transit, margin_vox, rope_margin_vox
from bimvox.site.site import Site


class Occupancy:
    """How many things occupy each cell at the current stage of assembly.

    Neighbouring parts share cells, so a cell is counted once for each of them.

    Args:
        site: The site; its fixed blockers are there from the start.
        one_at_a_time: Whether a clearance is used only until the next one is asked for: its table is then brought up
            to date in place, beyond the lowest cell that changed since the last one, and not made anew.

    Attributes:
        counts: (X, Y, Z) uint16.
    """

    def __init__(self, site: Site, *, one_at_a_time: bool = False) -> None:
        self._site = site
        self._lowest: IntVec = (0, 0, 0)
        self._kept: tuple[NDArray[np.int32], NDArray[np.int32]] | None = None
        if one_at_a_time:
            x, y, z = site.shape
            self._kept = np.zeros((x + 1, y + 1, z + 1), np.int32), np.zeros((x, y), np.int32)
        self.counts: NDArray[np.uint16] = np.zeros(site.shape, np.uint16)
        for blocker in site.blockers:
            self.add(blocker.cells)

    def add(self, cells: NDArray[np.int32]) -> None:
        """Something now stands on ``cells`` ((N, 3) int32, each once)."""
        self.counts[tuple(cells.T)] += 1
        self._changed(cells)

    def remove(self, cells: NDArray[np.int32]) -> None:
        """It no longer stands there."""
        self.counts[tuple(cells.T)] -= 1
        self._changed(cells)

    def any_at(self, cells: NDArray[np.int32]) -> bool:
        """Return whether anything occupies one of the cells ((N, 3); those outside the grid are passed over)."""
        inside = ((cells >= 0) & (cells < self.counts.shape)).all(axis=1)
        return bool(self.counts[tuple(cells[inside].T)].any())

    def space(self, component: Component) -> CollisionSpace:
        """Return the collision rule for lifting ``component`` now."""
        table, top = self._table_and_top()
        room = hook_room(self._site, self._site.crane_of(component), top, component)
        return CollisionSpace(
            table,
            component.shape.boxes,
            np.array(component.hook_offset_vox, np.int32),
            room.floor,
            *NOTHING_CLEARED,
            room.ceiling,
        )

    def transit(self, component: Component, space: CollisionSpace) -> CollisionSpace:
        """Return the rule that holds for ``component`` between departure and gate: its margins kept."""
        grown, rope = in_transit(space, margin_vox(self._site)), rope_margin_vox(self._site)
        if rope == 0 or not self._site.rules.rope:
            return grown
        top = maximum_filter(self._table_and_top()[1], size=2 * rope + 1, mode="constant")
        return grown._replace(hook_floor=hook_room(self._site, self._site.crane_of(component), top, component).floor)

    def _table_and_top(self) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        if self._kept is None:
            occupied = self.counts > 0
            return summed_area_table(occupied), top_of_columns(occupied)
        if self._lowest != self._site.shape:
            update_table(*self._kept, self.counts, *self._lowest)
            self._lowest = self._site.shape
        return self._kept

    def _changed(self, cells: NDArray[np.int32]) -> None:
        if self._kept is not None and len(cells):
            low = np.minimum(self._lowest, cells.min(axis=0)).tolist()
            self._lowest = (low[0], low[1], low[2])


def target_cells(component: Component) -> NDArray[np.int32]:
    """(N, 3) int32 cells of a component at its place."""
    return component.shape.cells + np.array(component.target_vox, np.int32)


def stored_cells(place: YardPlace) -> NDArray[np.int32]:
    """(N, 3) int32 cells of a component in the yard."""
    return place.shape.cells + np.array(place.cell_vox, np.int32)
