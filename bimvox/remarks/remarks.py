"""All remarks about a plan."""

from __future__ import annotations

from collections.abc import Collection

from bimvox.records.lift import Lift, LiftPlan
from bimvox.records.motion import LiftMotion
from bimvox.records.remark import Remark, Severity


def remarks_of(plan: LiftPlan, motions: Collection[LiftMotion], context: Collection[Lift] = ()) -> tuple[Remark, ...]:
    """Return the remarks about a plan, the gravest first; the same plan always gives the same ones.

    Args:
        plan: The plan.
        motions: The timed motions of its lifts; empty without a crane.
        context: Lifts of the same plan that it does not contain (it is an extract of a log).
    """
    found: list[Remark] = []
    if plan.site.cranes and not plan.site.rules.wind_speed_m_s:
        found.append(Remark("wind", Severity.MINOR, "no wind is considered: rules.wind_speed_m_s is 0"))
    rank = list(Severity)
    return tuple(sorted(found, key=lambda remark: rank.index(remark.severity)))
