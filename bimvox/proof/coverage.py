"""The proof that the checks looked at something: a check without samples has not passed where lifts are carried."""

from __future__ import annotations

from collections.abc import Sequence

from bimvox.records.lift import LiftPlan, Status
from bimvox.records.proof import Check

_ALWAYS = ("complete", "shapes", "mass", "slings", "unit_moves", "boundary", "cells", "yard")
_WITH_A_CRANE = (
    "reach",
    "timeline",
    "axis_limits",
    "axis_range",
    "ends",
    "rests",
    "spacing",
    "capacity",
    "motion_cells",
)
_WITH_A_ROPE = ("rope", "motion_rope")


def with_coverage(plan: LiftPlan, checks: Sequence[Check]) -> tuple[Check, ...]:
    """Return all checks of a plan and its motions, failed where they had to look at something and did not.

    A plan that carries no planned lift fails ``complete``: nothing of it was proven.
    """
    found = {check.name: check for check in checks}
    carried = sum(lift.status is Status.PLANNED for lift in plan.lifts)
    if not carried:
        found.setdefault("complete", Check("complete")).look(
            False, "nothing was proven: no lift of this log is both carried and planned"
        )
        return tuple(found.values())
    crane = _WITH_A_CRANE if plan.site.cranes else ()
    rope = _WITH_A_ROPE if plan.site.cranes and plan.site.rules.rope else ()
    for name in (*_ALWAYS, *crane, *rope):
        check = found.setdefault(name, Check(name))
        if not check.samples:
            check.look(False, f"looked at nothing, although {carried} planned lifts are carried")
    return tuple(found.values())
