"""The proof of gaps and stacks refuses forged places, each by its own words."""

import dataclasses

import pytest
from slab_yards import slab_site

from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.proof.plan import verify_plan
from bimvox.site.default_rules import YardRules
from bimvox.site.site import Blocker, Rules


@pytest.fixture(scope="module")
def plan():
    site = slab_site(((4.0, 2.0, 0.2),) * 3)
    return plan_lifts(site, prepare(site))


def with_places(plan, *changes):
    """Return a plan whose lifts have changed places, in their order; the paths stay."""
    lifts = [
        dataclasses.replace(lift, place=dataclasses.replace(lift.place, **change))
        for lift, change in zip(plan.lifts, changes, strict=True)
    ]
    return dataclasses.replace(plan, lifts=tuple(lifts))


def with_rules(plan, **changes):
    rules = dataclasses.replace(plan.site.rules, yard=dataclasses.replace(plan.site.rules.yard, **changes))
    return dataclasses.replace(plan, site=dataclasses.replace(plan.site, rules=rules))


def failures(plan, name):
    return " ".join(failure for check in verify_plan(plan).checks if check.name == name for failure in check.failures)


def test_the_plan_is_proven(plan):
    assert verify_plan(plan).verified
    assert {lift.place.stack for lift in plan.lifts} == {1}


@pytest.mark.parametrize(
    ("limits", "said"),
    [
        ({"stack_parts": 2}, "stack 1 of delivery 1: has 3 parts, more than 2"),
        ({"stack_kg": 5000.0}, "stack 1 of delivery 1: weighs 11.52 t, more than 5 t"),
        ({"stack_height_m": 0.7}, "stack 1 of delivery 1: is 0.80 m high, more than 0.70 m"),
        ({"dunnage_m": 0.6, "stack_height_m": 9.0}, "slab 1 is 0.50 m above slab 2; the dunnage is 1.00 m thick"),
    ],
)
def test_a_stack_beyond_its_limits_is_refused(plan, limits, said):
    order = {plan.site.components[lift.component].id: n for n, lift in enumerate(plan.lifts)}
    names = sorted(order, key=order.__getitem__)
    said = said.replace("slab 1", names[1]).replace("slab 2", names[2])
    assert said in failures(with_rules(plan, **limits), "stacks")


def test_a_part_that_lies_on_what_is_picked_is_refused(plan):
    first, second, third = (lift.place.cell_vox for lift in plan.lifts)
    upside_down = with_places(plan, {"cell_vox": third}, {"cell_vox": second}, {"cell_vox": first})
    found = failures(upside_down, "stacks")
    assert "but is lifted later" in found
    assert "lies on it when it is picked" in found


def test_a_part_that_overhangs_the_one_below_is_refused(plan):
    x, y, z = plan.lifts[0].place.cell_vox
    assert "overhangs" in failures(with_places(plan, {"cell_vox": (x + 1, y, z)}, {}, {}), "stacks")


def test_a_part_that_hangs_in_the_air_is_refused(plan):
    x, y, z = plan.lifts[0].place.cell_vox
    assert "is 1.00 m above" in failures(with_places(plan, {"cell_vox": (x, y, z + 1)}, {}, {}), "stacks")
    loose = failures(with_places(plan, {"stack": 0}, {}, {}), "stacks")
    assert "lies neither on the ground" in loose


def test_a_stack_that_does_not_stand_on_the_ground_is_refused(plan):
    lifted = [{"cell_vox": (*lift.place.cell_vox[:2], lift.place.cell_vox[2] + 1)} for lift in plan.lifts]
    assert "does not stand on the ground" in failures(with_places(plan, *lifted), "stacks")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"ifc_class": "IfcWall"}, "is neither a slab nor a beam, but a wall"),
        ({"erected": True}, "is upended, so it may not lie in a stack"),
        ({"start_vox": (40, 10, 1)}, "has a place of its own in the site file"),
    ],
)
def test_what_may_not_be_stacked_is_refused(plan, change, said):
    components = list(plan.site.components)
    components[1] = dataclasses.replace(components[1], **change)
    forged = dataclasses.replace(plan, site=dataclasses.replace(plan.site, components=tuple(components)))
    assert said in failures(forged, "stacks")


def test_stacks_without_rules_for_them_are_refused(plan):
    rules = dataclasses.replace(plan.site.rules, yard=None)
    bare = dataclasses.replace(plan, site=dataclasses.replace(plan.site, rules=rules))
    assert "the site's rules have no stacks" in failures(bare, "stacks")


def test_something_in_the_slingers_way_is_refused(plan):
    x, y, _ = plan.lifts[0].place.cell_vox
    frame = plan.site.frame

    def walled(kind, low, high):
        wall = Blocker("wall", kind, frame_cells(low, high))
        return dataclasses.replace(plan, site=dataclasses.replace(plan.site, blockers=(*plan.site.blockers, wall)))

    def frame_cells(low, high):
        import numpy as np

        return (np.argwhere(np.ones(np.subtract(high, low), bool)) + low).astype(np.int32)

    near = walled("structure", (x - 2, y, 1), (x - 1, y + 3, 4))  # a cell of 0.5 m is free, less than 0.6 m
    assert "wall is 0.50 m away on plan; the slinger needs 0.6 m" in failures(near, "gap")
    assert not failures(walled("structure", (x - 3, y, 1), (x - 2, y + 3, 4)), "gap")
    assert not failures(walled("structure", (x - 2, y, 5), (x - 1, y + 3, 8)), "gap")  # above their heads
    assert not failures(walled("obstruction", (x - 2, y, 1), (x - 1, y + 3, 4)), "gap")  # it comes and goes
    assert frame.voxel_size_m == 0.5


def test_places_of_the_site_file_are_not_held_to_the_gap_among_themselves():
    site = slab_site(((4.0, 2.0, 1.0),) * 2, None)
    starts = [(30, 10, 1), (30, 15, 1)]
    components = tuple(
        dataclasses.replace(one, start_vox=start) for one, start in zip(site.components, starts, strict=True)
    )
    site = dataclasses.replace(site, components=components, rules=Rules(yard=YardRules(gap_m=2.0)))
    assert not failures(plan_lifts(site, prepare(site)), "gap")


def on_access(plan, columns, **of_crane):
    access = plan.site.yard.copy()
    access[:] = False
    access[columns] = True
    cranes = tuple(dataclasses.replace(crane, **of_crane) for crane in plan.site.cranes)
    return dataclasses.replace(plan, site=dataclasses.replace(plan.site, access=access, cranes=cranes))


def test_a_part_on_the_access_of_trucks_is_refused(plan):
    x = {lift.place.cell_vox[0] for lift in plan.lifts}
    assert "lies on the access of trucks" in failures(on_access(plan, slice(min(x), min(x) + 1)), "yard")
    assert not failures(on_access(plan, slice(0, min(x))), "yard")


def test_a_part_that_no_truck_brings_within_reach_is_refused(plan):
    beyond = on_access(plan, slice(-1, None), jib_length_m=12.0)
    assert "does not carry it over any truck" in failures(beyond, "yard")
    heavy = tuple(dataclasses.replace(one, mass_kg=1e6) for one in plan.site.components)
    forged = on_access(plan, slice(0, 1))
    forged = dataclasses.replace(forged, site=dataclasses.replace(forged.site, components=heavy))
    assert "does not carry it over any truck" in failures(forged, "yard")


def test_a_part_above_the_ground_lies_on_structure_wholly(plan):
    first, *others = plan.lifts
    x, y, _ = first.place.cell_vox
    places = [{"cell_vox": (x, y, 3), "stack": 0}, *({} for _ in others)]
    said = f"{plan.site.components[first.component].id}: is stored neither on the ground nor on structure"
    assert said in failures(with_places(plan, *places), "yard")
    below = first.place.shape.cells[first.place.shape.cells[:, 2] == 0] + (x, y, 2)
    for cells, accepted in ((below, True), (below[1:], False)):
        site = dataclasses.replace(plan.site, blockers=(*plan.site.blockers, Blocker("deck", "structure", cells)))
        found = failures(dataclasses.replace(with_places(plan, *places), site=site), "yard")
        assert (said not in found) is accepted
