"""The lift of a part that two cranes carry: its place, its path, its shares, and why there is none."""

from dataclasses import replace

import numpy as np
import pytest
from tandem_sites import BEAM, crane_at, tandem_site

from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.records.lift import Status
from bimvox.site.default_rules import TandemRules, YardRules
from bimvox.site.site import HeadingRule
from bimvox.site.tandem import halves


def lift_of(site):
    (lift,) = plan_lifts(site, prepare(site)).lifts
    return lift


def test_its_shares_are_those_of_its_whole_way():
    site = tandem_site()
    lift, (beam,) = lift_of(site), site.components
    shared = lift.tandem
    assert shared.cranes == (0, 1) and shared.points_m == beam.tandem.points_m
    assert shared.load_kg == pytest.approx((12_000.0, 12_000.0))
    assert shared.most_kg == pytest.approx([half.mass_kg for half in halves(site, beam)])
    assert shared.used == pytest.approx([(kg + 500.0) / 20_000.0 for kg in shared.most_kg])
    far_m = []
    for crane, half in zip(site.cranes, halves(site, beam), strict=True):
        at = lift.path_vox[:, :2] + np.array(half.hook_line_vox[:2]) + 0.5
        far_m.append(np.hypot(*(0.5 * at - np.array(crane.base_m[:2])).T).max())
    assert shared.radius_m == pytest.approx(far_m)


def test_it_lies_as_it_is_set_and_alone():
    lift = lift_of(tandem_site(yard=YardRules()))
    assert (lift.place.turn, lift.place.stack, lift.place.rack, lift.place.is_upended) == (0, 0, 0, False)


def test_it_keeps_its_heading():
    assert not lift_of(tandem_site(heading=HeadingRule.WITH_JIB)).with_jib


def test_a_part_that_one_crane_carries_has_no_shares():
    lift = lift_of(tandem_site(parts=(("small", (3.0, 18.0, 0.0), (5.0, 19.0, 1.0)),)))
    assert lift.status is Status.PLANNED and lift.tandem is None


def test_two_cranes_that_are_too_weak_together():
    lift = lift_of(tandem_site(rules=TandemRules(most_share=0.6)))
    assert lift.status is Status.INFEASIBLE
    assert lift.reason == (
        "two cranes hold it, and west would carry 12.6 t at its place, with rigging and hook block: 63 % of its load "
        "chart at 15.5 m; [rules.tandem] most_share permits 60 %"
    )


def test_a_place_that_one_of_them_does_not_reach():
    site = tandem_site()
    short = replace(site.cranes[1], jib_length_m=12.0)
    lift = lift_of(replace(site, cranes=(site.cranes[0], short)))
    assert lift.reason == (
        "its place is at a radius of 15.5 m, but the hook of east reaches from 2.0 to 12.0 m; two cranes hold it"
    )


def test_a_yard_that_both_do_not_reach():
    site = tandem_site()
    yard = np.zeros_like(site.yard)
    yard[0:10, 40:48] = True
    lift = lift_of(replace(site, yard=yard))
    assert "the yard has no free place for it" in lift.reason
    assert "both of its cranes must hold it there with 75 % of their load charts" in lift.reason


def test_a_mast_in_the_way_of_a_rope_is_avoided():
    """Each rope keeps clear of what is higher than the load, although the middle of the load could pass."""
    pole = ("pole", (8.0, 14.5, 0.0), (8.5, 15.0, 12.0))
    site = tandem_site(parts=(BEAM,), west=crane_at("west", 7.0))
    cells = np.argwhere(np.ones((1, 1, 24), bool)) + np.array([16, 29, 1])
    blocker = replace(site.blockers[0], id=pole[0], kind="obstruction", cells=cells.astype(np.int32))
    lift = lift_of(replace(site, blockers=(*site.blockers, blocker)))
    assert lift.status is Status.PLANNED
    first, _ = halves(site, site.components[0])
    hooks = lift.path_vox[:, :2] + np.array(first.hook_offset_vox[:2])
    assert not (hooks == [16, 29]).all(axis=1).any()
