"""Loads that a crew tilts and holds aside on their last moves."""

from __future__ import annotations

from collections.abc import Iterator
from math import degrees

from bimvox.records.remark import Remark, Severity
from bimvox.remarks.subject import Subject, about

GUIDED = "guided"


def guided(subject: Subject) -> Iterator[Remark]:
    """Yield a remark about every load that reaches its place only if a crew guides it."""
    for lift in subject.lifts:
        if lift.guide is not None:
            said = (
                f"reaches its place only if it is tilted by {degrees(lift.guide.steepest_rad):.1f} degrees and held "
                f"{lift.guide.furthest_m:.2f} m aside, from {lift.guide.top_m:.1f} m above it: "
                "one sling leg is adjustable"
            )
            yield about(subject.site.components[lift.component], GUIDED, Severity.MINOR, said)
