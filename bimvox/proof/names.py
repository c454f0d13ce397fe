"""The check that a plan names only what is on its site."""

from __future__ import annotations

from collections.abc import Collection

from bimvox.records.lift import NOT_LIFTED, Lift, LiftPlan, Status
from bimvox.records.proof import Check

_OBSTRUCTION = "obstruction"
_KINDS = frozenset(("ground", "crane", "structure", _OBSTRUCTION))
_COPY = "#"
"""Follows the GlobalId in the id of a part whose GlobalId occurs more than once in the model."""


def check_names(check: Check, plan: LiftPlan, context: Collection[Lift]) -> None:
    """Check that every id in a plan is that of a part or a fixed object, and that every id is that of its GlobalId.

    Args:
        check: Receives the result.
        plan: The plan.
        context: Lifts of the same plan that it does not carry.
    """
    site = plan.site
    parts = {component.id for component in site.components}
    past = {blocker.id for epoch in plan.history for blocker in epoch.obstructions}
    known = parts | past | {blocker.id for blocker in site.blockers}
    numbers = {lift.component: lift.number for lift in (*plan.lifts, *context)}
    for component in site.components:
        name = f"lift {numbers.get(component.index, '-')} ({component.label})"
        own = component.id == component.global_id or component.id.startswith(component.global_id + _COPY)
        check.look(own, f"{name}: its GlobalId {component.global_id!r} is not that of its id {component.id!r}")
        for key, others in (("before", component.before), ("after", component.after)):
            for other in others:
                check.look(other in parts, f"{name}: {key} names {other!r}, which is not a part of the site")
    for other in plan.unheld:
        check.look(other in parts, f"unheld: {other!r} is not a part of the site")
    for blocker in site.blockers:
        check.look(blocker.kind in _KINDS, f"fixed object {blocker.id!r}: there is no kind {blocker.kind!r}")
    fixed = parts | {blocker.id for blocker in site.blockers if blocker.kind != _OBSTRUCTION}
    for number, epoch in enumerate(plan.history):
        seen: set[str] = set()
        for blocker in epoch.obstructions:
            check.look(blocker.id not in seen | fixed, f"history[{number}]: {blocker.id!r}: the id occurs twice")
            seen.add(blocker.id)
    for lift in (*plan.lifts, *context):
        name = f"lift {lift.number} ({site.components[lift.component].label})"
        why = site.components[lift.component].means_reason if lift.status in NOT_LIFTED else None
        check.look(
            lift.status is Status.INFEASIBLE or (lift.reason == why and not lift.blocked_by),
            f"{name}: it is {lift.status.value}, yet it says why it is not possible",
        )
        found = (lift.method is not None) == (lift.status is Status.PLANNED)
        check.look(found, f"{name}: it is {lift.status.value}, and its path was found by {lift.method or 'nothing'}")
        for other in lift.blocked_by:
            check.look(other in known, f"{name}: it is blocked by {other!r}, which is not on the site")
