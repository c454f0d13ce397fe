"""What a verdict takes as given is said in short sentences."""

from __future__ import annotations

import dataclasses

import numpy as np
from box_sites import test_crane as crane_at
from planned_sites import planned, portal_crane, portal_site
from remarked_plans import plan_of
from turning_sites import BESIDE_THE_PORTAL, turning_site

from bimvox.records.lift import ModelledClash
from bimvox.remarks.conditions import conditions_of
from bimvox.remarks.remarks import remarks_of
from bimvox.remarks.table import KEPT_HEADING
from bimvox.site.site import Rules, SwingRule

PARTS = [(name, (2.0 * n + 2.0, 2.0, 0.0), (2.0 * n + 3.0, 3.0, 3.0)) for n, name in enumerate("abcde")]


def test_a_plan_without_any_is_proven_as_it_is() -> None:
    assert conditions_of(plan_of(PARTS), ()) == ()
    assert conditions_of(plan_of(PARTS, crane=crane_at(), rules=Rules(wind_speed_m_s=9.0)), ()) == ()


def test_what_is_not_proven_is_named() -> None:
    plan = plan_of(PARTS, refused=["a", "b", "c", "d"], unheld=("e",), clashes=(ModelledClash("d", "e", 0.1, None),))
    assert conditions_of(plan, ()) == (
        "infeasible parts are not there while the others are lifted, or are set by other means out of their way: "
        "a, b, c and 1 more",
        "parts are held by something that is not in the model until their neighbours are set: e",
        "parts may overlap as deep as they are drawn into each other: d and e",
    )


def test_rules_that_switch_a_proof_off_are_conditions() -> None:
    plan = plan_of(PARTS, crane=crane_at(), rules=Rules(swing=SwingRule.OFF, rope=False))
    assert conditions_of(plan, ()) == ("there is no wind", "loads do not swing", "the hoist rope touches nothing")
    assert conditions_of(dataclasses.replace(plan, site=dataclasses.replace(plan.site, cranes=())), ()) == ()


def test_how_far_the_jib_turns_while_people_keep_the_heading_is_a_condition():
    plan, motions = planned(portal_site(portal_crane()))
    turns = sorted(float(np.degrees(np.abs(np.diff(motion.loaded.slew_rad)).sum())) for motion in motions)
    (said,) = [words for words in conditions_of(plan, motions) if "tag line" in words]
    assert f"by {turns[-1]:.0f} degrees at most" in said
    assert f"by {turns[len(turns) // 2]:.0f} degrees in the median lift" in said


def test_loads_that_turn_with_the_jib_and_those_without_room_are_said() -> None:
    plan, motions = planned(turning_site(obstructions=BESIDE_THE_PORTAL))
    turning = len([lift for lift in plan.lifts if lift.with_jib])
    assert 0 < turning < 4
    said = [one for one in conditions_of(plan, motions) if "jib" in one]
    assert said[0].startswith(f"{turning} of 4 loads turn with the jib: by 4")
    assert "by tag line above their places, 30 s a quarter" in said[0]
    assert said[1].startswith(f"people keep the heading of {4 - turning} loads without room to turn by tag line")
    named = [one for one in remarks_of(plan, motions) if one.kind == KEPT_HEADING.code]
    assert len(named) == 4 - turning
    assert "beam" in {one.component for one in named}
