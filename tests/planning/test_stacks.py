"""Flat parts lie in stacks, the one that is lifted first on top, and people have room around them."""

import dataclasses
from itertools import combinations

import numpy as np
import pytest
from box_sites import box_site
from hypothesis import given
from hypothesis import strategies as st
from slab_yards import SLAB, slab_site, stacks_of

from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.proof.plan import verify_plan
from bimvox.records.lift import LiftPlan, Status, YardPlace
from bimvox.site.component import StoredPose
from bimvox.site.default_rules import YardRules
from bimvox.site.site import Rules, Site


def planned(site: Site) -> LiftPlan:
    return plan_lifts(site, prepare(site))


def test_four_slabs_are_a_stack_and_the_first_lifted_lies_on_top():
    plan = planned(slab_site())
    order = [plan.site.components[lift.component].id for lift in plan.lifts]
    assert stacks_of(plan) == [order]
    assert [lift.place.cell_vox[2] for lift in plan.lifts] == [7, 5, 3, 1]
    verdict = verify_plan(plan)
    assert verdict.verified, verdict.failures
    assert all(lift.status is Status.PLANNED for lift in plan.lifts)


def test_without_the_table_every_part_lies_on_the_ground_a_cell_apart():
    plan = planned(slab_site(lying=None))
    assert stacks_of(plan) == []
    assert {lift.place.cell_vox[2] for lift in plan.lifts} == {1}
    assert not {"gap", "stacks"} & {check.name for check in verify_plan(plan).checks}


@pytest.mark.parametrize(
    ("limits", "expected"),
    [
        ({"stack_parts": 2}, [2, 2]),
        ({"stack_parts": 1}, []),
        ({"stack_height_m": 0.8}, [3]),  # three slabs of 0.2 m and two bearers of 0.1 m
        ({"stack_height_m": 0.79}, [2, 2]),
        ({"stack_kg": 3 * 3840.0}, [3]),
        ({"dunnage_m": 0.6}, [3]),  # 2 m, as high as a slab is wide, but no more than 1.5 m
    ],
)
def test_stacks_keep_their_limits(limits, expected):
    limits = {"stack_height_m": 1.9} | limits if "dunnage_m" in limits else limits
    plan = planned(slab_site(lying=YardRules(**limits)))
    assert [len(stack) for stack in stacks_of(plan)] == expected
    assert verify_plan(plan).verified


def test_a_smaller_part_lies_on_a_larger_one_if_it_is_lifted_first():
    small, large = (3.0, 1.5, 0.2), (4.0, 2.0, 0.2)
    plans = [planned(slab_site(sizes, crane=False)) for sizes in ((small, large), (large, small))]
    first_m = [plan.site.components[plan.lifts[0].component].mesh.bounds_m[1, 0] for plan in plans]
    assert sorted(first_m) == [3.5, 4.5]
    assert [len(stacks_of(plan)) for plan in plans] == [int(length_m == 3.5) for length_m in first_m]


def test_a_stack_is_no_higher_than_it_is_wide():
    plan = planned(slab_site(((4.0, 0.6, 0.2),) * 4, crane=False))
    assert [len(stack) for stack in stacks_of(plan)] == [2, 2]  # 0.5 m each; three would be 0.8 m high


def test_what_is_upended_or_has_a_place_of_its_own_lies_in_no_stack():
    slab = ((0.5, 0.5, 0.0), (4.5, 2.5, 0.2))
    other = ((0.5, 3.0, 0.0), (4.5, 5.0, 0.2))
    for more in ({"erected": True}, {"start_vox": (30, 10, 1)}, {"stored_pose": StoredPose.LYING_X}):
        parts = [("one", *slab, SLAB), ("two", *other, SLAB | more)]
        site = box_site(parts, shape=(64, 50, 24), yard=((24.0, 0.0), (64.0, 50.0)), rules=Rules(yard=YardRules()))
        assert stacks_of(planned(site)) == []


def test_walls_are_not_stacked():
    walls = [(f"wall {n}", (0.5, n + 0.5, 0.0), (4.5, n + 0.7, 3.0), {"ifc_class": "IfcWall"}) for n in range(3)]
    rules = Rules(yard=YardRules())
    plan = planned(box_site(walls, shape=(64, 50, 24), yard=((24.0, 0.0), (64.0, 50.0)), rules=rules))
    assert stacks_of(plan) == []
    assert verify_plan(plan).verified


def test_a_yard_too_small_for_the_gap_takes_more_deliveries_and_then_says_why():
    high = ((4.0, 2.0, 1.0),) * 2  # cubes lie alone
    beside = {"shape": (64, 50, 24), "yard": ((24.0, 0.0), (34.0, 11.0))}
    alone = YardRules(stack_parts=1)
    near = planned(slab_site(high, YardRules(stack_parts=1, gap_m=0.0), crane=False, **beside))
    apart = planned(slab_site(high, YardRules(stack_parts=1, gap_m=2.0), crane=False, **beside))
    assert [max(lift.place.delivery for lift in plan.lifts) for plan in (near, apart)] == [0, 1]
    wall = [("wall", (14.0, 0.0, 0.0), (14.5, 6.0, 3.0))]
    none = planned(slab_site(high, alone, crane=False, structure=wall, **beside))
    assert {lift.status for lift in none.lifts} == {Status.INFEASIBLE}
    assert "with 0.6 m around it for the slinger ([yard] gap_m)" in none.lifts[0].reason


def test_a_part_of_a_stack_that_the_crane_cannot_lift_lies_in_it_until_its_turn():
    site = slab_site()
    preparation = prepare(site)
    second = preparation.sequence.order[1]
    plan = plan_lifts(site, preparation, refused={site.components[second].id: "it is refused"})
    assert [lift.status for lift in plan.lifts].count(Status.INFEASIBLE) == 1
    assert plan.lifts[1].by_other_means
    assert plan.lifts[1].in_yard is plan.lifts[1].place
    verdict = verify_plan(plan)
    assert verdict.verified, verdict.failures


SIZES = st.tuples(st.sampled_from((2.0, 3.0, 4.0)), st.sampled_from((1.0, 2.0)), st.sampled_from((0.2, 0.5, 1.2)))


@given(sizes=st.lists(SIZES, min_size=1, max_size=6), gap_m=st.sampled_from((0.0, 0.4, 0.6, 1.5)))
def test_every_plan_passes_the_proofs_own_checks_of_gaps_and_stacks(sizes, gap_m):
    yard = ((24.0, 0.0), (50.0, 22.0))
    plan = planned(slab_site(sizes, YardRules(gap_m=gap_m), crane=False, yard=yard))
    checks = {check.name: check for check in verify_plan(plan).checks}
    for name in ("gap", "stacks", "yard"):
        assert checks[name].passed, checks[name].failures
    for one, other in combinations([lift.place for lift in plan.lifts if lift.place is not None], 2):
        if other.delivery == one.delivery and (not one.stack or other.stack != one.stack):
            low, high = np.maximum(one.cell_vox, other.cell_vox), np.minimum(last_of(one), last_of(other))
            assert (low - high)[:2].max() * 0.5 >= max(gap_m, 0.5)  # a third definition: rectangles


def last_of(place: YardPlace) -> np.ndarray:
    return np.add(place.cell_vox, place.shape.size_vox)


def test_a_place_that_the_site_file_gives_twice_is_free_again_with_the_next_delivery():
    site = slab_site(lying=None)
    first, second, *others = site.components
    places = [place for lift in planned(site).lifts if (place := lift.place) is not None]
    same = [dataclasses.replace(one, start_vox=places[0].cell_vox) for one in (first, second)]
    plan = planned(dataclasses.replace(site, components=(*same, *others)))
    deliveries = {lift.component: lift.place.delivery for lift in plan.lifts if lift.place is not None}
    assert deliveries[0] != deliveries[1]
    assert all(lift.status is Status.PLANNED for lift in plan.lifts)
    assert verify_plan(plan).verified
