"""Plans of boxes without paths, for rules about the model, and their remarks by kind."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

from box_sites import box_site

from bimvox.records.lift import Lift, LiftPlan, Status
from bimvox.records.motion import LiftMotion
from bimvox.records.proof import Remark
from bimvox.remarks.remarks import remarks_of


def plan_of(parts: Sequence[tuple], *, refused: Collection[str] = (), **more: Any) -> LiftPlan:
    """Return a plan of all parts in the given order; ``more``: options of ``box_site``, and ``clashes``, ``unheld``."""
    own = {key: more.pop(key) for key in ("clashes", "unheld", "notes") if key in more}
    site = box_site(parts, **more)
    status = [Status.INFEASIBLE if part.id in refused else Status.PLANNED for part in site.components]
    lifts = tuple(Lift(n, n, None, one) for n, one in enumerate(status))
    return LiftPlan(site, lifts, **own)


def of_kind(
    plan: LiftPlan, kind: str, motions: Sequence[LiftMotion] = (), context: Sequence[Lift] = ()
) -> list[Remark]:
    """Return the remarks of a kind."""
    return [remark for remark in remarks_of(plan, motions, context) if remark.kind == kind]


def named(plan: LiftPlan, kind: str, motions: Sequence[LiftMotion] = ()) -> dict[str | None, str]:
    """Return the texts of the remarks of a kind by the name of the part."""
    return {remark.name: remark.text for remark in of_kind(plan, kind, motions)}
