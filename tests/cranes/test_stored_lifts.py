"""What was made of several cranes' lifts is not made again for the next plan."""

import dataclasses

import numpy as np
import pytest
from two_cranes import two_crane_site

from bimvox.cranes.legs import LegMaker
from bimvox.cranes.lifts import crane_lifts
from bimvox.motion.time_plan import MotionMaking
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.site.build import with_digests
from bimvox.walk import Store

BRIDGE = "west bridge"


def given_to(site, crane):
    """Return the site with the bridge, which both cranes carry from its place in the yard, lifted by a crane."""
    parts = tuple(
        dataclasses.replace(one, start_vox=(36, 13, 1), crane=crane) if one.id == BRIDGE else one
        for one in site.components
    )
    return with_digests(dataclasses.replace(site, components=parts))


@pytest.fixture
def made(monkeypatch):
    """Return the orders of the lifts of which motions and legs are made."""
    motions, legs = [], []
    time_one, make = MotionMaking.step, LegMaker.made
    monkeypatch.setattr(MotionMaking, "step", lambda self, *at: motions.append(at[1].order) or time_one(self, *at))
    monkeypatch.setattr(LegMaker, "made", lambda self, *how: legs.append(self.lift.order) or make(self, *how))
    return motions, legs


def axes_of(lifts):
    legs = [
        (one.early, one.late, *one.leaves, *(leg for way in one.parkings for leg in (way.aside, way.back)))
        for one in lifts
    ]
    return [[None if leg is None else leg.trajectory.axes for leg in own] for own in legs]


def are_alike(lifts, others):
    return all(
        len(own) == len(its) and all(a is b or np.array_equal(a, b) for a, b in zip(own, its, strict=True))
        for own, its in zip(axes_of(lifts), axes_of(others), strict=True)
    )


def test_another_plan_with_the_same_lifts_needs_nothing_new(made):
    site, store = given_to(two_crane_site(), 0), Store()
    preparation = prepare(site)
    lifts = crane_lifts(plan_lifts(site, preparation), preparation, store)
    assert [len(one) for one in made] == [7, 7]
    again = crane_lifts(plan_lifts(site, preparation), preparation, store)
    assert [len(one) for one in made] == [7, 7]
    assert are_alike(lifts, again)


def test_if_another_crane_lifts_a_part_only_legs_that_depend_on_it_are_made(made):
    site, store = given_to(two_crane_site(), 0), Store()
    preparation = prepare(site)
    crane_lifts(plan_lifts(site, preparation), preparation, store)
    for orders in made:
        orders.clear()
    other = given_to(site, 1)
    plan = plan_lifts(other, preparation)
    lifts = crane_lifts(plan, preparation, store)
    (bridge,) = (one.order for one in plan.lifts if other.components[one.component].id == BRIDGE)
    motions, legs = (list(orders) for orders in made)
    assert motions == [bridge]
    assert bridge in legs
    assert len(legs) < 7
    assert are_alike(lifts, crane_lifts(plan, preparation))


def test_legs_are_made_anew_if_a_part_is_not_set(made):
    site, store = given_to(two_crane_site(), 0), Store()
    preparation = prepare(site)
    crane_lifts(plan_lifts(site, preparation), preparation, store)
    for orders in made:
        orders.clear()
    plan = plan_lifts(site, preparation, refused={BRIDGE: "refused"})
    lifts = crane_lifts(plan, preparation, store)
    assert sorted(made[1]) == sorted(one.lift.order for one in lifts)
    assert are_alike(lifts, crane_lifts(plan, preparation))
