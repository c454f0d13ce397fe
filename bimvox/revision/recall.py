"""Earlier versions of lifts and their fewest moves, recalled if nothing that their proof depends on has changed.

A change often undoes an earlier one: an obstruction is removed, and the lifts that it made infeasible, with all parts
that rest on them, are feasible again. Planning, timing and proving them again would give the known result.

A version is still proven if no cell of its footprint has become occupied since (``footprint`` explains why that is
enough): by an obstruction, by a part that is now in place and was not then, or by one that now lies in the yard. If the
state of a neighbour differs, the lift is planned again, because its last moves depend on the neighbours in place. Its
motion is still proven if also the lift before it is the same, and none of the newly occupied cells is in the motion's
footprint or as high as the jib.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bimvox.motion.time_plan import KnownLegs
from bimvox.planning.occupancy import stored_cells, target_cells
from bimvox.planning.preparation import Preparation
from bimvox.proof.footprint import CellMask, Footprint, MotionFootprint
from bimvox.records.lift import Lift
from bimvox.records.motion import LiftMotion
from bimvox.site.collision import margin_vox, rope_margin_vox
from bimvox.site.component import IntVec
from bimvox.site.site import Site

# Whether the fewest moves of a lift are still known after something on the site has changed.
#
# A kept path witnesses that its number of moves is possible. A path with fewer moves would need a placement that was
# blocked before: its cells, or the column above its hook, hold a cell that is free now. So if the shortest way from the
# start to the target through the box of all these placements is no shorter, the fewest moves are still the same.


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

        ``start``: where the path begins; ``target``: where it ends; ``size``: the part's size; ``low``: the lowest cell
        of the box; ``high``: the highest cell of the box.
        """
        moves, margin = 0, self._margin
        for axis, (one, other) in enumerate(zip(start, target, strict=True)):
            first, last = min(one, other), max(one, other)
            below = 0 if axis == 2 else low[axis] - size[axis] + 1 - margin  # the rope is above the part
            moves += last - first + 2 * max(0, first - high[axis] - margin, below - last)
        return moves


_VERSIONS = 2
"""Number of versions kept for each lift."""


@dataclass(frozen=True, slots=True, eq=False)
class Version:
    """A proven lift of an earlier plan.

    Attributes:
        lift: The lift.
        path_footprint: The footprint of its path.
        motion: Its motion; None without a crane.
        motion_footprint: The footprint of the motion.
        done: The lifts done before it, as bits by order.
        before: The planned lift before it; None for the first.
        obstructed: The cells of all obstructions then.
    """

    lift: Lift
    path_footprint: Footprint
    motion: LiftMotion | None
    motion_footprint: MotionFootprint | None
    done: int
    before: Lift | None
    obstructed: CellMask


Memory = Mapping[int, tuple[Version, ...]]
"""Versions by order of the lift, the latest first."""


def remembered(memory: Memory, version: Version) -> tuple[Version, ...]:
    """Return the versions of a lift with one more in front."""
    order = version.lift.order
    return (version, *memory.get(order, ()))[:_VERSIONS]


def obstructed_cells(site: Site) -> CellMask:
    """Return the cells of all obstructions of a site."""
    mask = CellMask(site.shape)
    for blocker in site.blockers:
        if blocker.kind == "obstruction":
            mask.add(blocker.cells)
    return mask


class Recall:
    """Finds versions that are still proven under the obstructions of a site.

    Args:
        memory: Versions by order.
        site: The site.
        preparation: What was prepared for it.
    """

    def __init__(self, memory: Memory, site: Site, preparation: Preparation) -> None:
        self._memory, self._site, self._preparation = memory, site, preparation
        self._obstructed = obstructed_cells(site)
        self._since: dict[tuple[int, int, int, int], tuple[CellMask, frozenset[int]]] = {}
        self._fewest: dict[tuple[int, int, int], FewestMoves] = {}

    def path(self, order: int, done: int) -> Version | None:
        """Return the latest version whose path is still proven after these lifts (bits by order); None if none is."""
        for version in self._memory.get(order, ()):
            occupied = self._occupied_since(version, done)
            if occupied is not None and not occupied.meets(version.path_footprint):
                return version
        return None

    def motion(self, lift: Lift, done: int, before: Lift | None) -> Version | None:
        """Return the latest version of exactly this path whose motion is still proven; None if none is.

        Args:
            lift: The lift.
            done: The lifts done before it.
            before: The planned lift before it.
        """
        for version in self._memory.get(lift.order, ()):
            if version.lift is not lift or version.motion is None or version.motion_footprint is None:
                continue
            if not same_part(version.before, before) or (occupied := self._occupied_since(version, done)) is None:
                continue
            crane = self._site.cranes[version.motion.crane]
            if (
                occupied.meets(version.path_footprint)
                or occupied.meets(version.motion_footprint)
                or occupied.reaches_jib(self._site, crane)
            ):
                continue
            return version
        return None

    def legs(self, lift: Lift, done: int, before: Lift | None, latest: Version | None) -> KnownLegs:
        """Return a lift whose motion as a whole is not known, with what of a motion is still proven.

        Args:
            lift: The lift.
            done: The lifts done before it.
            before: The planned lift before it.
            latest: Its version in the current plan, which is not in the memory yet.
        """
        for version in (latest, *self._memory.get(lift.order, ())):
            if version is None or version.motion is None or version.motion_footprint is None:
                continue
            motion, swept = version.motion, version.motion_footprint
            if not _begins_as(version, motion, lift, before):
                continue
            occupied, neighbours = self._changed_since(version, done)
            if occupied.reaches_jib(self._site, self._site.cranes[motion.crane]):
                continue
            if not occupied.meets(swept.approach):
                return KnownLegs(lift.order, approach=motion.approach)
            is_same = version.lift is lift and lift.component not in neighbours
            if is_same and not (occupied.meets(version.path_footprint) or occupied.meets(swept.carrying)):
                return KnownLegs(lift.order, carrying=motion)
        return KnownLegs(lift.order)

    def fewest_are_known(self, version: Version, done: int) -> bool:
        """Return whether the fewest moves of a recalled version are still those that it states."""
        set_since, not_set = done & ~version.done, version.done & ~done
        key = (id(version.obstructed), set_since, not_set)
        if key not in self._fewest:
            fewest, order = FewestMoves(self._site), self._preparation.sequence.order
            fewest.freed(version.obstructed.without(self._obstructed).around())
            fewest.occupied(self._obstructed.without(version.obstructed).around())
            for index in (order[n] for n in _bits(not_set)):
                fewest.freed(target_cells(self._site.components[index]))
            for index in (order[n] for n in _bits(set_since)):
                fewest.occupied(target_cells(self._site.components[index]))
                if (place := self._preparation.places[index]) is not None:
                    fewest.freed(stored_cells(place))
            self._fewest[key] = fewest
        return self._fewest[key].are_known(version.lift)

    def _occupied_since(self, version: Version, done: int) -> CellMask | None:
        """Return the cells that were free for a version and are occupied now; None if a neighbour's state differs."""
        occupied, neighbours = self._changed_since(version, done)
        return None if version.lift.component in neighbours else occupied

    def _changed_since(self, version: Version, done: int) -> tuple[CellMask, frozenset[int]]:
        """Return the cells that were free for a version and are occupied now, and the parts near a changed one."""
        set_since, not_set = done & ~version.done, version.done & ~done
        delivery = -1 if version.lift.place is None else version.lift.place.delivery
        key = (id(version.obstructed), set_since, not_set, delivery)
        if key not in self._since:
            self._since[key] = self._difference(version.obstructed, set_since, not_set, delivery)
        return self._since[key]

    def _difference(
        self, obstructed: CellMask, set_since: int, not_set: int, delivery: int
    ) -> tuple[CellMask, frozenset[int]]:
        """Return the newly occupied cells, and the neighbours of all parts whose state differs."""
        occupied = self._obstructed.without(obstructed)
        order, neighbours = self._preparation.sequence.order, self._preparation.contacts.neighbours
        for index in (order[n] for n in _bits(set_since)):
            occupied.add(target_cells(self._site.components[index]))
        for place in (self._preparation.places[order[n]] for n in _bits(not_set)):
            if place is not None and place.delivery == delivery:
                occupied.add(stored_cells(place))
        return occupied, frozenset(m for n in _bits(set_since | not_set) for m in neighbours[order[n]])


def same_part(lift: Lift | None, other: Lift | None) -> bool:
    """Return whether two lifts, or their absence, are of the same part."""
    return lift is other or (lift is not None and other is not None and lift.component == other.component)


def _begins_as(version: Version, motion: LiftMotion, lift: Lift, before: Lift | None) -> bool:
    """Return whether a lift begins where a version of it does, which was not stopped on its way to the part."""
    last, then, place = version.before, version.lift.place, lift.place
    if last is None or before is None or then is None or place is None or motion.stops_ns:
        return False
    same_end = last is before or (
        same_part(last, before) and np.array_equal(last.last_moves_vox, before.last_moves_vox)
    )
    return same_end and then.is_same(place)


def _bits(number: int) -> list[int]:
    """Return the positions of the bits that are set, ascending."""
    return [n for n in range(number.bit_length()) if number >> n & 1]
