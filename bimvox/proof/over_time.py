"""The proof of a plan that is being executed while obstructions change.

Past motions are proven against the obstructions at that time, future motions against the current obstructions. A
lift's path counts from the moment at which the load began to follow it. If a change does not affect the rest of the
path, the path continues into the next epoch. Its motion is then proven against the old obstructions before the change
and against the new ones after it.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import replace

from bimvox.proof.clock import check_clock, check_stops
from bimvox.proof.motion import verify_motions, verify_together
from bimvox.proof.plan import verify_plan
from bimvox.proof.space import ALWAYS_NS
from bimvox.records.lift import LOAD_IS_HELD, Lift, LiftPlan, Status
from bimvox.records.motion import LiftMotion
from bimvox.records.proof import Check, Verification
from bimvox.site.site import Blocker, Site
from bimvox.walk import Store
from bimvox.workers import ALONE, Workers


def verify_plan_over_time(
    plan: LiftPlan,
    motions: Sequence[LiftMotion],
    context: Collection[Lift] = (),
    *,
    known_shapes: set[int] | None = None,
    store: Store | None = None,
    workers: Workers = ALONE,
) -> Verification:
    """Check every planned lift of a plan, each path against the obstructions when the load began to follow it.

    Args:
        plan: The plan.
        motions: Motions of its lifts; they give the times.
        context: Lifts of the same plan that it does not carry.
        known_shapes: See ``verify_plan``.
        store: See ``verify_plan``; lifts whose obstructions changed under way are not added.
        workers: Share the work, if the obstructions did not change.
    """
    if not plan.history and not any(lift.left for lift in plan.lifts):
        return verify_plan(plan, context, known_shapes=known_shapes, store=store, workers=workers)
    starts = {motion.order: begins_ns(plan.site, motion) for motion in motions}
    epochs = Check("epochs")
    _check_epochs(epochs, plan, motions, context)
    found = [Verification((epochs,))]
    for from_ns, until_ns, site in epochs_of(plan):
        lifts = [
            version
            for lift in plan.lifts
            for begins_ns, version in _versions(lift, starts.get(lift.order, ALWAYS_NS[1] - 1))
            if from_ns <= begins_ns < until_ns
        ]
        orders = {lift.order for lift in lifts}
        others = [lift for lift in (*plan.lifts, *context) if lift.order not in orders]
        if lifts:
            own = replace(plan, site=site, lifts=tuple(lifts), history=())
            found.append(verify_plan(own, others, known_shapes=known_shapes))
    return _together(found)


def verify_motions_over_time(
    plan: LiftPlan,
    motions: Sequence[LiftMotion],
    context: Collection[Lift] = (),
    *,
    store: Store | None = None,
    workers: Workers = ALONE,
) -> Verification:
    """Check the motions of a plan, each moment against the obstructions at that time.

    Args:
        plan: The plan; assumed to be proven by ``verify_plan_over_time``.
        motions: One per planned lift, in order.
        context: Lifts of the same plan that it does not carry.
        store: See ``verify_motions``; only of a plan whose obstructions did not change.
        workers: See ``verify_plan_over_time``.
    """
    clock = Check("timeline")
    check_clock(clock, plan, motions, context)
    check_stops(clock, plan, motions)
    if not plan.history:
        found_now = verify_motions(plan, motions, context, store=store, workers=workers)
        return _together([found_now, Verification((clock,))])
    found = []
    known = motions if plan.site.has_several_cranes else None
    for from_ns, until_ns, site in epochs_of(plan):
        driven = [motion for motion in motions if motion.start_ns < until_ns and motion.end_ns > from_ns]
        orders = {motion.order for motion in driven}
        own = replace(plan, site=site, lifts=tuple(lift for lift in plan.lifts if lift.order in orders), history=())
        others = [lift for lift in (*plan.lifts, *context) if lift.order not in orders]
        found.append(verify_motions(own, driven, others, window_ns=(from_ns, until_ns), known=known))
    if known is not None:
        found.append(verify_together(plan, motions, context))
    whole = [motion.order for motion in motions]
    planned = sorted(lift.order for lift in plan.lifts if lift.status is Status.PLANNED)
    clock.look(whole == planned, f"the motions are of lifts {whole}, planned are {planned}")
    return _together([*found, Verification((clock,))])


def _check_epochs(check: Check, plan: LiftPlan, motions: Sequence[LiftMotion], context: Collection[Lift]) -> None:
    """Check that loads leave paths only when obstructions change, and that no change is after the last motion."""
    ends_ns = [epoch.until_ns for epoch in plan.history]
    for lift in plan.lifts:
        check.about = plan.site.components[lift.component].id
        for left in lift.left:
            check.look(
                left.until_ns in ends_ns,
                f"lift {lift.number} ({check.about}): it leaves a path at {left.until_ns / 1e9:.3f} s, but the "
                "obstructions do not change then",
            )
    check.about = None
    if not motions:
        check.look(
            bool(context) or not ends_ns, "the plan has past obstructions, but no motion shows when they counted"
        )
    elif (last := _last_of_all(plan, motions, context)) is not None:
        # With nothing left to lift, nobody notices a change after the last motion.
        is_done = all(lift.status is Status.PLANNED for lift in (*plan.lifts, *context))
        for until_ns in ends_ns:
            check.look(
                until_ns < last.end_ns or (until_ns == last.end_ns and not is_done),
                f"lift {last.number} ({plan.site.components[last.component].label}): the last motion ends at "
                f"{last.end_ns / 1e9:.3f} s, but past obstructions are claimed until {until_ns / 1e9:.3f} s",
            )


def _last_of_all(plan: LiftPlan, motions: Sequence[LiftMotion], context: Collection[Lift]) -> LiftMotion | None:
    """Return the last motion; None if a lift without a motion in the log may be under way after it."""
    last = max(motions, key=lambda motion: motion.end_ns, default=None)
    if last is None or any(_may_be_later(plan.site, lift, last) for lift in _left(plan, motions, context)):
        return None
    return last


def _left(plan: LiftPlan, motions: Sequence[LiftMotion], context: Collection[Lift]) -> list[Lift]:
    """Return the lifts without a motion in the log."""
    timed = {motion.order for motion in motions}
    return [lift for lift in (*plan.lifts, *context) if lift.order not in timed]


def _may_be_later(site: Site, lift: Lift, last: LiftMotion) -> bool:
    """Return whether a lift that has no motion in the log may be under way after the last motion in it."""
    if lift.status is Status.PLANNED:
        return lift.order > last.order or site.has_several_cranes
    return (lift.reason or "").startswith(LOAD_IS_HELD)


def not_current(plan: LiftPlan, motions: Sequence[LiftMotion]) -> tuple[str, ...]:
    """Return the ids of the parts that were set before the obstructions became the current ones, in order.

    Their lifts are proven against the obstructions at that time, but not against the current ones.
    """
    if not plan.history:
        return ()
    until_ns = plan.history[-1].until_ns
    done = {motion.order for motion in motions if motion.set_ns <= until_ns}
    return tuple(plan.site.components[lift.component].id for lift in plan.lifts if lift.order in done)


def check_under_way(check: Check, plan: LiftPlan, motions: Sequence[LiftMotion], context: Collection[Lift]) -> None:
    """Check that the paths of the lifts under way when the obstructions became the current ones meet none of these.

    Only the log shows how far such a lift was then. The path of a load that was stopped counts from there. A lift is
    done when its part is set, the last one when it ends: nothing is left that a change could affect before that.

    Args:
        check: Receives the result.
        plan: The plan; assumed to be proven.
        motions: Its motions.
        context: Lifts of the same plan that it does not carry.
    """
    if not plan.history:
        return
    until_ns = plan.history[-1].until_ns
    done_ns = {motion.order: motion.set_ns for motion in motions}
    last = _last_of_all(plan, motions, context)
    if last is not None:
        done_ns[last.order] = last.end_ns
    under_way = {one.order for one in motions if one.start_ns < until_ns < done_ns[one.order]}
    for lift in plan.lifts:
        if lift.order not in under_way:
            continue
        others = [one for one in (*plan.lifts, *context) if one.order != lift.order]
        alone = replace(plan, lifts=(replace(lift, left=()),), history=())
        met = [told for one in verify_plan(alone, others).checks if one.name in _MEETS for told in one.failures]
        part = plan.site.components[lift.component]
        check.look(
            not met,
            f"lift {lift.number} ({part.label}): it is not done before the obstructions become the current ones, at "
            f"{until_ns / 1e9:.3f} s, but at {done_ns[lift.order] / 1e9:.3f} s; with them: {next(iter(met), '')}",
        )


_MEETS = frozenset(("boundary", "cells", "triangles", "rope", "margin", "rope_margin"))
"""The checks of a path that fail if it meets an obstruction."""


def epochs_of(plan: LiftPlan) -> Iterator[tuple[int, int, Site]]:
    """Yield start, end (site's clock, ns) and site of each epoch; the last site is the plan's own."""
    from_ns = ALWAYS_NS[0]
    for epoch in plan.history:
        yield from_ns, epoch.until_ns, _site_with(plan.site, epoch.obstructions)
        from_ns = epoch.until_ns
    yield from_ns, ALWAYS_NS[1], plan.site


def _site_with(site: Site, obstructions: Iterable[Blocker]) -> Site:
    """Return a site with other obstructions; its labels and digests are those of the original."""
    fixed = tuple(blocker for blocker in site.blockers if blocker.kind != "obstruction")
    return replace(site, blockers=(*fixed, *obstructions))


def begins_ns(site: Site, motion: LiftMotion) -> int:
    """Return when a lift counts as begun. With several cranes the path may change while the hook waits for its turn."""
    return motion.hooked_ns if site.has_several_cranes else motion.start_ns


def _versions(lift: Lift, start_ns: int) -> Iterator[tuple[int, Lift]]:
    """Return every path of a lift as a separate lift, and when the load began to follow it."""
    begins_ns = start_ns
    for n, left in enumerate(lift.left):
        yield (
            begins_ns,
            # The least number of moves is known only for its current path.
            replace(
                lift,
                path_vox=left.path_vox,
                contact_moves=left.contact_moves,
                guide=left.guide,
                with_jib=left.with_jib,
                shortest_moves=None,
                left=lift.left[:n],
            ),
        )
        begins_ns = left.until_ns
    yield begins_ns, lift


def _together(found: Sequence[Verification]) -> Verification:
    """Merge the checks of the same name."""
    checks: dict[str, Check] = {}
    for check in (check for verification in found for check in verification.checks):
        checks.setdefault(check.name, Check(check.name, unit=check.unit)).add(check)
    return Verification(tuple(checks.values()))
