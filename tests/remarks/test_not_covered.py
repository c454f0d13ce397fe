from __future__ import annotations

import dataclasses

from box_sites import test_crane as crane_at
from remarked_plans import plan_of

from bimvox.records.lift import ModelledClash, yard_place
from bimvox.remarks.not_covered import NOT_COVERED, not_covered_by
from bimvox.site.component import StoredPose
from bimvox.site.means import Means

PARTS = [("slab", (2, 2, 0), (4, 4, 1)), ("post", (6, 2, 0), (6.5, 2.5, 3))]
ASKED_FOR = {"tandem", "two_hooks", "tolerances", "services_below", "services_above", "aviation"}


def lines(plan, context=()):
    return {line.code: line for line in not_covered_by(plan, context)}


def test_every_plan_of_a_crane_has_the_lines_that_a_lifting_supervisor_ticks() -> None:
    found = lines(plan_of(PARTS, crane=crane_at()))
    assert set(found) >= ASKED_FOR
    assert len(found) == len(not_covered_by(plan_of(PARTS, crane=crane_at())))  # each code once
    assert all(line.topic and line.text.endswith(".") for line in found.values())
    NOT_COVERED.model.model_validate(found["tandem"].to_dict())


def test_without_a_crane_there_is_nothing_about_cranes() -> None:
    found = lines(plan_of(PARTS))
    assert "tolerances" in found
    assert not {"tandem", "aviation", "erection", "neighbours"} & set(found)


def test_parts_that_no_crane_lifts_alone_are_named_for_a_tandem_lift() -> None:
    heavy = [("slab", (2, 2, 0), (4, 4, 1)), ("block", (30, 2, 0), (32, 4, 1))]
    crane = dataclasses.replace(crane_at(), jib_length_m=10.0)
    plan = plan_of(heavy, crane=crane, refused={"block"}, shape=(80, 30, 20))
    assert lines(plan)["tandem"].components == ("block",)
    assert "block" in lines(plan)["tandem"].text
    blocked = plan_of(heavy, crane=crane, refused={"slab"}, shape=(80, 30, 20))
    assert lines(blocked)["tandem"].components == ()  # the crane reaches it: something else refuses it


def test_upended_parts_of_the_plan_and_of_its_context_are_named() -> None:
    plan = plan_of(PARTS, crane=crane_at())
    post = plan.site.components[1]
    place = yard_place(post, 0, StoredPose.LYING_X, (20, 2, 1))
    lying = dataclasses.replace(plan.lifts[1], place=place)
    whole = dataclasses.replace(plan, lifts=(plan.lifts[0], lying))
    assert lines(whole)["two_hooks"].components == ("post",)
    extract = dataclasses.replace(plan, lifts=(plan.lifts[0],))
    assert lines(extract, (lying,))["two_hooks"].components == ("post",)
    assert lines(plan)["two_hooks"].components == ()


def test_what_is_drawn_into_each_other_and_what_is_given_is_counted() -> None:
    clash = ModelledClash("slab", "post", 0.02, (0.0, 0.0, 0.02))
    plan = plan_of(PARTS, crane=crane_at(), clashes=(clash,), obstructions=[("line", (0, 0, 5), (1, 9, 6))])
    assert "1 pair is drawn into each other" in lines(plan)["tolerances"].text
    assert "1 obstruction" in lines(plan)["services_above"].text


def test_a_name_that_many_parts_have_is_said_once() -> None:
    plan = plan_of([(f"{n}", (2.0 + n, 2.0, 0.0), (2.5 + n, 2.5, 3.0)) for n in range(5)], crane=crane_at())
    posts = tuple(dataclasses.replace(part, name="POST") for part in plan.site.components)
    same = dataclasses.replace(plan, site=dataclasses.replace(plan.site, components=posts))
    text = lines(same)["anchors"].text
    assert text.endswith("5 parts have assumed lifting points: POST.")


def test_obstacle_lights_follow_from_the_height_of_the_crane() -> None:
    assert "low intensity" in lines(plan_of(PARTS, crane=crane_at()))["aviation"].text
    tall = dataclasses.replace(crane_at(), jib_height_m=80.0)
    assert "medium intensity" in lines(plan_of(PARTS, crane=tall))["aviation"].text


def test_work_that_is_cast_also_needs_the_crane() -> None:
    cast = [PARTS[0], (*PARTS[1], {"means": Means.IN_SITU})]
    assert lines(plan_of(cast, crane=crane_at()))["other_lifts"].components == ("post",)


def test_loads_from_one_side_and_beams_that_may_twist_are_to_be_ticked() -> None:
    found = lines(plan_of([*PARTS, ("beam", (8, 2, 0), (12, 3, 1), {"ifc_class": "IfcBeam"})]))["eccentric"]
    assert "columns" in found.text and "twists" in found.text
    assert found.components == ("beam",)
    assert lines(plan_of(PARTS))["eccentric"].components == ()
