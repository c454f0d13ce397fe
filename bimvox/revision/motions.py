"""The motions of a part: missing ones are made, each at its own stage, and all are put on the clock."""

from __future__ import annotations

from dataclasses import replace

from bimvox.errors import MotionError
from bimvox.motion.shift import joined_on, waiting
from bimvox.motion.time_plan import LiftTimes
from bimvox.planning.rounds import Refused
from bimvox.records.lift import Status
from bimvox.records.motion import LiftMotion
from bimvox.records.reasons import NOT_DRIVEN
from bimvox.revision.draft import RevisionDraft
from bimvox.revision.request import RevisionRequest
from bimvox.units import NS_PER_S


def made_in_full(request: RevisionRequest, draft: RevisionDraft) -> RevisionDraft | Refused:
    """Return a draft with all motions made and put on the clock one after the other.

    Args:
        request: What to revise the plan for.
        draft: The draft.

    Returns:
        The same with every motion; or the lifts that the crane cannot drive, and why.
    """
    motions, refused = _missing_motions(request, draft)
    if refused:
        return refused
    on_clock, before = dict(draft.motions), None
    for lift in draft.lifts:
        order = lift.order
        if order in draft.laid:
            motion = draft.laid[order] or motions[order]
            on_clock[order] = _in_time(request, joined_on(motion, None if before is None else on_clock.get(before)))
        if lift.status is Status.PLANNED:
            before = order
    return replace(draft, motions={order: on_clock[order] for order in sorted(on_clock)}, laid={})


def _missing_motions(request: RevisionRequest, draft: RevisionDraft) -> tuple[dict[int, LiftMotion], Refused]:
    """Return the motions that a draft left open, each timed at its own stage, from time 0 and slew angle 0.

    Returns:
        Motions by order; and why the crane cannot drive other lifts, by component.
    """
    missing, site = draft.motions_to_make, request.site
    if not missing:
        return {}, {}
    times = LiftTimes(site, request.preparation, draft.lifts[: missing[-1] + 1])
    found = dict(zip(missing, times.shared(missing, request.workers), strict=True))
    refused = {one.component: f"{NOT_DRIVEN}{one.message}" for one in found.values() if isinstance(one, MotionError)}
    return {order: one for order, one in found.items() if isinstance(one, LiftMotion)}, refused


def _in_time(request: RevisionRequest, motion: LiftMotion) -> LiftMotion:
    """Return a motion that does not start in the past: an idle crane waits until now and for the hold."""
    now_ns = request.now_ns
    if now_ns is None or motion.start_ns >= now_ns:
        return motion
    return waiting(motion, now_ns + round(request.hold_s * NS_PER_S) - motion.start_ns)
