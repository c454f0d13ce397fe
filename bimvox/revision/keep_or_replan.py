"""Keep or replan: in order, each lift keeps its path or gets a new one at its own stage (the verdict).

``CraneWork`` decides about lifts that have begun, and about motions.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Protocol

from bimvox.grid.frame import NO_CELLS
from bimvox.motion.time_plan import KnownLegs
from bimvox.planning.assembly import Assembly
from bimvox.planning.insertion import SIDEWAYS_VOX
from bimvox.planning.occupancy import stored_cells, target_cells
from bimvox.planning.one_lift import plan_lift, proposed_again, unplanned_lift
from bimvox.planning.preparation import Preparation
from bimvox.planning.rounds import Refusals, Refused
from bimvox.planning.stage import Obstacle, Stage, turning_stage
from bimvox.proof.footprint import CellMask, Footprint, MotionFootprint, examined_by, jib_meets, motion_footprint
from bimvox.records.lift import NOT_LIFTED, Lift, Status
from bimvox.records.motion import LiftMotion
from bimvox.revision.current_plan import CurrentPlan, ObstructionChange, RevisionRequest
from bimvox.revision.draft import Proof, RevisionDraft
from bimvox.revision.recall import FewestMoves, Memory, Recall, Version, obstructed_cells, remembered
from bimvox.site.site import Site
from bimvox.stop.redirect import is_set

# What has changed for a lift: cells that obstructions newly occupy or have left, and new states of earlier lifts.
#
# If a part is no longer set, it is in the yard and not at its place; if it is set again, the other way round. For later
# lifts these cells count as added and removed, like those of an obstruction. A part that is set by other means instead
# of by the crane changes nothing for them.


class _Touched:
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


class CraneWork(Protocol):
    """The work of one crane (or none), or of several, in one round of a revision."""

    def begun(self, replanning: Replanning, was: Lift) -> Lift | None:
        """Return a lift that is done, was skipped, or is on a hook; None if it is to be planned.

        Args:
            replanning: The replanning, at this lift.
            was: The lift in the current plan.
        """

    def choose_motion(self, replanning: Replanning, lift: Lift, was: Lift) -> None:
        """Keep the motion of a lift that has not begun, or note that it is to be made or that it is pending.

        Args:
            replanning: The replanning, at this lift.
            lift: The lift; it is planned.
            was: The lift in the current plan.
        """

    def timed(self, draft: RevisionDraft) -> RevisionDraft | Refused:
        """Return the draft with all its motions on the clock; or which lifts cannot be driven, and why."""

    def refused(self, proof: Proof) -> Refused:
        """Return the lifts to refuse after a failed proof, and why."""


class Replanning:
    """Keeps or replans every lift.

    Args:
        current: The current plan.
        request: What to revise it for.
        change: What changed about the obstructions.
        refused: Components whose lifts failed their proof, and why; and the other ways of those not refused yet.
        work: Decides about lifts that have begun, and about motions.
        memory: Earlier versions of lifts, and those proven in earlier rounds.

    Attributes:
        draft: The result so far.
        assembly: The parts in place and in the yard at this lift.
        touched: Which lifts the change affects.
        fewest: Whether the fewest moves of kept lifts are still known.
        searched: Lifts whose fewest moves were found now.
        is_changed: Whether this is the first part after a change of the obstructions.
        recall: Earlier versions of lifts.
        may_change: Lifts that get another way if their proof refuses them: neither begun nor retrained.
        before: The planned lift before the current one; None for the first.
        was_before: The planned lift before it in the current plan.
        done: The lifts done before it, as bits by order.
    """

    def __init__(
        self,
        current: CurrentPlan,
        request: RevisionRequest,
        change: ObstructionChange,
        refused: Refusals,
        work: CraneWork,
        memory: Memory,
    ) -> None:
        self.was, self.request, self.refused, self.work = current, request, refused, work
        self.site, self.preparation = request.site, request.preparation
        self.draft = RevisionDraft(memory=dict(current.memory))
        self.touched = _Touched(current, self.site, self.preparation, change)
        self.fewest, self.searched = FewestMoves(self.site), set[int]()
        self.fewest.freed(change.removed)
        self.fewest.occupied(change.added)
        self.is_changed = bool(change.ids)
        self.recall = Recall(memory, self.site, self.preparation)
        self.may_change: list[Lift] = []
        self.was_obstructed: CellMask | None = None
        self.assembly = Assembly(self.site, self.preparation, one_at_a_time=True)
        self.before: Lift | None = None
        self.was_before: Lift | None = None
        self.was_done = self.done = 0

    def run(self) -> None:
        """Go through all lifts."""
        for was in self.was.plan.lifts:
            self._take(was)

    def _take(self, was: Lift) -> None:
        """Keep or replan the next lift."""
        assembly, draft = self.assembly, self.draft
        self.touched.come_to(was)
        assembly.skip(was.component)
        lift = self.work.begun(self, was)
        if lift is None and was.status in NOT_LIFTED:
            lift = was
        if lift is None:
            lift = self._lift(assembly, was)
            if self._may_change(was):
                self.may_change.append(lift)
            if lift.status is Status.PLANNED:
                self.work.choose_motion(self, lift, was)
            if lift.order not in self.searched and not self._fewest_are_known(lift):
                draft.fewest_unknown.add(lift.order)
            self._follow_up(was, lift)
            self._remember(was, lift)
        if lift.status is Status.PLANNED:
            self.before = lift
        if draft.held is None or lift.order not in draft.held.orders:  # a part on a hook is neither in place nor stored
            assembly.finish(lift.component, placed=lift.is_set)
        draft.lifts.append(lift)
        self.done |= lift.is_set << lift.order
        self.was_done |= was.is_set << was.order
        if was.status is Status.PLANNED:
            self.was_before = was

    def _may_change(self, was: Lift) -> bool:
        """Return whether a lift may go another way if its proof refuses it."""
        if self.site.has_several_cranes and self.request.now_ns is not None:
            return False  # a hook that is stuck refuses all lifts of its crane
        return self.request.retrained is None or was.component not in self.request.retrained.components

    def _fewest_are_known(self, lift: Lift) -> bool:
        known = self.draft.recalled_paths.get(lift.order)
        if known is not None:
            return self.recall.fewest_are_known(known, self.done)
        return self.fewest.are_known(lift)

    def _follow_up(self, was: Lift, lift: Lift) -> None:
        """Note what a part that is no longer set, or is set again, changes for later lifts."""
        self.touched.follow_up(was, lift)
        if was.is_set == lift.is_set:
            return
        target = target_cells(self.site.components[lift.component])
        stored = NO_CELLS if lift.place is None else stored_cells(lift.place)
        self.fewest.freed(stored if lift.is_set else target)
        self.fewest.occupied(target if lift.is_set else stored)

    def _lift(self, assembly: Assembly, was: Lift) -> Lift:
        """Return the lift; the same object if its path is kept."""
        component, retrained = self.site.components[was.component], self.request.retrained
        reason = self.refused.get(component.id)
        avoided, why = self.refused.avoided_by(component.id)
        if retrained is not None and was.component in retrained.components and was.status is Status.PLANNED:
            reason = None  # only the retrained path failed its proof; the current one is proven
        obstacle = None if reason is None else Obstacle(reason)
        if obstacle is None:
            obstacle = assembly.unsupported(was.component, is_in_reach=was.status is Status.PLANNED)
        if obstacle is not None:
            if was.status is Status.INFEASIBLE and (was.reason, was.blocked_by) == (
                obstacle.reason,
                obstacle.blocked_by,
            ):
                return was
            return self._planned(assembly, obstacle, was)
        if why is not None:
            assembly.keep_heading(was.component)
            other = assembly.begin(was.component, avoided=avoided)
            return self._planned(assembly, Obstacle(why) if isinstance(other, Obstacle) else other, was)
        if not self._must_be_examined(was):
            return self._asked_again(assembly, was)
        known = self.recall.path(was.order, self.done)
        if known is not None:
            self.draft.new_paths.add(was.order)
            self.draft.recalled_paths[was.order] = known
            return known.lift
        if self._is_put_off(was):
            self.draft.new_paths.add(was.order)
            self.draft.undecided.add(was.order)
            return was
        stage = assembly.begin(was.component)
        lift = self._planned(assembly, stage, was)
        if lift.status is Status.INFEASIBLE and isinstance(stage, Obstacle) and was.place is not None:
            self.draft.examined[was.order] = examined_by(self.site, component, was.place, SIDEWAYS_VOX)
        return lift

    def _is_put_off(self, was: Lift) -> bool:
        """Return whether the lift is decided in the next part: it is met, and this part has its lifts.

        Only the first part after a change puts lifts off, so the second one decides all of them.
        """
        draft, request = self.draft, self.request
        if was.status is not Status.PLANNED or not self.is_changed or draft.held is not None:
            return False
        if self.site.has_several_cranes or request.retrained is not None:
            return False
        return bool(draft.pending) or len(draft.new_paths | draft.new_motions) >= request.first

    def _must_be_examined(self, was: Lift) -> bool:
        if was.status is not Status.INFEASIBLE:
            return self.touched.path_is_met(was, self.draft.pending)
        seen = self.was.examined.get(was.order)
        if self.touched.reason_is_met(was, seen, self.draft.pending):
            return True
        if seen is not None:
            self.draft.examined[was.order] = seen
        return False

    def _asked_again(self, assembly: Assembly, was: Lift) -> Lift:
        """Return the lift, with the retrained policy's path if that was trained for it and its path is no longer."""
        retrained = self.request.retrained
        if retrained is None or was.component not in retrained.components or was.status is not Status.PLANNED:
            return was
        stage = assembly.begin(was.component, was.kept)
        if was.with_jib and isinstance(stage, Stage):
            stage = turning_stage(self.site, stage) or stage
        if isinstance(stage, Obstacle) or self.site.components[was.component].id in self.refused:
            return was
        lift = proposed_again(stage, was, retrained.propose)
        if lift is not was:
            self.draft.new_paths.add(was.order)
        return lift

    def _planned(self, assembly: Assembly, stage: Stage | Obstacle, was: Lift) -> Lift:
        before = was if was.status is Status.PLANNED else None
        unplanned = unplanned_lift(self.site, was.component, was.order, self.preparation.places[was.component])
        lift = plan_lift(assembly, stage, unplanned, before, self.request.propose)
        self.searched.add(was.order)
        if lift.status is Status.PLANNED:
            self.draft.new_paths.add(was.order)  # always proven again, even if it could be kept
        else:
            self.draft.new_verdicts.add(was.order)
        return lift

    def known_legs(self, lift: Lift, was: Lift) -> KnownLegs:
        """Return a lift, with what is still proven of its motion in the current plan or an earlier one."""
        return self.recall.legs(lift, self.done, self.before, self._version(was))

    def _version(self, was: Lift) -> Version | None:
        """Return the version of a lift in the current plan; None if it is not proven there."""
        order = was.order
        if was.status is not Status.PLANNED or order in self.was.pending or order not in self.was.path_footprints:
            return None
        if self.was_obstructed is None:
            self.was_obstructed = obstructed_cells(self.was.plan.site)
        motion, moved = self.was.motions.get(order), self.was.motion_footprints.get(order)
        path = self.was.path_footprints[order]
        return Version(was, path, motion, moved, self.was_done, self.was_before, self.was_obstructed)

    def _remember(self, was: Lift, lift: Lift) -> None:
        """Store the old version of a changed lift."""
        order, draft = was.order, self.draft
        if lift is was and order not in draft.new_motions | draft.pending:
            return
        version = self._version(was)
        if version is not None:
            draft.memory[order] = remembered(draft.memory, version)
