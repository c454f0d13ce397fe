"""Flat parts lie in stacks, the one that is lifted first on top, and people have room around them."""

import dataclasses
from itertools import combinations

import numpy as np
import pytest
from box_sites import box_site
from box_sites import test_crane as crane_of
from hypothesis import given
from hypothesis import strategies as st
from slab_yards import SLAB, slab_site, stacks_of

from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.proof.plan import verify_plan
from bimvox.records.lift import LiftPlan, Status, YardPlace
from bimvox.remarks.remarks import remarks_of
from bimvox.site.component import StoredPose
from bimvox.site.default_rules import YardRules
from bimvox.site.site import Blocker, Rules, Site


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


RACKS = YardRules(rack_parts=10)
YARD = ((24.0, 0.0), (64.0, 50.0))


def wall_site(sizes, lying=RACKS, *, crane=True, yard=YARD, **more) -> Site:
    """Return a site with walls (length, thickness, height) in a row, next to a yard of 20 by 25 m."""
    parts = [
        (f"wall {n}", (0.5, 1.5 * n, 0.0), (0.5 + length, 1.5 * n + thick, high), {"ifc_class": "IfcWall"} | more)
        for n, (length, thick, high) in enumerate(sizes)
    ]
    own = crane_of(base=(9.0, -4.0, 0.0), jib=40.0, height=16.0) if crane else None
    return box_site(parts, crane=own, shape=(64, 50, 28), yard=yard, rules=Rules(rope=crane, yard=lying))


def racks_of(plan: LiftPlan) -> list[int]:
    found: dict[tuple[int, int], int] = {}
    for lift in plan.lifts:
        if lift.place is not None and lift.place.rack:
            key = (lift.place.delivery, abs(lift.place.rack))
            found[key] = found.get(key, 0) + 1
    return list(found.values())


def failures(plan: LiftPlan, name: str = "racks") -> str:
    return " ".join(failure for check in verify_plan(plan).checks if check.name == name for failure in check.failures)


WALLS = ((4.0, 0.2, 3.0), (5.0, 0.2, 3.0), (3.0, 0.2, 2.0))


@pytest.fixture(scope="module")
def plan() -> LiftPlan:
    return planned(wall_site(WALLS))


def test_walls_stand_in_a_rack_and_the_first_lifted_is_outermost(plan):
    assert {lift.status for lift in plan.lifts} == {Status.PLANNED}
    assert racks_of(plan) == [3]
    verdict = verify_plan(plan)
    assert verdict.verified, verdict.failures
    places = [lift.place for lift in plan.lifts]
    axis = int(np.argmin(places[0].shape.size_vox[:2]))
    at = [place.cell_vox[axis] * np.sign(place.rack) for place in places]
    assert at == sorted(at)
    assert not [one for one in remarks_of(plan, ()) if one.kind == "no_rack"]


@pytest.mark.parametrize(("limits", "expected"), [({"rack_parts": 2}, [2, 1]), ({"rack_parts": 0}, [])])
def test_racks_keep_their_limits(limits, expected):
    plan = planned(wall_site(WALLS, YardRules(**limits), crane=False))
    assert racks_of(plan) == expected
    assert verify_plan(plan).verified


def test_only_thin_walls_with_no_place_of_their_own_stand_in_racks():
    assert racks_of(planned(wall_site(((4.0, 0.8, 3.0),), crane=False))) == []
    for more in ({"start_vox": (30, 10, 1)}, {"stored_pose": StoredPose.LYING_X}, {"ifc_class": "IfcSlab"}):
        assert racks_of(planned(wall_site(WALLS[:1], crane=False, **more))) == []


def test_a_wall_without_room_for_a_frame_stands_alone_and_a_remark_says_so():
    strip = ((24.0, 0.0), (36.0, 1.0))  # a cell deep: room for the wall, not for a frame
    plan = planned(wall_site(((4.0, 0.2, 3.0),), YardRules(rack_parts=10, gap_m=0.0), crane=False, yard=strip))
    assert plan.lifts[0].status is Status.PLANNED
    assert verify_plan(plan).verified
    (remark,) = [one for one in remarks_of(plan, ()) if one.kind == "no_rack"]
    assert "without a rack" in remark.text


def forged(plan: LiftPlan, number: int, **change) -> LiftPlan:
    lifts = list(plan.lifts)
    lifts[number] = dataclasses.replace(lifts[number], place=dataclasses.replace(lifts[number].place, **change))
    return dataclasses.replace(plan, lifts=tuple(lifts))


def test_forged_racks_are_refused(plan):
    rules = dataclasses.replace(plan.site.rules, yard=YardRules(rack_parts=2))
    assert "has 3 walls, more than 2" in failures(with_site(plan, rules=rules))
    deep = dataclasses.replace(plan.site.rules, yard=YardRules(rack_parts=10, rack_depth=2.0, gap_m=9.0))
    assert "9 m" in failures(forged(with_site(plan, rules=deep), 1, rack=2))
    bare = dataclasses.replace(plan.site.rules, yard=None)
    assert "the site's rules have no racks" in failures(with_site(plan, rules=bare))
    first, last = plan.lifts[0].place, plan.lifts[2].place
    swapped = forged(forged(plan, 0, cell_vox=last.cell_vox), 2, cell_vox=first.cell_vox)
    assert "which is lifted before it" in failures(swapped)
    assert "which side the frame is" in failures(forged(plan, 1, rack=-plan.lifts[1].place.rack))
    x, y, z = last.cell_vox
    for aside in (14, -14):
        assert "does not lean on" in failures(forged(plan, 2, cell_vox=(x + aside, y, z)))
    assert "does not stand on the ground" in failures(forged(plan, 2, cell_vox=(x, y, z + 1)))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"ifc_class": "IfcSlab"}, "is not a wall, but a slab"),
        ({"erected": True}, "is upended, so it lies"),
        ({"start_vox": (40, 10, 1)}, "has a place of its own in the site file"),
    ],
)
def test_what_may_not_stand_in_a_rack_is_refused(plan, change, said):
    components = list(plan.site.components)
    components[1] = dataclasses.replace(components[1], **change)
    assert said in failures(with_site(plan, components=tuple(components)))


def test_a_frame_in_something_or_outside_the_yard_is_refused(plan):
    last = plan.lifts[2].place
    side, (x, y, _) = np.sign(last.rack), last.cell_vox
    cell = (x, y + 1, 1) if side > 0 else (x, y - 1, 1)
    post = Blocker("post", "structure", np.array([cell], np.int32))
    assert "its frame stands in post" in failures(with_site(plan, blockers=(*plan.site.blockers, post)))
    yard = plan.site.yard.copy()
    yard[cell[0], cell[1]] = False
    assert "its frame stands outside the yard" in failures(with_site(plan, yard=yard))


def with_site(plan: LiftPlan, **changes) -> LiftPlan:
    return dataclasses.replace(plan, site=dataclasses.replace(plan.site, **changes))


RACK_SIZES = st.tuples(st.sampled_from((2.0, 4.0, 6.0)), st.sampled_from((0.2, 0.4)), st.sampled_from((1.0, 2.0, 3.5)))


@given(
    sizes=st.lists(RACK_SIZES, min_size=1, max_size=6),
    gap_m=st.sampled_from((0.0, 0.6)),
    yard=st.sampled_from((YARD, ((24.0, 0.0), (40.0, 12.0)), ((24.0, 0.0), (34.0, 40.0)))),
)
def test_every_plan_passes_the_proofs_own_check_of_racks(sizes, gap_m, yard):
    plan = planned(wall_site(sizes, YardRules(rack_parts=3, gap_m=gap_m), crane=False, yard=yard))
    checks = {check.name: check for check in verify_plan(plan).checks}
    for name in ("gap", "racks", "stacks", "yard"):
        assert checks[name].passed, checks[name].failures
