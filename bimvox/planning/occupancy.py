"""Which cells are occupied during erection, and the collision rule of the next lift."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.grid.summed_area import summed_area_table, update_table
from bimvox.records.lift import YardPlace
from bimvox.site.collision import (
    HOOK_FORBIDDEN,
    NOTHING_CLEARED,
    CollisionSpace,
    hook_room,
    in_transit,
    margin_vox,
    rope_margin_vox,
)
from bimvox.site.component import Component, IntVec
from bimvox.site.default_rules import ALL_KEPT, Kept
from bimvox.site.site import CRANE_ID, Site
from bimvox.site.tandem import over_both


class Occupancy:
    """How many objects occupy each cell at the current stage of erection.

    Neighbouring parts share cells, so a cell counts each of them.

    Args:
        site: The site; its fixed blockers are present from the start, but for a crane that moves.
        one_at_a_time: Whether a collision rule is used only until the next one is requested. Its table is then updated
            in place from the lowest changed cell on, instead of being built anew.
    """

    def __init__(self, site: Site, *, one_at_a_time: bool = False) -> None:
        self._site = site
        self._lowest: IntVec = (0, 0, 0)
        x, y, z = site.shape
        self._kept: NDArray[np.int32] | None = np.zeros((x + 1, y + 1, z + 1), np.int32) if one_at_a_time else None
        self._counts: NDArray[np.uint16] = np.zeros(site.shape, np.uint16)
        self._below: NDArray[np.uint16] = np.zeros((x, y, z + 1) if one_at_a_time else (0, 0, 0), np.uint16)
        self._top: NDArray[np.int32] = np.zeros((x, y), np.int32)
        self._waiting: list[tuple[NDArray[np.int32], bool]] = []
        for blocker in site.blockers:
            if site.moving is None or blocker.kind != CRANE_ID:
                self.add(blocker.cells)

    @property
    def counts(self) -> NDArray[np.uint16]:
        """(X, Y, Z) uint16."""
        self._update_counts()
        return self._counts

    def _update_counts(self) -> None:
        """Count the changes since the last time: on demand, because most stages never look."""
        if self._waiting:
            cells = np.concatenate([cells for cells, _ in self._waiting])
            until = np.cumsum([len(cells) for cells, _ in self._waiting])
            is_added = np.array([is_added for _, is_added in self._waiting])
            low = _count(self._counts, self._top, self._below, cells, until, is_added)
            self._lowest = (min(self._lowest[0], low[0]), min(self._lowest[1], low[1]), min(self._lowest[2], low[2]))
            self._waiting.clear()

    def add(self, cells: NDArray[np.int32]) -> None:
        """Add an object on ``cells`` ((N, 3) int32, each once)."""
        self._waiting.append((cells, True))

    def remove(self, cells: NDArray[np.int32]) -> None:
        """Remove an object from ``cells``."""
        self._waiting.append((cells, False))

    def any_at(self, cells: NDArray[np.int32]) -> bool:
        """Return whether anything occupies one of the cells ((N, 3); cells outside the grid are ignored)."""
        counts = self.counts
        inside = ((cells >= 0) & (cells < counts.shape)).all(axis=1)
        return bool(counts[tuple(cells[inside].T)].any())

    def heights(self) -> NDArray[np.int32]:
        """Return the (X, Y) height map: one above the highest occupied cell of each column, 0 if it is empty."""
        self._update_counts()
        return self._top.copy()

    def space(self, component: Component, most_used: float | None = None) -> CollisionSpace:
        """Return the collision rule for lifting ``component`` now; ``most_used`` is that of ``hook_room``."""
        crane = self._site.crane_of(component)
        room = hook_room(self._site, crane, self.heights(), component, most_used=most_used)
        return CollisionSpace(
            self._table(),
            component.shape.boxes.copy(),  # writable, as all others: kernels are compiled once
            np.array(component.hook_offset_vox, np.int32),
            room.floor,
            *NOTHING_CLEARED,
            room.ceiling,
        )

    def transit(self, component: Component, space: CollisionSpace, kept: Kept = ALL_KEPT) -> CollisionSpace:
        """Return the collision rule for ``component`` between departure and gate, with the margins of its lift."""
        grown = in_transit(space, margin_vox(self._site, kept))
        rope = rope_margin_vox(self._site, kept)
        if rope == 0 or not self._site.rules.rope:
            return grown
        # Of hook and rope only: a jib keeps what it keeps without a load.
        around = highest_around(self.heights(), rope)
        if component.tandem is not None:
            around = over_both(self._site, component, [around, around], int(HOOK_FORBIDDEN)).max(axis=0)
        floor = np.maximum(space.hook_floor, around)
        if space.hook_ceiling.size:
            floor[floor > space.hook_ceiling] = HOOK_FORBIDDEN
        return grown._replace(hook_floor=floor)

    def _table(self) -> NDArray[np.int32]:
        counts = self.counts
        if self._kept is None:
            return summed_area_table(counts > 0)
        if self._lowest != self._site.shape:
            update_table(self._kept, self._below, *self._lowest)
            self._lowest = self._site.shape
        return self._kept


@kernel
def highest_around(top: NDArray[np.int32], reach: int) -> NDArray[np.int32]:
    """Return (X, Y) int32 the highest value of a height map within ``reach`` columns on each axis."""
    nx, ny = top.shape
    along = top.copy()
    for step in range(1, reach + 1):
        for x in range(nx - step):
            for y in range(ny):
                along[x, y] = max(along[x, y], top[x + step, y])
                along[x + step, y] = max(along[x + step, y], top[x, y])
    result = along.copy()
    for step in range(1, reach + 1):
        for x in range(nx):
            for y in range(ny - step):
                result[x, y] = max(result[x, y], along[x, y + step])
                result[x, y + step] = max(result[x, y + step], along[x, y])
    return result


@kernel
def _count(
    counts: NDArray[np.uint16],
    top: NDArray[np.int32],
    below: NDArray[np.uint16],
    cells: NDArray[np.int32],
    until: NDArray[np.int64],
    is_added: NDArray[np.bool_],
) -> IntVec:
    """Add objects to the counts, or remove them, in place; return the lowest corner of the cells that this changes.

    ``counts``: (X, Y, Z) uint16; ``top``: (X, Y) int32, one above the highest occupied cell of each column; updated
    too; ``below``: (X, Y, Z + 1) uint16, the occupied cells of each column below each height; updated too unless empty;
    ``cells``: (N, 3) int32 cells of one object after the other; ``until``: (M,) int64 end of the cells of each object;
    ``is_added``: (M,) whether the object is added.
    """
    low_x, low_y, low_z = counts.shape
    n = 0
    for thing in range(len(until)):
        step = np.uint16(1) if is_added[thing] else np.uint16(0xFFFF)
        while n < until[thing]:
            x, y, z = cells[n, 0], cells[n, 1], cells[n, 2]
            if min(x, y, z) < 0 or x >= counts.shape[0] or y >= counts.shape[1] or z >= counts.shape[2]:
                raise IndexError("a cell outside the grid")
            was = counts[x, y, z] != 0
            counts[x, y, z] += step
            now = counts[x, y, z] != 0
            if now:
                top[x, y] = max(top[x, y], z + 1)
            elif top[x, y] == z + 1:
                while top[x, y] > 0 and not counts[x, y, top[x, y] - 1]:
                    top[x, y] -= 1
            if was != now:
                low_x, low_y, low_z = min(low_x, x), min(low_y, y), min(low_z, z)
                if below.size:
                    for k in range(z + 1, below.shape[2]):
                        below[x, y, k] += step
            n += 1
    return low_x, low_y, low_z


def target_cells(component: Component) -> NDArray[np.int32]:
    """Return the (N, 3) int32 cells of a component at its place."""
    return component.shape.cells + np.array(component.target_vox, np.int32)


def stored_cells(place: YardPlace) -> NDArray[np.int32]:
    """Return the (N, 3) int32 cells of a component in the yard."""
    return place.shape.cells + np.array(place.cell_vox, np.int32)
