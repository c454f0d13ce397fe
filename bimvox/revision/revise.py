"""Revise a plan after a change of the obstructions: only the lifts that it affects are planned and proven again.

One flow for any number of cranes:

1. ``Replanning`` goes through the lifts in order. A lift keeps path and proof if no added cell is in its footprint
   (``bimvox.proof.footprint``). A planned lift that is met gets a new path. An infeasible lift is tried again if the
   change touches its cause. A lift that becomes infeasible, or planned again, changes the site for later lifts: its
   cells at its place and in the yard count as added or removed, and its neighbours are examined again.
2. ``CraneWork`` stops what must stop and puts the motions on the clock: one crane executes lifts one after the other,
   several follow a schedule.
3. What is new is proven. Lifts that fail get another way, or are refused, and the round starts again.
4. The part is yielded. With one crane, the first new lifts are planned, timed and proven first. The next part plans
   all others (that is the verdict); they are timed and proven in it and in later parts, which are larger.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from bimvox.planning.rounds import OtherWays, Refused, proven_in_rounds
from bimvox.planning.stage import Obstacle, Stage
from bimvox.records.lift import HOOK_CANNOT_LEAVE, Lift, LiftPlan, same_path
from bimvox.records.motion import LiftMotion
from bimvox.revision.cranes import CranesUnderWay, SeveralCranes
from bimvox.revision.current_plan import (
    CurrentPlan,
    HeldCranes,
    ObstructionChange,
    RevisionPart,
    RevisionRequest,
    change_between,
    last_finished,
    motion_under_way,
)
from bimvox.revision.draft import MotionsInTheMaking, Proof, RevisionDraft, made_in_full, prove_new, versions_after
from bimvox.revision.keep_or_replan import CraneWork, Replanning
from bimvox.revision.stop_cranes import load_is_met
from bimvox.revision.versions import Version, Versions
from bimvox.stop.redirect import Held, Redirected, UnderWay, redirect, redirect_held, redirected_if_possible


class _OneCrane:
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
        order, draft, has_crane = lift.order, replanning.draft, bool(self._site.cranes)
        if draft.held is not None:
            draft.pending.add(order)
            return
        known = replanning.validity.motion(lift) if has_crane else None
        if known is not None:
            draft.moved[order] = known
        if self._keeps_motion(replanning, lift, was, known):
            if has_crane and draft.pending:
                # After a pending lift the clock is not known yet; a later part sets it.
                draft.motions[order] = self._was.motions[order]
            elif has_crane:
                draft.laid[order] = self._was.motions[order]
            return
        count = len(draft.new_paths - draft.pending | draft.new_motions)
        if draft.pending or count > self._request.first - (order not in draft.new_paths):
            draft.moved.pop(order, None)
            draft.pending.add(order)
            return
        if not has_crane:
            return
        draft.new_motions.add(order)
        draft.laid[order] = None if known is None else known.motion
        if known is None:
            draft.unproven_motions.add(order)
            self._making.add(replanning.validity.legs(lift), (*draft.lifts, lift))

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
        if held is None and reason is None and not load_is_met(site, was, motion, replanning.change.added, now_ns):
            draft.motions[was.order] = motion
            return was

        def attempt(rule: Stage, blocked: Obstacle | None) -> Redirected | Held:
            if held is not None:
                return redirect_held(site, crane, held, rule, blocked, now_ns, hold_s)
            return redirect(
                site, crane, UnderWay(lift, motion, replanning.validity.now.before), rule, blocked, now_ns, hold_s
            )

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

    def _keeps_motion(self, replanning: Replanning, lift: Lift, was: Lift, known: Version | None) -> bool:
        """Return whether a lift keeps the motion that it has in the current plan."""
        if lift is not was or lift.order in replanning.draft.new_paths or lift.order in self._was.pending:
            return False
        if not self._site.cranes:
            return True
        # An earlier round may have proven another motion of the same path, which the current plan does not have.
        own = next((one for one in self._was.versions.get(was.order, ()) if one.lift is was), None)
        return known is not None and own is not None and known.swept is own.swept


_LATER = 8
"""How many times as many new lifts a later part has as the first: fewer parts take less, and nobody waits for them."""


def revise(
    current: CurrentPlan,
    request: RevisionRequest,
    *,
    known_shapes: set[int] | None = None,
    on_verdict: Callable[[], None] | None = None,
) -> Iterator[RevisionPart]:
    """Yield the plan, revised for a site with other obstructions, in proven parts.

    Args:
        current: The current plan.
        request: The site with its obstructions now, and how to revise.
        known_shapes: See ``verify_plan``.
        on_verdict: Called whenever it is known which of the decided lifts can be planned.

    Yields:
        The plan in parts, the first lifts first; the last part has nothing pending.

    Raises:
        VerificationError: If a proof fails and no lift is the cause.
    """
    site = request.site
    change = change_between(current.plan.site, site)
    shapes, first = set() if known_shapes is None else known_shapes, request.first
    while True:
        part = _proven_part(current, request, change, shapes, on_verdict)
        yield part
        current, change = part.current, change_between(site, site)
        if not current.pending or current.held is not None:
            part.make_footprints()
            return
        request = replace(request, first=_LATER * first)


def _proven_part(
    current: CurrentPlan,
    request: RevisionRequest,
    change: ObstructionChange,
    known_shapes: set[int],
    on_verdict: Callable[[], None] | None,
) -> RevisionPart:
    versions, other_ways = current.versions, OtherWays()

    def attempt(refused: Refused) -> RevisionPart | Refused:
        nonlocal versions
        left: Refused = {}
        while not left:
            work = _work(current, request, change, refused)
            replanning = Replanning(current, request, change, refused, other_ways, work, versions)
            replanning.run()
            if on_verdict is not None:
                on_verdict()
            failed: RevisionDraft | Refused = work.timed(replanning.draft)
            if isinstance(failed, RevisionDraft):
                draft, plan = failed, failed.plan(current, request, change)
                found = prove_new(plan, draft, known_shapes, request.workers)
                versions = versions_after(versions, draft, plan, found)
                if not found.refused:
                    known_shapes.update(lift.component for lift in draft.lifts if lift.order in found.paths)
                    return _part(current, draft, plan, change, versions)
                failed = work.refused(found)
            left = other_ways.without(request.site, replanning.may_change, failed)
        return left

    with request.workers.knowing(request.site, *current.plan.lifts):
        return proven_in_rounds(attempt, "changed")


def _work(current: CurrentPlan, request: RevisionRequest, change: ObstructionChange, refused: Refused) -> CraneWork:
    """Return the crane work for one crane, several, or several under way."""
    if not request.site.has_several_cranes:
        return _OneCrane(current, request, refused)
    if request.now_ns is None:
        return SeveralCranes(current, request, change)
    return CranesUnderWay(current, request, change, refused)


def _part(
    was: CurrentPlan, draft: RevisionDraft, plan: LiftPlan, change: ObstructionChange, versions: Versions
) -> RevisionPart:
    """Return the part of a draft whose new lifts are proven."""
    made_paths = draft.new_paths - draft.pending
    before, now = ({lift.order: lift for lift in lifts} for lifts in (was.plan.lifts, draft.lifts))
    replanned = {order for order in made_paths if not same_path(before[order], now[order])}
    return RevisionPart(
        CurrentPlan(
            plan, draft.motions, versions, frozenset(draft.pending), frozenset(draft.undecided), held=draft.held
        ),
        made=tuple(sorted(made_paths | draft.new_motions | draft.new_verdicts | draft.written)),
        replanned=tuple(sorted(replanned)),
        retimed=tuple(sorted(draft.new_motions - replanned)),
        change=change,
        stops=draft.stops,
    )
