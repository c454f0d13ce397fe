"""What has changed for a lift: cells that obstructions newly occupy or have left, and new states of earlier lifts.

If a part is no longer set, it is in the yard and not at its place; if it is set again, the other way round. For later
lifts these cells count as added and removed, like those of an obstruction. A part that is set by other means instead of
by the crane changes nothing for them.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

from bimvox.planning.occupancy import stored_cells, target_cells
from bimvox.planning.preparation import Preparation
from bimvox.proof.footprint import CellMask, Footprint, MotionFootprint, jib_meets, motion_footprint
from bimvox.records.lift import Lift
from bimvox.records.motion import LiftMotion
from bimvox.revision.current_plan import CurrentPlan
from bimvox.revision.obstruction_change import ObstructionChange
from bimvox.site.site import Site
from bimvox.stop.redirect import is_set


class Touched:
    """Tells which lifts a change affects, as they are replanned in order.

    Args:
        current: The current plan.
        site: The site with its obstructions now.
        preparation: What was prepared for it.
        change: What changed about the obstructions.
    """

    def __init__(self, current: CurrentPlan, site: Site, preparation: Preparation, change: ObstructionChange) -> None:
        self._was, self._site, self._preparation, self._change = current, site, preparation, change
        self._added, self._changed = CellMask(site.shape), CellMask(site.shape)
        self._added.add(change.added)
        self._changed.add(change.added)
        self._changed.add(change.removed)
        self._in_yard, self._delivery = CellMask(site.shape), -1
        self._lean_on: set[int] = set()

    def come_to(self, was: Lift) -> None:
        """Move to the next lift; a new delivery starts with an empty yard."""
        if was.place is not None and was.place.delivery != self._delivery:
            self._in_yard, self._delivery = CellMask(self._site.shape), was.place.delivery

    def follow_up(self, was: Lift, lift: Lift) -> None:
        """Note what a part that is no longer set, or is set again, changes for later lifts."""
        if was.is_set == lift.is_set:
            return
        component = self._site.components[lift.component]
        target = target_cells(component)
        if lift.is_set:
            self._added.add(target)
        elif lift.place is not None:
            self._in_yard.add(stored_cells(lift.place))
        self._changed.add(target)
        if lift.place is not None:
            self._changed.add(stored_cells(lift.place))
        self._lean_on.update(self._preparation.contacts.neighbours[component.index])

    def path_is_met(self, was: Lift, pending: Collection[int]) -> bool:
        """Return whether the change, or the new state of an earlier lift, may affect a planned lift's path.

        Args:
            was: The lift in the current plan.
            pending: Orders of the lifts that are not timed and proven in this part.
        """
        if was.component in self._lean_on:
            return True
        if self._is_waiting(was, pending):
            return False
        if was.order not in self._was.path_footprints:
            return True
        return self._meets(self._was.path_footprints, was)

    def reason_is_met(self, was: Lift, seen: Footprint | None, pending: Collection[int]) -> bool:
        """Return whether the change, or the new state of an earlier lift, may affect why a lift is infeasible.

        Args:
            was: The lift in the current plan.
            seen: The cells that made it infeasible; None if it is tried again at every change.
            pending: Orders of the lifts that are not timed and proven in this part.
        """
        if was.component in self._lean_on:
            return True
        if self._is_waiting(was, pending):
            return False
        if seen is None:
            return bool(self._change.ids) or not self._changed.empty or not self._in_yard.empty
        touched = self._changed.meets(seen) or self._in_yard.meets(seen)
        return touched or not self._change.ids.isdisjoint(was.blocked_by)

    def motion_is_met(self, was: Lift, motion: LiftMotion) -> bool:
        """Return whether the change, or the new state of an earlier lift, meets the motion of a lift."""
        return self._meets(self._was.motion_footprints, was) or jib_meets(self._site, motion, self._change.added)

    def rest_is_met(self, lift: Lift, motion: LiftMotion, now_ns: int) -> bool:
        """Return whether the change meets the rest of the motion of a lift under way."""
        if self._added.empty or is_set(motion, now_ns):
            return False
        rest = motion_footprint(self._site, lift, motion, now_ns)
        return self._added.meets(rest) or jib_meets(self._site, motion, self._change.added)

    def _meets(self, footprints: Mapping[int, Footprint] | Mapping[int, MotionFootprint], was: Lift) -> bool:
        """Return whether anything is newly in the footprint of a lift, which is not made if there is nothing new."""
        new = [cells for cells in (self._added, self._in_yard) if not cells.empty]
        return any(cells.meets(footprints[was.order]) for cells in new)

    def _is_waiting(self, was: Lift, pending: Collection[int]) -> bool:
        """Return whether its verdict is known, and only its motion is still to be made."""
        is_decided = was.order in self._was.pending - self._was.undecided and was.path_vox is not None
        return bool(pending) and is_decided and not self._change.ids
