"""Walls that stand in the yard without a rack."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bimvox.records.lift import Status
from bimvox.records.remark import Remark, Severity
from bimvox.remarks.subject import Subject, about
from bimvox.site.component import StoredPose
from bimvox.site.upright_box import sizes_m
from bimvox.site.work import Work, kind_of
from bimvox.site.yard_rules import RACKED_THINNESS

NO_RACK = "no_rack"


def storage(subject: Subject) -> Iterator[Remark]:
    """Yield a remark about every thin wall that stands in the yard, but in no rack."""
    rules = subject.site.rules.yard
    if rules is None or rules.rack_parts < 1:
        return
    for lift in sorted(subject.plan.lifts, key=lambda lift: lift.order):
        component, place = subject.site.components[lift.component], lift.place
        if lift.status is not Status.PLANNED or place is None or place.rack or place.pose is not StoredPose.AS_BUILT:
            continue
        height_m = float(np.ptp(component.mesh.bounds_m[:, 2]))
        if kind_of(component) is Work.WALL and height_m >= RACKED_THINNESS * sizes_m(component.mesh)[2]:
            said = "stands in the yard without a rack: no room for one, or it is not along the cells; brace it there"
            yield about(component, NO_RACK, Severity.SERIOUS, said)
