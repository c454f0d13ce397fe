"""Many places of a crane at once agree with one place at a time, with the load chart, and with plans."""

from __future__ import annotations

import dataclasses
from dataclasses import replace

import numpy as np
import pytest
import shapely
from bimvox_pipeline.cranes import choice_notes
from box_buildings import box_element
from box_sites import box_mesh
from box_sites import test_crane as crane_of
from hypothesis import given
from hypothesis import strategies as st
from lift_work import work_of

from bimvox.bim.building import Element, TriangleMesh
from bimvox.crane.load_chart import utilisation
from bimvox.crane.outline import mast_box_m
from bimvox.crane.reach import allowed_radii_m
from bimvox.site.areas import PLAN, hull, shadow
from bimvox.site.catalogue import machine_called, machines_of
from bimvox.site.config.site_config import AreasConfig, ModelConfig, SiteConfig
from bimvox.site.crane_distances import base_of
from bimvox.site.crane_guess import Wanted, best_set_up, fit_here
from bimvox.site.set_ups import MastPlaces, carried, ground_plan, highest_utilisation, set_ups

CRANE = crane_of(base=(0.0, 0.0, 0.0), jib=40.0, height=30.0)

points = st.tuples(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0))


@given(
    st.lists(st.tuples(points, st.floats(100.0, 6000.0)), min_size=1, max_size=6),
    st.lists(points, min_size=1, max_size=5),
    st.lists(points, min_size=1, max_size=4),
)
def test_a_part_is_served_if_the_chart_permits_it_at_its_place_and_somewhere_in_the_yard(parts, yard, bases):
    places, masses = zip(*parts, strict=True)
    found = set_ups(CRANE, np.array(bases), work_of(places, masses, yard), 20.0)
    for row, base in enumerate(bases):
        for n, (place, mass) in enumerate(parts):
            low, high = allowed_radii_m(CRANE, mass)

            def carried(at, base=base, low=low, high=high):
                return low <= np.hypot(at[0] - base[0], at[1] - base[1]) <= high

            assert bool(found.served[row, n]) == (carried(place) and any(map(carried, yard)))
        assert found.crane_s[row] >= 600.0 * found.served[row].sum() - 1e-6


def test_several_bases_at_once_are_each_base_by_itself(monkeypatch):
    bases = np.array([[0.0, 0.0], [10.0, 5.0], [-8.0, 3.0], [20.0, -20.0]])
    work = work_of([(5.0, 20.0), (12.0, 18.0), (-10.0, 9.0)], [900.0, 2000.0, 300.0], [(15.0, 0.0), (18.0, 3.0)])
    together = set_ups(CRANE, bases, work, 20.0)
    monkeypatch.setattr("bimvox.site.set_ups._AT_ONCE", 1)
    apart = set_ups(CRANE, bases, work, 20.0)
    for name in ("served", "crane_s", "used"):
        assert np.allclose(getattr(together, name), getattr(apart, name), rtol=1e-3)


def test_a_yard_further_away_takes_longer_and_a_closed_place_is_not_served():
    base, places = np.array([[0.0, 0.0]]), [(0.0, 15.0), (3.0, 15.0)]
    near = set_ups(CRANE, base, work_of(places, [500.0, 500.0], [(6.0, 14.0)]), 20.0)
    far = set_ups(CRANE, base, work_of(places, [500.0, 500.0], [(0.0, -30.0)]), 20.0)
    assert near.served.all()
    assert far.served.all()
    assert far.crane_s[0] > near.crane_s[0] + 30.0
    closed = set_ups(CRANE, base, work_of(places, [500.0, 500.0], [(6.0, 14.0)], [True, False]), 20.0)
    assert closed.served.tolist() == [[False, True]]
    assert set_ups(CRANE, np.zeros((0, 2)), work_of(places, [1.0, 1.0], [(1.0, 1.0)]), 20.0).served.shape == (0, 2)


def test_a_slower_crane_takes_longer():
    base, work = np.array([[0.0, 0.0]]), work_of([(0.0, 15.0), (15.0, 0.0)], [500.0, 500.0], [(-12.0, -12.0)])
    slow = dataclasses.replace(CRANE, slewing=dataclasses.replace(CRANE.slewing, rate=CRANE.slewing.rate / 4.0))
    times = [set_ups(one, base, work, 20.0).crane_s[0] for one in (CRANE, slow)]
    assert times[1] > times[0]
    assert times[0] == pytest.approx(1200.0, abs=600.0)


def test_the_highest_utilisation_is_that_of_the_heaviest_use_of_the_chart_at_a_place_or_in_the_yard():
    bases, work = np.array([[0.0, 0.0], [0.0, 8.0]]), work_of([(0.0, 20.0), (0.0, 9.0)], [900.0, 1500.0], [(14.0, 0.0)])
    served = set_ups(CRANE, bases, work, 20.0).served
    found = highest_utilisation(CRANE, bases, work, served)
    for row, base in enumerate(bases):
        worst = [max(np.hypot(*(place - base)), np.hypot(*(work.yard_m[0] - base))) for place in work.places_m]
        uses = [utilisation(CRANE.chart, r, kg + CRANE.tackle_kg) for r, kg in zip(worst, work.masses_kg, strict=True)]
        assert found[row] == pytest.approx(max(uses[n] for n in np.flatnonzero(served[row])))
    assert highest_utilisation(CRANE, bases, work, np.zeros_like(served)).tolist() == [0.0, 0.0]


def test_a_part_that_lies_within_the_yard_only_beyond_the_radius_is_not_served_and_turned_it_may_be():
    # The yard is 12 m deep from 16 m on: the hook of a wall of 14 m along y is 7 m inside of it, turned 0.5 m.
    as_built, turned = shapely.box(-7.5, 23.0, 7.5, 25.0), shapely.box(-1.0, 16.5, 1.0, 27.5)
    assert 17.0 < allowed_radii_m(CRANE, 19_000.0)[1] < 23.0
    base, edge = np.zeros((1, 2)), [(0.0, 16.5), (0.0, 27.0)]
    work = work_of([(5.0, 5.0)] * 4, [19_000.0] * 3 + [500.0], edge)
    nowhere = shapely.Polygon()  # larger than the yard
    rooms = np.array([[as_built, as_built], [as_built, turned], [nowhere, nowhere], [as_built, as_built]])
    assert set_ups(CRANE, base, work, 20.0).served.all()
    inside = dataclasses.replace(work, rooms=rooms)
    assert set_ups(CRANE, base, inside, 20.0).served.tolist() == [[False, True, True, True]]
    able, share = carried(CRANE, base, inside, 20.0, 0.0)
    assert able.all()
    assert (share[0] > 0.0).tolist() == [False, True, True, True]
    assert inside.sample(2, 1).rooms.tolist() == rooms[::2].tolist()


YARD = (((0.0, -14.0), (10.0, -14.0), (10.0, -4.0), (0.0, -4.0)),)
CONFIG = SiteConfig(model=ModelConfig(path="a.ifc"), areas=AreasConfig(yard=YARD))
WIDE, NARROW = 10.0, 5.0


def ring(court_m: float, low_m: float = 0.0) -> Element:
    """Return a slab of 24 m by 24 m with a square opening in the middle."""
    a, b = 12.0 - court_m / 2.0, 12.0 + court_m / 2.0
    sides = [((0, 0), (24, a)), ((0, b), (24, 24)), ((0, a), (a, b)), ((b, a), (24, b))]
    mesh = TriangleMesh.joined([box_mesh((*one, low_m), (*other, low_m + 0.3)) for one, other in sides])
    return replace(box_element(f"slab-{low_m:g}", (0, 0, low_m), (24, 24, low_m + 0.3)), mesh=mesh, mass_kg=100.0)


def corners(mass_kg: float) -> list[Element]:
    places = [(1.0, 1.0), (22.0, 1.0), (1.0, 22.0), (22.0, 22.0)]
    return [
        box_element(f"p{n}", (x, y, 0.3), (x + 1.0, y + 1.0, 3.0), mass_kg=mass_kg) for n, (x, y) in enumerate(places)
    ]


def wanted(court_m: float, mass_kg: float = 9000.0, *more: Element) -> Wanted:
    lifted = corners(mass_kg)
    return Wanted(CONFIG, lifted, ground_plan([ring(court_m), *lifted, *more]), 4.0, None)


def in_court(bases_m: np.ndarray) -> np.ndarray:
    return bases_m[(np.abs(bases_m - 12.0) < 12.0).all(axis=1)]


def test_a_slab_leaves_its_opening_free_and_small_or_intricate_parts_are_their_hulls() -> None:
    slab, small = ring(WIDE), corners(1.0)[0]
    assert shadow(slab.mesh).area == pytest.approx(24.0**2 - WIDE**2)
    assert hull(slab.mesh, PLAN).area == pytest.approx(24.0**2)
    assert shadow(small.mesh).equals(hull(small.mesh, PLAN))
    intricate = TriangleMesh(slab.mesh.vertices_m, np.tile(slab.mesh.faces, (120, 1)))
    assert shadow(intricate).area == pytest.approx(24.0**2)


def test_masts_stand_in_a_wide_court_with_room_around_them_and_mobile_cranes_do_not() -> None:
    crane = machine_called("hammerhead-45").usual
    found = in_court(MastPlaces(CONFIG, ground_plan([ring(WIDE)])).bases_m(crane, 2000))
    assert len(found)
    for base in found.tolist():
        (x0, y0, _), (x1, y1, _) = mast_box_m(replace(crane, base_m=(*base, 0.0)))
        assert min(x0, y0) >= 7.0 + 1.5
        assert max(x1, y1) <= 17.0 - 1.5
    assert not len(in_court(MastPlaces(CONFIG, ground_plan([ring(NARROW)])).bases_m(crane, 2000)))
    # A roof, or a part on any floor, closes the court.
    closed = ground_plan([ring(WIDE), box_element("roof", (6, 6, 9), (18, 18, 9.3))])
    assert not len(in_court(MastPlaces(CONFIG, closed).bases_m(crane, 2000)))
    mobile = machines_of("mobile")[0].usual
    places = MastPlaces(CONFIG, ground_plan([ring(WIDE)])).bases_m(mobile, 2000)
    assert len(places)
    assert not len(in_court(places))


def test_a_court_is_used_if_a_cheaper_machine_serves_from_it_and_the_site_file_says_so() -> None:
    machines = machines_of("hammerhead")
    open_court, closed = wanted(WIDE), wanted(NARROW)
    inside, outside = best_set_up(machines, open_court), best_set_up(machines, closed)
    assert len(in_court(np.array([inside.crane.base_m[:2]])))
    assert not len(in_court(np.array([outside.crane.base_m[:2]])))
    assert inside.rank[:2] == outside.rank[:2] == (-4, -4)
    assert inside.rank[2] < outside.rank[2]
    assert machine_called(inside.crane.name).load_moment_tm < machine_called(outside.crane.name).load_moment_tm
    for site, found, said in ((open_court, inside, True), (closed, outside, False)):
        notes = "\n".join(choice_notes(fit_here(site, found.crane), [], "EUR"))
        assert ("inside the outline of the building" in notes) is said


def test_outside_is_preferred_where_the_same_machine_serves_as_much() -> None:
    light = wanted(WIDE, 500.0)
    found = best_set_up(machines_of("hammerhead"), light)
    assert found.rank[0] == -4
    assert not light.places.inside(np.array([found.crane.base_m[:2]]))[0]
    assert light.places.inside(np.array([[12.0, 12.0]]))[0]
    assert shapely.Polygon(YARD[0]).distance(shapely.Point(found.crane.base_m[:2])) > 1.5


def test_the_foundation_of_a_tower_crane_fits_next_to_the_building() -> None:
    config = SiteConfig(model=ModelConfig(path="model.ifc"))
    building = shapely.box(0.0, 0.0, 20.0, 12.0)
    for mast_m in (1.2, 2.45):
        crane = replace(CRANE, mast_size_m=mast_m)
        bases_m = MastPlaces(config, building).bases_m(crane, 500)
        assert len(bases_m)
        nearest_m = float(shapely.distance(building, shapely.points(bases_m)).min())
        assert nearest_m >= base_of(crane).edge_m / 2.0 - 1e-9
