"""A part that no crane lifts alone: which two could, with the share of each by statics."""

from dataclasses import replace
from math import radians, tan

import pytest
from box_sites import box_site, test_crane

from bimvox.crane.load_chart import LoadChart
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.records.lift import Status
from bimvox.remarks.remarks import remarks_of
from bimvox.site.tandem import pairs_for

BEAM = ("beam", (2.0, 5.0, 0.0), (12.0, 6.0, 1.0))  # 24 t, 10 m long


def site_of(most_kg=20_000.0, west_kg=None, parts=(BEAM,)):
    def crane(name, base, kg):
        one = replace(test_crane(base=base), name=name, hook_block_kg=200.0)
        return replace(one, chart=LoadChart((2.0, 20.0), (kg, kg)), jib_length_m=20.0)

    site = box_site(parts, crane=crane("west", (2.0, 12.0, 0.0), west_kg or most_kg))
    return replace(site, cranes=(*site.cranes, crane("east", (14.0, 12.0, 0.0), most_kg)))


def said(site):
    plan = plan_lifts(site, prepare(site))
    assert plan.lifts[0].status is Status.INFEASIBLE
    return [one.text for one in remarks_of(plan, ()) if "no crane lifts it alone" in one.text]


def test_each_carries_half_of_an_even_beam_at_a_fifth_from_its_ends():
    found = pairs_for(site_of(), site_of().components[0])[0]
    assert found.cranes == (0, 1)
    assert found.load_kg == pytest.approx((12_000.0, 12_000.0))
    more_kg = 24_000.0 * 0.5 * tan(radians(3.0)) / 6.0  # out of level by 3 degrees, half a metre below its points
    assert found.used == pytest.approx(((12_700.0 + more_kg) / 20_000.0,) * 2)
    assert found.apart_m == pytest.approx(6.0)
    assert found.radius_m == pytest.approx((6.8007, 7.6322), abs=1e-3)  # hooks at x = 4 and 10


def test_the_heavier_end_is_on_one_crane():
    """Of a wedge, the centre is nearer to the high end; the ropes are at 2 and 8 m of its 10 m."""
    site = site_of()
    part = site.components[0]
    mesh = part.mesh
    moved = replace(part, mesh=type(mesh)(mesh.vertices_m.copy(), mesh.faces))
    vertices = moved.mesh.vertices_m.copy()
    vertices[vertices[:, 0] > 11.0, 2] *= 0.25  # a wedge: 1 m high on the one end, 0.25 m on the other
    wedge = replace(part, mesh=type(mesh)(vertices, mesh.faces))
    found = pairs_for(site, wedge)[0]
    centre_m = 10.0 * (1.0 + 2.0 * 0.25) / (3.0 * 1.25)  # of a trapezium, from the high end
    assert found.load_kg[0] == pytest.approx(24_000.0 * (8.0 - centre_m) / 6.0, rel=1e-6)
    assert sum(found.load_kg) == pytest.approx(24_000.0)


def test_it_is_proposed_with_both_utilisations():
    (text,) = said(site_of())
    assert text == (
        "no crane lifts it alone; west and east together would carry 12.0 t and 12.0 t at its place, 64 and 64 % of "
        "their load charts, with their hooks 6.0 m apart: [rules.tandem] in the site file plans such lifts"
    )


def test_it_is_said_if_two_are_too_weak_as_well():
    (text,) = said(site_of(west_kg=15_000.0))
    assert "more than the 75 % that a lift with two cranes uses at most" in text


def test_nothing_is_proposed_for_one_crane_or_out_of_reach():
    site = site_of()
    assert said(replace(site, cranes=site.cranes[:1])) == []
    far = tuple(replace(crane, base_m=(2.0, 60.0, 0.0)) for crane in site.cranes)
    assert pairs_for(replace(site, cranes=far), site.components[0]) == []
