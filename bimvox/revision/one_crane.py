"""A revision with one crane, or none: lifts follow each other, and a stop concerns the one lift under way."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bimvox.planning.rounds import Refused
from bimvox.planning.stage import Obstacle, Stage
from bimvox.records.lift import Lift
from bimvox.records.motion import LiftMotion
from bimvox.records.reasons import HOOK_CANNOT_LEAVE
from bimvox.revision.current_plan import CurrentPlan
from bimvox.revision.draft import RevisionDraft
from bimvox.revision.held_cranes import HeldCranes
from bimvox.revision.in_transit import last_finished, motion_under_way
from bimvox.revision.motions import MotionsInTheMaking, made_in_full
from bimvox.revision.part_proof import Proof
from bimvox.revision.recall import same_part
from bimvox.revision.request import RevisionRequest
from bimvox.stop.redirect import Held, Redirected, UnderWay, redirect, redirect_held, redirected_if_possible

if TYPE_CHECKING:
    from bimvox.revision.keep_or_replan import Replanning


class OneCrane:
    """The ``CraneWork`` of a site with one crane or none.

    Args:
        current: The current plan.
        request: What to revise it for.
        refused: Components whose lifts failed their proof, and why.
    """

    def __init__(self, current: CurrentPlan, request: RevisionRequest, refused: Refused) -> None:
        self._was, self._request, self._refused = current, request, refused
        self._site = request.site
        self._held = None if current.held is None else current.held.loads[0]
        self._last = last_finished(current, request.now_ns)
        self._making = MotionsInTheMaking(request)

    def begun(self, replanning: Replanning, was: Lift) -> Lift | None:
        """Return a lift that is done, or the one under way: unchanged if the change does not meet the rest of it."""
        if was.order <= self._last:
            if was.order in self._was.motions:
                replanning.draft.motions[was.order] = self._was.motions[was.order]
            return was
        motion = motion_under_way(self._was, was, self._request.now_ns)
        return None if motion is None else self._redirected(replanning, was, motion)

    def choose_motion(self, replanning: Replanning, lift: Lift, was: Lift) -> None:
        """Keep a lift's motion if it is still proven, or take an earlier one again; otherwise it is made or pending."""
        order, draft, before, has_crane = lift.order, replanning.draft, replanning.before, bool(self._site.cranes)
        if draft.held is not None:
            draft.pending.add(order)
            return
        if self._keeps_motion(replanning, lift, was, same_start=same_part(before, replanning.was_before)):
            if has_crane and draft.pending:
                # After a pending lift the clock is not known yet; a later part sets it.
                draft.motions[order] = self._was.motions[order]
            elif has_crane:
                draft.laid[order] = self._was.motions[order]
            return
        count = len(draft.new_paths - draft.pending | draft.new_motions)
        if draft.pending or count > self._request.first - (order not in draft.new_paths):
            draft.pending.add(order)
            return
        if not has_crane:
            return
        known = replanning.recall.motion(lift, replanning.done, before)
        if known is not None and known.motion is not None:
            draft.recalled_motions[order] = known
        else:
            draft.unproven_motions.add(order)
        draft.new_motions.add(order)
        draft.laid[order] = None if known is None else known.motion
        if draft.laid[order] is None:
            self._making.add(replanning.known_legs(lift, was), (*draft.lifts, lift))

    def timed(self, draft: RevisionDraft) -> RevisionDraft | Refused:
        """Return the draft with all motions made and put on the clock one after the other."""
        return made_in_full(self._request, draft, self._making)

    def refused(self, proof: Proof) -> Refused:
        """Return the lifts that failed; or all remaining lifts if one of them is done already.

        In that case the hook is obstructed: it cannot leave the place where it set the last part.
        """
        site, lifts = self._was.plan.site, self._was.plan.lifts
        done = {site.components[lift.component].id for lift in lifts if lift.order <= self._last}
        stuck = next((reason for component, reason in proof.refused.items() if component in done), None)
        if stuck is None:
            return proof.refused
        left = [site.components[lift.component].id for lift in lifts if lift.order > self._last]
        return dict.fromkeys(left, f"{HOOK_CANNOT_LEAVE}{stuck}")

    def _redirected(self, replanning: Replanning, was: Lift, motion: LiftMotion) -> Lift:
        """Return the lift under way: unchanged if the change does not meet its rest, otherwise redirected or held."""
        site, crane, held, draft = self._site, self._site.cranes[motion.crane], self._held, replanning.draft
        now_ns, hold_s = self._request.now_ns, self._request.hold_s
        assert now_ns is not None
        lift = was if held is None else held.lift
        reason = self._refused.get(site.components[was.component].id)
        if held is None and reason is None and not replanning.touched.rest_is_met(was, motion, now_ns):
            draft.motions[was.order] = motion
            return was

        def attempt(rule: Stage, blocked: Obstacle | None) -> Redirected | Held:
            if held is not None:
                return redirect_held(site, crane, held, rule, blocked, now_ns, hold_s)
            return redirect(site, crane, UnderWay(lift, motion, replanning.before), rule, blocked, now_ns, hold_s)

        ways = replanning.assembly.ways_on(was.component, lift.last_moves_vox)
        found = redirected_if_possible(ways, attempt, reason)
        draft.stops = (found,)
        if isinstance(found, Held):
            draft.held = HeldCranes((found,))
            draft.new_verdicts.add(was.order)
            return found.infeasible
        draft.new_paths.add(was.order)
        draft.new_motions.add(was.order)
        draft.unproven_motions.add(was.order)
        draft.motions[was.order] = found.motion
        return found.lift

    def _keeps_motion(self, replanning: Replanning, lift: Lift, was: Lift, *, same_start: bool) -> bool:
        if lift is not was or lift.order in replanning.draft.new_paths or lift.order in self._was.pending:
            return False
        if not self._site.cranes:
            return True
        motion = self._was.motions.get(lift.order)
        if motion is None or lift.order not in self._was.motion_footprints or not same_start:
            return False
        return not replanning.touched.motion_is_met(was, motion)
