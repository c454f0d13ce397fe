"""Every part has a hold when it is set: it reaches ground or structure through cells that touch."""

from __future__ import annotations

from dataclasses import replace

import pytest
from box_sites import box_site

from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.proof.support import check_stands
from bimvox.records.lift import Lift
from bimvox.records.proof import Check

PARTS = [
    ("block", (1.0, 1.0, 0.0), (2.0, 2.0, 1.0)),
    ("upper", (1.0, 1.0, 1.0), (2.0, 2.0, 2.0)),
    ("afloat", (5.0, 5.0, 4.0), (6.0, 6.0, 5.0)),
]
SITE = box_site(PARTS)


@pytest.fixture(scope="module")
def lifts() -> dict[str, Lift]:
    return {SITE.components[lift.component].id: lift for lift in plan_lifts(SITE, prepare(SITE)).lifts}


def found(*lifts: Lift, **more: object) -> tuple[str, ...]:
    check = Check("stands")
    check_stands(check, SITE, [replace(lift, order=n) for n, lift in enumerate(lifts)], **more)
    return tuple(check.failures)


def test_a_part_on_one_that_stands_has_a_hold_and_one_set_before_it_has_none(lifts: dict[str, Lift]):
    assert found(lifts["block"], lifts["upper"]) == ()
    assert found(lifts["upper"], lifts["block"]) == ("upper: has no hold until block is set",)


def test_a_part_that_holds_on_to_nothing_counts_as_held_if_the_plan_lists_it_or_it_was_proven(lifts: dict[str, Lift]):
    # Nothing in the finished building holds it: no order is wrong.
    assert found(lifts["block"], lifts["afloat"]) == ()
    assert found(lifts["upper"], lifts["block"], unheld={"upper"}) == ()
    assert found(lifts["upper"], lifts["block"], proven={0}) == ()
