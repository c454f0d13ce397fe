"""Revisions of a watched plan as segments, and the newest plan from a whole log and the segments after it.

A segment is a log: it carries the lifts that are new in its revision, with their motions; all other lifts are its
context, as in an extract. Every tool that reads a log reads a segment. A whole log and the segments with higher
revisions give the newest plan: each lift comes from the last of them that carries it, and the motions are put on one
clock in order.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Collection, Mapping, Sequence
from functools import lru_cache

from bimvox.log.plan_json import LIFTS_KEPT
from bimvox.log.plan_log import PENDING, LogEvent, PlanLog
from bimvox.motion.trajectories import chained
from bimvox.records.lift import Lift, Status
from bimvox.records.motion import LiftMotion
from bimvox.site.site import Site, digest_of

REPLAN_EVENT = "replan"
"""Kind of the event that describes a revision."""

FIRST_PLAN = "first_plan"
"""Metadata key: digest of the plan that the watch began with; segments with the same digest belong together."""

NOW_NS = "simulated_ns"
"""Metadata key: the time on the site's clock when a revision of a plan that is carried out was made."""


def segment_of(
    whole: PlanLog,
    motions: Mapping[int, LiftMotion],
    made: Collection[int],
    pending: Collection[int],
    event: Mapping[str, str],
    more: Sequence[LogEvent] = (),
) -> PlanLog:
    """Return the segment of a revision.

    Args:
        whole: The log of the revision: its plan, number, attachments and metadata.
        motions: Its motions by order; at least those of the lifts that are new.
        made: Orders of the lifts that are new in this revision.
        pending: Orders of planned lifts that are not proven yet; they are not among ``made``.
        event: What changed, and why.
        more: Other events.
    """
    plan = whole.plan
    carried = tuple(lift for lift in plan.lifts if lift.order in made)
    own = tuple(motions[lift.order] for lift in carried if lift.order in motions)
    start_ns = min((motion.start_ns for motion in own), default=0)
    end_ns = max((motion.end_ns for motion in own), default=start_ns)
    return dataclasses.replace(
        whole,
        plan=dataclasses.replace(plan, lifts=carried),
        motions=own,
        metadata={**whole.metadata, PENDING: json.dumps(sorted(pending))},
        events=(LogEvent(REPLAN_EVENT, start_ns, end_ns, event), *more),
        context=tuple(_without_path(lift) for lift in plan.lifts if lift.order not in made),
    )


@lru_cache(maxsize=LIFTS_KEPT)
def _without_path(lift: Lift) -> Lift:
    """Return a lift as part of a context; the same object again, so that its JSON is made only once."""
    return dataclasses.replace(lift, path_vox=None)


def first_plan_of(log: PlanLog) -> str:
    """Return the digest of the plan that a log's watch began with: the log's own plan if it comes from no watch."""
    if (known := log.metadata.get(FIRST_PLAN)) is not None:
        return known
    lifts = [
        (lift.order, lift.component, lift.status.value, lift.place and lift.place.cell_vox, lift.path_vox)
        for lift in log.plan.lifts
    ]
    return digest_of("first plan 1", log.plan.site.digest, lifts)


def newest(base: PlanLog, segments: Sequence[PlanLog]) -> PlanLog:
    """Return the newest plan.

    The segments are of the base's plan, with higher revisions, ascending.

    Returns:
        The plan after the last segment; lifts pending there are planned, without a path or a motion.
    """
    lifts: dict[int, Lift] = {lift.order: lift for lift in base.plan.lifts}
    motions = {motion.order: motion for motion in base.motions}
    last = base
    for segment in segments:
        for lift in segment.plan.lifts:
            lifts[lift.order] = lift
            motions.pop(lift.order, None)
        motions |= {motion.order: motion for motion in segment.motions}
        pending = pending_of(segment)
        for lift in segment.context:
            known = lifts.get(lift.order)
            if lift.status is not Status.PLANNED or known is None or lift.order in pending:
                lifts[lift.order] = lift
                motions.pop(lift.order, None)
            elif known.shortest_moves != lift.shortest_moves:
                lifts[lift.order] = dataclasses.replace(known, shortest_moves=lift.shortest_moves)
        last = segment
    ordered = tuple(lifts[order] for order in sorted(lifts))
    return dataclasses.replace(
        base,
        plan=dataclasses.replace(last.plan, lifts=ordered),
        motions=_on_one_clock(last.plan.site, motions, pending_of(last)),
        attachments=last.attachments,
        metadata=last.metadata,
        revision=last.revision,
        events=last.events,
    )


def is_segment(log: PlanLog) -> bool:
    """Return whether a log is a revision's segment; the remarks about a plan are in whole logs and extracts of them."""
    return PENDING in log.metadata


def pending_of(log: PlanLog) -> frozenset[int]:
    """Return the orders of the planned lifts that a segment leaves to a later one."""
    return frozenset(int(order) for order in json.loads(log.metadata.get(PENDING, "[]")))


def _on_one_clock(site: Site, motions: Mapping[int, LiftMotion], pending: Collection[int]) -> tuple[LiftMotion, ...]:
    """Return the motions on one clock; after a pending lift the clock is unknown, so motions keep their times.

    With several cranes the segments hold every motion that changed, including those that only moved on the clock.
    """
    if site.has_several_cranes:
        return tuple(motions[order] for order in sorted(motions))
    first = min(pending, default=None)
    known = [motions[order] for order in sorted(motions) if first is None or order < first]
    return (*chained(known), *(motions[order] for order in sorted(motions) if first is not None and order > first))
