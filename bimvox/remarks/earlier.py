"""Lifts that are proven against earlier obstructions only."""

from __future__ import annotations

from collections.abc import Iterator

from bimvox.proof.over_time import not_current
from bimvox.records.remark import Remark, Severity
from bimvox.remarks.subject import Subject, about

NOT_CURRENT = "not_current"


def earlier(subject: Subject) -> Iterator[Remark]:
    """Yield a remark about every lift that ended before the obstructions became the current ones."""
    ids = set(not_current(subject.plan, subject.motions))
    for component in subject.lifted:
        if component.id in ids:
            said = "its lift is proven against earlier obstructions only: it ended before they became the current ones"
            yield about(component, NOT_CURRENT, Severity.MINOR, said)
