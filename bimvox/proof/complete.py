"""The proof that a plan has one lift for each part, numbered, with a status that fits what is in it."""

from __future__ import annotations

from collections.abc import Collection

from bimvox.records.lift import NOT_LIFTED, Lift, LiftPlan, Status
from bimvox.records.proof import Check
from bimvox.site.means import Means


def check_complete(check: Check, plan: LiftPlan, lifts: Collection[Lift]) -> None:
    """Check the lifts of a plan by themselves; ``lifts`` are all, also those that an extract of it does not carry."""
    parts = plan.site.components
    seen = [lift.component for lift in lifts]
    check.look(sorted(seen) == list(range(len(parts))), "not every component has exactly one lift")
    orders = sorted(lift.order for lift in lifts)
    check.look(orders == list(range(len(orders))), "the lifts are not numbered 0, 1, 2 ...")
    for lift in plan.lifts:
        name, means = parts[lift.component].id, parts[lift.component].means
        good = (lift.path_vox is not None and lift.place is not None) == (lift.status is Status.PLANNED)
        check.look(good or lift.path_vox is None, f"{name}: its path and its status disagree")
        if lift.status is Status.INFEASIBLE:
            check.look(bool(lift.reason), f"{name}: infeasible without a reason")
        check.look(
            lift.status.value == means.value if lift.status in NOT_LIFTED else means is Means.CRANE,
            f"{name}: its means is {means.value}, but its lift is {lift.status.value}",
        )
    for lift in lifts:
        allowed = lift.status is Status.INFEASIBLE and plan.site.rules.by_other_means
        check.look(
            allowed or not lift.by_other_means,
            f"{parts[lift.component].id}: set by other means, but it is planned or the site's rules do not allow that",
        )
