"""The choice of a machine: the cheapest that serves, at a good place, why smaller ones do not, what none can set."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely
from box_buildings import box_element

from bimvox.bim.building import Role
from bimvox.crane.load_chart import capacity_kg
from bimvox.crane.outline import mast_box_m
from bimvox.crane.reach import MARGIN_M, MAST_CLEARANCE_M, allowed_radii_m
from bimvox.site.catalogue import catalogue, machine_called, machines_of
from bimvox.site.config.site_config import AreasConfig, ModelConfig, RulesConfig, SiteConfig, ZoneConfig
from bimvox.site.crane_guess import ROOMY, Wanted, best_set_up, compare_cranes, fit_here
from bimvox.site.set_ups import ground_plan

HALL = shapely.box(0.0, 0.0, 20.0, 12.0)
YARD = (((0.0, -14.0), (10.0, -14.0), (10.0, -4.0), (0.0, -4.0)),)
HAMMERHEADS = machines_of("hammerhead")


def parts(*masses_kg):
    return [
        box_element(f"p{n}", (3.0 * n, 2.0, 0.0), (3.0 * n + 2.0, 4.0, 3.0), mass_kg=mass)
        for n, mass in enumerate(masses_kg)
    ]


def wanted(components, *, yards=YARD, top_m=10.0, building=HALL, most_used=1.0, zones=(), plot=None):
    config = SiteConfig(
        model=ModelConfig(path="a.ifc"),
        areas=AreasConfig(yard=yards or None, plot=plot),
        rules=RulesConfig(highest_utilisation=most_used),
        zone=zones,
    )
    return Wanted(config, components, building, top_m, None)


def test_the_cheapest_machine_that_serves_stands_clear_of_building_and_yard():
    components = parts(1000.0, 1500.0)
    found = best_set_up(HAMMERHEADS, wanted(components))
    crane = found.crane
    assert (crane.name, found.rank[:2]) == ("flat-top-75", (-2, -2))
    assert best_set_up(HAMMERHEADS, wanted(components)).crane == crane
    heavier = best_set_up(HAMMERHEADS, wanted(parts(1000.0, 12_000.0)))
    assert heavier.rank[2] > found.rank[2]
    assert machine_called(heavier.crane.name).load_moment_tm > machine_called("flat-top-75").load_moment_tm
    (x0, y0, _), (x1, y1, _) = mast_box_m(crane)
    mast = shapely.box(x0, y0, x1, y1)
    for area in (HALL, shapely.Polygon(YARD[0])):
        assert mast.distance(area) >= MAST_CLEARANCE_M - 0.5  # at its corners
    for component in components:
        low, high = allowed_radii_m(crane, component.mass_kg)
        x, y = component.mesh.bounds_m.mean(axis=0)[:2]
        assert low + MARGIN_M <= np.hypot(x - crane.base_m[0], y - crane.base_m[1]) <= high - MARGIN_M


def test_the_place_takes_no_longer_than_any_other_of_a_lattice_by_more_than_a_hundredth():
    site = wanted(parts(1000.0, 3500.0, 2000.0))
    crane = best_set_up(HAMMERHEADS, site).crane
    (own,), _ = site.estimated(crane, np.array([crane.base_m[:2]]), MARGIN_M)
    places = site.places.bases_m(crane, 100)
    fit = [fit_here(site, replace(crane, base_m=(*base, 0.0))) for base in places.tolist()]
    assert own <= 1.01 * 3600.0 * min(one.hours for one in fit if not one.reason)


def test_half_of_the_yard_is_within_reach_with_every_part_if_any_machine_can():
    components = parts(4000.0, 6000.0)
    site = wanted(components)
    crane = best_set_up(HAMMERHEADS, site).crane
    for number in range(len(components)):
        assert site.demand.picks(number, crane, site.yard_m).mean() >= ROOMY - 0.1
    assert fit_here(site, crane).reason == ""


def test_every_smaller_machine_has_a_reason_with_figures():
    lifted = parts(1000.0, 1500.0, 8000.0)
    site = wanted(lifted)
    crane = best_set_up(HAMMERHEADS, site).crane
    rows = {row.machine: row for row in compare_cranes(site, HAMMERHEADS)}
    smaller = [row for row in rows.values() if row.load_moment_tm < machine_called(crane.name).load_moment_tm]
    assert smaller
    for row in smaller:
        assert "p2 weighs 8.0 t" in row.reason
        assert "carries" in row.reason
    own = rows[crane.name]
    assert own.serves and own.reason == "" and own.unserved == ()
    assert own.crane == crane
    radii = [float(np.hypot(*(np.array([3.0 * n + 1.0, 3.0]) - crane.base_m[:2]))) for n in range(3)]
    used = [
        (part.mass_kg + crane.tackle_kg) / capacity_kg(crane.chart, radius)
        for part, radius in zip(lifted, radii, strict=True)
    ]
    assert own.utilisation == pytest.approx(max(used), rel=1e-6)
    assert own.radius_m == pytest.approx(max(radii), rel=1e-6)
    assert own.hours > own.moving_hours > 0.0
    assert own.cost == pytest.approx(site.rates(machine_called(crane.name)).total(own.hours))


def test_if_none_serves_the_one_that_sets_most_is_taken_and_the_others_are_named():
    site = wanted(parts(1000.0, 90_000.0, 1500.0))
    found = best_set_up(HAMMERHEADS, site)
    assert (found.crane.name, found.rank[0]) == ("flat-top-75", -2)
    fit = fit_here(site, found.crane)
    (part,) = fit.unserved
    assert (part.component, part.mass_kg) == ("p1", 90_000.0)
    assert not fit.serves
    assert fit.reason.endswith("p1 weighs 90.0 t")


def test_a_part_out_of_reach_says_so():
    far = [*parts(1000.0), box_element("far", (200.0, 2.0, 0.0), (202.0, 4.0, 3.0), mass_kg=500.0)]
    site = wanted(far, building=shapely.box(0.0, 0.0, 202.0, 12.0))
    found = best_set_up(HAMMERHEADS, site)
    assert found.rank[0] == -1
    (part,) = fit_here(site, found.crane).unserved
    assert part.component == "far"
    assert part.reason.startswith(f"reaches {found.crane.jib_length_m:.1f} m of the ")


def test_a_part_that_the_yard_cannot_hand_over_says_so():
    lifted = parts(4000.0)
    crane = replace(machine_called("flat-top-75").usual, base_m=(-5.0, 13.0, 0.0), jib_height_m=20.0)
    near = fit_here(wanted(lifted), crane)
    assert near.unserved[0].reason.endswith("in the yard")
    assert "p0 weighs 4.0 t" in near.reason
    assert fit_here(wanted(lifted, yards=()), crane).serves


def test_a_part_that_can_be_picked_in_a_corner_of_the_yard_alone_says_so():
    lifted = parts(4000.0)
    crane = replace(machine_called("flat-top-75").usual, base_m=(-5.0, 8.0, 0.0), jib_height_m=20.0)
    fit = fit_here(wanted(lifted), crane)
    assert fit.serves
    assert "in half of the yard; p0 weighs 4.0 t" in fit.reason


def test_a_part_whose_place_is_under_a_closed_zone_says_so():
    zone = ZoneConfig(kind="no_load", polygon=((-1.0, 0.0), (2.9, 0.0), (2.9, 6.0), (-1.0, 6.0)))
    site = wanted(parts(500.0, 500.0), zones=(zone,))
    crane = best_set_up(HAMMERHEADS, site).crane
    (part,) = fit_here(site, crane).unserved
    assert (part.component, part.reason) == ("p0", "may not hang over a zone, where its place is")


def test_only_the_permitted_share_of_the_chart_counts():
    lifted = parts(1000.0, 3500.0)
    free = best_set_up(HAMMERHEADS, wanted(lifted)).crane
    site = wanted(lifted, most_used=0.5)
    half = best_set_up(HAMMERHEADS, site)
    assert half.rank[0] == -2
    # The crane keeps its whole chart.
    assert half.crane.chart in [crane.chart for crane in machine_called(half.crane.name).cranes]
    fit = fit_here(site, half.crane)
    assert fit.serves
    assert 0.0 < fit.utilisation <= 0.5
    assert fit.utilisation == fit_here(wanted(lifted), half.crane).utilisation
    (row,) = compare_cranes(wanted(lifted, most_used=0.15), [machine_called(free.name)])
    assert "with 15 % of its chart" in row.reason


def test_a_low_boom_is_named_with_the_height():
    (row,) = compare_cranes(wanted(parts(500.0), top_m=60.0), (machine_called("mobile-60t"),))
    assert not row.serves
    assert "its hook reaches" in row.reason


def test_a_mobile_crane_stands_where_its_boom_is_over_every_place():
    """A stair tower at one end of the building blocks the boom from places beyond it."""
    tower = box_element("tower", (0.0, 0.0, 0.0), (3.0, 8.0, 16.0), mass_kg=1000.0)
    low = [
        box_element(f"p{n}", (3.0 + n, 0.0, 0.0), (4.0 + n, 8.0, 3.0), mass_kg=1000.0, role=Role.COMPONENT)
        for n in range(12)
    ]
    site = wanted([tower, *low], building=ground_plan([tower, *low]), top_m=16.5)
    crane = best_set_up(machines_of("mobile"), site).crane
    assert crane.base_m[0] > 3.0


def test_no_jib_sweeps_over_more_than_the_plot():
    plot = ((-40.0, -45.0), (60.0, -45.0), (60.0, 35.0), (-40.0, 35.0))
    components = parts(1000.0, 8000.0)
    crane = best_set_up(HAMMERHEADS, wanted(components, plot=plot)).crane
    x, y, _ = crane.base_m
    assert shapely.Polygon(plot).covers(shapely.Point(x, y).buffer(crane.jib_length_m))
    narrow = tuple((0.5 * x, 0.5 * y) for x, y in plot)
    site = wanted(components, plot=narrow)
    chosen = best_set_up(HAMMERHEADS, site)
    assert chosen is None or chosen.crane.jib_length_m <= 20.0
    (row,) = compare_cranes(site, [machine_called("flat-top-75")])
    assert "within the plot" in row.reason


def test_no_place_for_the_mast():
    everywhere = (((-200.0, -200.0), (200.0, -200.0), (200.0, 200.0), (-200.0, 200.0)),)
    ring = ZoneConfig(kind="prohibited", polygon=((-300.0, -300.0), (300.0, -300.0), (300.0, 300.0), (-300.0, 300.0)))
    site = wanted(parts(500.0), yards=everywhere, zones=(ring,))
    assert best_set_up(HAMMERHEADS, site) is None
    (row,) = compare_cranes(site, catalogue()[:1])
    assert (row.serves, row.crane) == (False, None)
    assert "no place" in row.reason
