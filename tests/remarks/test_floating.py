"""Parts that float, alone or together, are named; parts that something carries or holds are not."""

from __future__ import annotations

import dataclasses

from remarked_plans import named, of_kind, plan_of

from bimvox.records.lift import Lift, LiftPlan, Status
from bimvox.records.remark import Severity

COLUMN = ("column", (2.0, 2.0, 0.0), (2.5, 2.5, 3.0))
BEAM = ("beam", (2.0, 2.0, 3.0), (6.0, 2.5, 3.5))
CLOUD = ("cloud", (8.0, 8.0, 5.9), (9.0, 9.0, 6.4))
NEXT = ("next", (9.0, 8.0, 5.9), (10.0, 9.0, 6.4))


def test_a_part_that_touches_nothing_is_serious_and_says_how_high() -> None:
    (remark,) = of_kind(plan_of([COLUMN, BEAM, CLOUD]), "floats")
    assert (remark.component, remark.severity) == ("cloud", Severity.SERIOUS)
    assert remark.text == "floats 5.9 m above the ground: nothing is under it or next to it"


def test_parts_that_hold_only_each_other_all_float() -> None:
    found = named(plan_of([COLUMN, CLOUD, NEXT]), "floats")
    assert set(found) == {"cloud", "next"}
    assert "it touches only another part that floats" in found["next"]


def test_a_part_on_structure_or_next_to_a_held_part_does_not_float() -> None:
    wall = [("wall", (8.0, 8.0, 0.0), (9.0, 9.0, 5.9))]
    assert not named(plan_of([COLUMN, BEAM, CLOUD, NEXT], structure=wall), "floats")


def test_a_joint_is_not_a_gap_but_a_decimetre_is() -> None:
    above = {gap: ("beam", (2.0, 2.0, 3.0 + gap), (6.0, 2.5, 3.5 + gap)) for gap in (0.04, 0.1)}
    assert not named(plan_of([COLUMN, above[0.04]]), "floats")
    assert set(named(plan_of([COLUMN, above[0.1]]), "floats")) == {"beam"}


def test_what_rests_on_a_refused_part_floats() -> None:
    assert set(named(plan_of([COLUMN, BEAM], refused=["column"]), "floats")) == {"beam"}


def test_what_rests_on_a_part_that_is_set_otherwise_does_not_float() -> None:
    plan = plan_of([COLUMN, BEAM], refused=["column"])
    lifts = (dataclasses.replace(plan.lifts[0], by_other_means=True), *plan.lifts[1:])
    assert plan.site.components[lifts[0].component].id == "column"
    assert not named(dataclasses.replace(plan, lifts=lifts), "floats")


def test_a_model_that_is_rounded_down_to_a_cell_stands_on_the_ground() -> None:
    low = ("slab", (2.0, 2.0, 0.3), (6.0, 6.0, 0.5))
    assert not named(plan_of([low]), "floats")
    (note,) = of_kind(plan_of([low]), "assumed_ground")
    assert "300 mm above it, stands on it" in note.text


def test_a_part_inside_another_one_does_not_float() -> None:
    core = ("core", (2.2, 2.2, 1.0), (2.3, 2.3, 2.0))
    assert not named(plan_of([COLUMN, core]), "floats")


def test_an_extract_has_no_remarks_about_parts_that_it_does_not_carry() -> None:
    plan = plan_of([COLUMN, BEAM, CLOUD])
    extract = LiftPlan(plan.site, plan.lifts[1:2])
    assert not of_kind(extract, "floats", context=(plan.lifts[0], plan.lifts[2]))
    refused = Lift(0, 0, None, Status.INFEASIBLE)
    assert of_kind(extract, "floats", context=(refused, plan.lifts[2]))


def test_a_part_between_others_hangs_unless_something_is_under_it() -> None:
    columns = [("a", (2.0, 2.0, 0.0), (2.5, 2.5, 6.0)), ("b", (6.0, 2.0, 0.0), (6.5, 2.5, 6.0))]
    beam = ("beam", (2.5, 2.0, 3.0), (6.0, 2.5, 3.5))
    (remark,) = of_kind(plan_of([*columns, beam]), "hangs")
    assert (remark.component, remark.severity) == ("beam", Severity.MINOR)
    corbel = ("corbel", (2.5, 2.0, 2.6), (2.8, 2.5, 2.98))
    assert not of_kind(plan_of([*columns, beam], structure=[corbel]), "hangs")
    assert not of_kind(plan_of([COLUMN, BEAM, CLOUD]), "hangs")


def test_a_part_set_before_what_holds_it_is_named() -> None:
    (remark,) = of_kind(plan_of([COLUMN, BEAM], unheld=("beam",)), "unheld")
    assert (remark.component, remark.severity) == ("beam", Severity.SERIOUS)


def test_a_building_without_foundations_is_one_remark() -> None:
    cloud = [(f"cloud {n}", (float(n), 2.0, 1.5), (n + 1.0, 3.0, 2.5)) for n in range(12)]
    (remark,) = of_kind(plan_of([*cloud, ("column", (2.0, 8.0, 0.0), (2.5, 8.5, 3.0))]), "floats")
    assert (remark.component, remark.severity) == (None, Severity.SERIOUS)
    assert remark.text.startswith("12 parts float 1.5 m above the ground and touch only each other: foundations are")
