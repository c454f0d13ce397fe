"""Walls stand in racks, the one that is lifted first outermost; the proof refuses forged racks by its own words."""

import dataclasses

import numpy as np
import pytest
from box_sites import box_site
from box_sites import test_crane as crane_of
from hypothesis import given
from hypothesis import strategies as st

from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.proof.plan import verify_plan
from bimvox.records.lift import LiftPlan, Status
from bimvox.remarks.remarks import remarks_of
from bimvox.site.component import StoredPose
from bimvox.site.default_rules import YardRules
from bimvox.site.site import Blocker, Rules, Site

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


def planned(site: Site) -> LiftPlan:
    return plan_lifts(site, prepare(site))


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


SIZES = st.tuples(st.sampled_from((2.0, 4.0, 6.0)), st.sampled_from((0.2, 0.4)), st.sampled_from((1.0, 2.0, 3.5)))


@given(
    sizes=st.lists(SIZES, min_size=1, max_size=6),
    gap_m=st.sampled_from((0.0, 0.6)),
    yard=st.sampled_from((YARD, ((24.0, 0.0), (40.0, 12.0)), ((24.0, 0.0), (34.0, 40.0)))),
)
def test_every_plan_passes_the_proofs_own_check_of_racks(sizes, gap_m, yard):
    plan = planned(wall_site(sizes, YardRules(rack_parts=3, gap_m=gap_m), crane=False, yard=yard))
    checks = {check.name: check for check in verify_plan(plan).checks}
    for name in ("gap", "racks", "stacks", "yard"):
        assert checks[name].passed, checks[name].failures
