"""What has changed for the lift at hand: cells that obstructions took or left, and what became of the lifts before it.

A lift that became infeasible no longer stands at its place and lies in the yard; one that became possible again does
the reverse. For the lifts after it these cells were added and removed like an obstruction's.
"""

from __future__ import annotations

from collections.abc import Collection

from bimvox.planning.assembly import Preparation
from bimvox.planning.occupancy import stored_cells, target_cells
from bimvox.proof.footprint import CellMask, Footprint, jib_meets, motion_footprint
from bimvox.records.lift import Lift, Status
from bimvox.records.motion import LiftMotion
from bimvox.revision.obstruction_change import ObstructionChange
from bimvox.revision.standing import Standing
from bimvox.site.site import Site
from bimvox.stop.underway import is_set


class Touched:
    """Says which lifts are met, while a walk goes through them in order.

    Args:
        standing: The plan that stands.
        site: The site with its obstructions now.
        preparation: What was prepared for it.
        change: What changed about the obstructions.
    """

    def __init__(self, standing: Standing, site: Site, preparation: Preparation, change: ObstructionChange) -> None:
        self._was, self._site, self._preparation, self._change = standing, site, preparation, change
        self._added, self._changed = CellMask(site.shape), CellMask(site.shape)
        self._added.add(change.added)
        self._changed.add(change.added)
        self._changed.add(change.removed)
        self._in_yard, self._delivery = CellMask(site.shape), -1
        self._lean_on: set[int] = set()

    def come_to(self, was: Lift) -> None:
        """Go on to a lift; with a new delivery the yard is empty first."""
        if was.place is not None and was.place.delivery != self._delivery:
            self._in_yard, self._delivery = CellMask(self._site.shape), was.place.delivery

    def follow_up(self, was: Lift, lift: Lift) -> None:
        """Note what a lift that became infeasible, or possible again, changes for those after it."""
        if was.status is lift.status:
            return
        component = self._site.components[lift.component]
        target = target_cells(component)
        if lift.status is Status.PLANNED:
            self._added.add(target)
        elif lift.place is not None:
            self._in_yard.add(stored_cells(lift.place))
        self._changed.add(target)
        if lift.place is not None:
            self._changed.add(stored_cells(lift.place))
        neighbours = self._preparation.contacts.neighbours
        self._lean_on |= {n for n in range(len(self._site.components)) if component.index in neighbours[n]}

    def path_is_met(self, was: Lift, pending: Collection[int]) -> bool:
        """Whether the change, or what became of an earlier lift, may touch a planned lift's path.

        Args:
            was: The lift as it stood.
            pending: Orders of the lifts that are not timed and proven in this walk.
        """
        if was.component in self._lean_on:
            return True
        if self._is_waiting(was, pending):
            return False
        path = self._was.paths.get(was.order)
        return path is None or self._added.meets(path) or self._in_yard.meets(path)

    def reason_is_met(self, was: Lift, seen: Footprint | None, pending: Collection[int]) -> bool:
        """Whether the change, or what became of an earlier lift, may touch why a lift is infeasible.

        Args:
            was: The lift as it stood.
            seen: The cells that decided; None where it is tried again whenever anything changes.
            pending: Orders of the lifts that are not timed and proven in this walk.
        """
        if was.component in self._lean_on:
            return True
        if self._is_waiting(was, pending):
            return False
        if seen is None:
            return bool(self._change.ids) or not self._changed.empty or not self._in_yard.empty
        touched = self._changed.meets(seen) or self._in_yard.meets(seen)
        return touched or not self._change.ids.isdisjoint(was.blocked_by)

    def motion_is_met(self, motion: LiftMotion, way: Footprint) -> bool:
        """Whether the change, or what became of an earlier lift, meets a motion."""
        met = self._added.meets(way) or self._in_yard.meets(way)
        return met or jib_meets(self._site, motion, self._change.added)

    def rest_is_met(self, lift: Lift, motion: LiftMotion, now_ns: int) -> bool:
        """Whether the change meets what is left of the motion of a lift under way."""
        if self._added.empty or is_set(motion, now_ns):
            return False
        rest = motion_footprint(self._site, lift, motion, now_ns)
        return self._added.meets(rest) or jib_meets(self._site, motion, self._change.added)

    def _is_waiting(self, was: Lift, pending: Collection[int]) -> bool:
        """Whether its verdict is known, and its turn has not come yet."""
        return bool(pending) and was.order in self._was.pending and was.path_vox is not None and not self._change.ids
