"""Lifts that are proven against earlier obstructions only."""

from __future__ import annotations

from collections.abc import Iterator

from bimvox.proof.over_time import not_current
from bimvox.records.remark import Remark, Severity
from bimvox.remarks.subject import Subject, about
from bimvox.units import clock

NOT_CURRENT = "not_current"


def earlier(subject: Subject) -> Iterator[Remark]:
    """Yield a remark about every part that was set before the obstructions became the current ones, with the times."""
    ids = set(not_current(subject.plan, subject.motions))
    set_ns = {motion.component: motion.set_ns for motion in subject.motions}
    for component in subject.lifted:
        if component.id in ids:
            set_at, since = (clock(ns / 1e9) for ns in (set_ns[component.index], subject.plan.history[-1].until_ns))
            said = (
                f"its lift is proven against earlier obstructions only: it was set at {set_at}, before they became the "
                f"current ones at {since}"
            )
            yield about(component, NOT_CURRENT, Severity.MINOR, said)
