"""A mast can stand in a court that is open over the whole height and wide enough, and does so where that pays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely
from bimvox_pipeline.cranes import choice_notes
from box_buildings import box_element
from box_sites import box_mesh

from bimvox.bim.building import Element, TriangleMesh
from bimvox.crane.outline import mast_box_m
from bimvox.site.areas import PLAN, hull, shadow
from bimvox.site.catalogue import machine_called, machines_of
from bimvox.site.config.site_config import AreasConfig, ModelConfig, SiteConfig
from bimvox.site.crane_guess import Wanted, best_set_up, fit_here
from bimvox.site.set_ups import MastPlaces, ground_plan

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
