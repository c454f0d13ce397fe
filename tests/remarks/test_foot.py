"""Remarks on a crane that stands inside the building or its outline."""

from __future__ import annotations

from box_sites import test_crane as crane_at
from remarked_plans import of_kind, plan_of

from bimvox.records.lift import LiftPlan
from bimvox.records.remark import Severity

CORNERS = [(f"column {x} {y}", (x, y, 0.0), (x + 0.5, y + 0.5, 3.0)) for x in (2.0, 12.0) for y in (2.0, 12.0)]


def with_crane(x: float, y: float, *more: tuple) -> LiftPlan:
    return plan_of([*CORNERS, *more], crane=crane_at(base=(x, y, 0.0), jib=30.0, height=9.0))


def test_a_mast_through_a_part_or_structure_is_serious() -> None:
    slab = ("slab", (2.0, 2.0, 3.0), (12.5, 12.5, 3.5))
    (remark,) = of_kind(with_crane(7.0, 7.0, slab), "crane_foot")
    assert remark.severity is Severity.SERIOUS
    assert remark.text == "the mast of crane 'test' goes through slab"
    hut = [("hut", (17.0, 1.0, 0.0), (18.5, 3.0, 2.5))]
    (other,) = of_kind(
        plan_of(CORNERS, structure=hut, crane=crane_at(base=(17.5, 2.0, 0.0), jib=30.0, height=9.0)), "crane_foot"
    )
    assert other.text == "the mast of crane 'test' goes through hut"


def test_a_mast_inside_the_outline_is_minor() -> None:
    (remark,) = of_kind(with_crane(7.0, 7.0), "crane_foot")
    assert remark.severity is Severity.MINOR
    assert "inside the outline" in remark.text


def test_a_mast_next_to_the_building_has_no_remark() -> None:
    assert not of_kind(with_crane(16.0, 7.0), "crane_foot")
