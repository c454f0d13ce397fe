"""The planner: every lift in order, each by what ``bimvox.planning.one_lift`` finds."""

from __future__ import annotations

from collections.abc import Mapping

from bimvox.planning.ahead import SearchedAhead
from bimvox.planning.assembly import Assembly
from bimvox.planning.one_lift import planned_by, policies_of, unplanned_lift
from bimvox.planning.preparation import Preparation
from bimvox.planning.propose import Propose
from bimvox.planning.rounds import Refusals
from bimvox.planning.stage import Obstacle
from bimvox.progress import Report
from bimvox.records.lift import Lift, LiftPlan, not_lifted
from bimvox.site.means import Means
from bimvox.site.site import Site
from bimvox.workers import ALONE, Workers


def plan_lifts(  # noqa: PLR0913  (all but the first two are optional, and given by name)
    site: Site,
    preparation: Preparation,
    *,
    propose: Propose | None = None,
    retrained: Propose | None = None,
    previous: LiftPlan | None = None,
    refused: Mapping[str, str] | None = None,
    kept: Mapping[int, Lift] | None = None,
    progress: Report | None = None,
    workers: Workers = ALONE,
) -> LiftPlan:
    """Plan every lift of a site.

    Args:
        site: The site.
        preparation: Contacts, order and yard of its geometry.
        propose: The policy; None for search alone.
        retrained: The policy after more training on this site; asked if the first one fails.
        previous: A plan of the same geometry with other obstructions; a lift whose path is still valid is kept. If it
            is of the same site, nothing is planned again before the first lift that is refused or missing in it, nor
            after it while the same parts are in place.
        refused: Components whose lift was planned but not proven, with the reason: they are infeasible. ``Refusals``
            also hold the last moves that others must avoid.
        kept: Lifts by component that do not change whatever is in the way, from a plan in execution.
        progress: Called with (stage, done, total).
        workers: Share the work of a plan that begins from nothing.

    Returns:
        The plan, infeasible lifts included with their reason.
    """
    before = {lift.component: lift for lift in previous.lifts} if previous else {}
    policies = policies_of(propose, retrained)
    assembly = Assembly(site, preparation, one_at_a_time=True)
    order = preparation.sequence.order
    lifts: list[Lift] = []
    as_before = previous is not None and previous.site is site
    is_first = previous is None and kept is None and not refused
    ahead = SearchedAhead(site, preparation, policies, workers if is_first else ALONE, progress)
    for number, index in enumerate(order):
        if site.components[index].means is not Means.CRANE:
            assembly.finish(index, placed=True)
            lifts.append(not_lifted(site.components[index], number))
            continue
        if kept is not None and index in kept:
            assembly.skip(index)
            assembly.finish(index, placed=kept[index].is_set)
            lifts.append(kept[index])
            continue
        name, last = site.components[index].id, before.get(index)
        avoided, why = refused.avoided_by(name) if isinstance(refused, Refusals) else ((), None)
        reason = (refused or {}).get(name)
        keeps_heading = why is not None
        if keeps_heading:
            assembly.keep_heading(index)
        unplanned = unplanned_lift(site, index, number, preparation.places[index])
        as_before = as_before and last is not None and (last.order, last.place) == (number, unplanned.place)
        if as_before and last is not None and not avoided and reason is None and not (keeps_heading and last.with_jib):
            assembly.skip(index)
            lifts.append(last)
        elif (found_ahead := ahead.lift(number, lifts)) is not None:
            assembly.skip(index)
            lifts.append(found_ahead)
        else:
            stage = assembly.begin(index, avoided=avoided)
            reason = reason or (why if isinstance(stage, Obstacle) else None)
            found = stage if reason is None else Obstacle(reason)
            lifts.append(planned_by(assembly, found, unplanned, last, policies))
            as_before = as_before and last is not None and last.is_set == lifts[-1].is_set
        assembly.finish(index, placed=lifts[-1].is_set)
        if progress is not None:
            progress("lifts", number + 1, len(order))
    sequence = preparation.sequence
    unheld = tuple(site.components[i].id for i in sequence.unheld)
    return LiftPlan(site, tuple(lifts), preparation.contacts.clashes, sequence.notes, unheld)
