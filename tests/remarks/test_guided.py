"""A remark on loads that a crew tilts and holds aside."""

import dataclasses

from drawn_plans import motions_by_hand, plan_by_hand
from remarked_plans import of_kind

from bimvox.records.guide import Guide
from bimvox.records.remark import Severity


def test_a_guided_load_is_remarked_with_its_tilt():
    plan = plan_by_hand(crane=True)
    guide = Guide(0.0, (0.0, 0.0, 0.0), ((1.0, 0.0, 0.0), (0.5, 0.06, -0.04), (0.0, 0.0, 0.0)))
    lifts = (dataclasses.replace(plan.lifts[0], guide=guide), *plan.lifts[1:])
    guided = dataclasses.replace(plan, lifts=lifts)
    (remark,) = of_kind(guided, "guided", motions_by_hand(guided))
    assert remark.severity is Severity.MINOR
    assert remark.component == plan.site.components[plan.lifts[0].component].id
    assert "tilted by 2.3 degrees and held 0.06 m aside, from 1.0 m above it" in remark.text
    assert of_kind(plan, "guided", motions_by_hand(plan)) == []
