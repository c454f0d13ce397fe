"""Keep or replan: in order, each lift keeps its path or gets a new one at its own stage (the verdict).

``CraneWork`` decides about lifts that have begun, and about motions.
"""

from __future__ import annotations

from functools import partial
from typing import Protocol

from bimvox.planning.assembly import Assembly
from bimvox.planning.external import without_external
from bimvox.planning.insertion import SIDEWAYS_VOX
from bimvox.planning.one_lift import plan_lift, proposed_again, unplanned_lift, with_planner_note
from bimvox.planning.rounds import OtherWays, Refused
from bimvox.planning.stage import Obstacle, Stage, turning_stage
from bimvox.proof.footprint import examined_by
from bimvox.records.lift import NOT_LIFTED, Lift, Status
from bimvox.revision.current_plan import CurrentPlan, ObstructionChange, RevisionRequest
from bimvox.revision.draft import Proof, RevisionDraft
from bimvox.revision.versions import Once, Reading, Validity, Version, Versions, obstructed_cells
from bimvox.site.default_rules import ALL_KEPT


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
        refused: Components whose lifts failed their proof, and why.
        other_ways: The ways that those not refused yet must avoid.
        work: Decides about lifts that have begun, and about motions.
        versions: What was proven of lifts, also in earlier rounds.

    Attributes:
        draft: The result so far.
        assembly: The parts in place and in the yard at this lift.
        validity: Which versions of lifts hold, with the state of the site before this lift.
        read: The state before it in the current plan.
        searched: Lifts whose fewest moves were found now.
        may_change: Lifts that get another way if their proof refuses them: neither begun nor retrained.
    """

    def __init__(
        self,
        current: CurrentPlan,
        request: RevisionRequest,
        change: ObstructionChange,
        refused: Refused,
        other_ways: OtherWays,
        work: CraneWork,
        versions: Versions,
    ) -> None:
        self.was, self.request, self.change, self.work = current, request, change, work
        self.refused, self.other_ways = refused, other_ways
        self.site, self.preparation = request.site, request.preparation
        self.draft = RevisionDraft()
        self.validity = Validity(versions, self.site, self.preparation)
        self.read = Reading(obstructed_cells(current.plan.site))
        self.searched, self.may_change = set[int](), list[Lift]()
        self.assembly = Assembly(self.site, self.preparation, one_at_a_time=True)

    def run(self) -> None:
        """Go through all lifts."""
        for was in self.was.plan.lifts:
            self._take(was)

    def _take(self, was: Lift) -> None:
        """Keep or replan the next lift."""
        assembly, draft = self.assembly, self.draft
        draft.read[was.order] = self.validity.now
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
        is_held = draft.held is not None and lift.order in draft.held.orders
        was_held = self.was.held is not None and was.order in self.was.held.orders
        if not is_held:  # a part on a hook is neither in place nor stored
            assembly.finish(lift.component, placed=lift.is_set)
        draft.lifts.append(lift)
        self.validity.now = self.validity.now.after(lift, is_set=lift.is_set or is_held)
        self.read = self.read.after(was, is_set=was.is_set or was_held)

    def _may_change(self, was: Lift) -> bool:
        """Return whether a lift may go another way if its proof refuses it."""
        if self.site.has_several_cranes and self.request.now_ns is not None:
            return False  # a hook that is stuck refuses all lifts of its crane
        return self.request.retrained is None or was.component not in self.request.retrained.components

    def _fewest_are_known(self, lift: Lift) -> bool:
        """Return whether the fewest moves that a lift states still hold; an earlier path has read an earlier state."""
        earlier = self.draft.paths.get(lift.order) if lift.order in self.draft.new_paths else None
        return self.validity.fewest_are_known(lift, self.read if earlier is None else earlier.read)

    def _lift(self, assembly: Assembly, was: Lift) -> Lift:
        """Return the lift; the same object if its path is kept."""
        component, retrained = self.site.components[was.component], self.request.retrained
        reason = self.refused.get(component.id)
        avoided, why = self.other_ways.of(component.id)
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
        if self.other_ways.unproven(component.id) is not None:
            return self._planned(assembly, assembly.begin(was.component), was)
        known = self._known(was)
        if known is was:
            return self._asked_again(assembly, was)
        if known is not None:
            self.draft.new_paths.add(was.order)
            return known
        if self._is_put_off(was):
            self.draft.new_paths.add(was.order)
            self.draft.undecided.add(was.order)
            return was
        stage = assembly.begin(was.component)
        lift = self._planned(assembly, stage, was)
        if lift.status is Status.INFEASIBLE and isinstance(stage, Obstacle) and was.place is not None:
            cells = partial(examined_by, self.site, component, was.place, SIDEWAYS_VOX)
            self.draft.examined[was.order] = Once(cells)
        return lift

    def _is_put_off(self, was: Lift) -> bool:
        """Return whether the lift is decided in the next part: it is met, and this part has its lifts.

        Only the first part after a change puts lifts off, so the second one decides all of them.
        """
        draft, request = self.draft, self.request
        if was.status is not Status.PLANNED or not self.change.ids or draft.held is not None:
            return False
        if self.site.has_several_cranes or request.retrained is not None:
            return False
        return bool(draft.pending) or len(draft.new_paths | draft.new_motions) >= request.first

    def _known(self, was: Lift) -> Lift | None:
        """Return what is still known of a lift: itself, or with an earlier path; None if it is to be examined."""
        version, validity, order = self.validity.of(was), self.validity, was.order
        is_beside = validity.is_beside_change(was, self.read if version is None else version.read)
        is_decided = order in self.was.pending - self.was.undecided and was.path_vox is not None
        if is_decided and self.draft.pending and not self.change.ids and not is_beside:
            return was  # only its motion is still to be made
        if was.status is Status.INFEASIBLE and not is_beside and not self._reason_is_met(was, version):
            if version is not None:
                self.draft.paths[order] = version
            return was
        if was.kept != ALL_KEPT and version is not None and not validity.reason_holds(version):
            return None  # it may keep more now
        known = validity.path(was)
        if known is None:
            return None
        self.draft.paths[order] = known
        return known.lift

    def _reason_is_met(self, was: Lift, version: Version | None) -> bool:
        """Return whether the change, or the new state of an earlier lift, may affect why a lift is infeasible."""
        if version is None:
            return bool(self.change.ids) or self.validity.now.done != self.read.done
        return not self.change.ids.isdisjoint(was.blocked_by) or not self.validity.reason_holds(version)

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
        propose, unproven = self.request.propose, self.other_ways.unproven(self.site.components[was.component].id)
        if unproven is not None:
            before, propose, unplanned = None, without_external(propose), with_planner_note(unplanned, unproven)
        lift = plan_lift(assembly, stage, unplanned, before, propose)
        self.searched.add(was.order)
        if lift.status is Status.PLANNED:
            self.draft.new_paths.add(was.order)  # always proven again, even if it could be kept
        else:
            self.draft.new_verdicts.add(was.order)
        return lift
