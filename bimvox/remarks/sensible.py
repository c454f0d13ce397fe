"""Remarks about a plan that comes from a file, whose values need not make sense."""

from __future__ import annotations

from collections.abc import Collection

from bimvox.proof.values import check_values
from bimvox.records.lift import Lift, LiftPlan
from bimvox.records.motion import LiftMotion
from bimvox.records.remark import Remark
from bimvox.remarks.remarks import remarks_of


def remarks_if_sensible(
    plan: LiftPlan, motions: Collection[LiftMotion], context: Collection[Lift] = ()
) -> tuple[Remark, ...] | None:
    """Return the remarks about a plan; None if its values make no sense, because nothing follows from them."""
    if not check_values(plan, tuple(motions), context).passed:
        return None
    return remarks_of(plan, motions, context)
