"""The set-ups of a mobile crane, and the places for parts beside them."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
import shapely
from box_buildings import box_element

from bimvox.crane.load_chart import capacity_kg
from bimvox.crane.reach import MARGIN_M, allowed_radii_m
from bimvox.site.catalogue import machine_called
from bimvox.site.config.site_config import AreasConfig, ModelConfig, RulesConfig, SiteConfig
from bimvox.site.crane_guess import Wanted
from bimvox.site.moving_guess import MovingCrane, best_moving, each_moving, fit_of_moving
from bimvox.site.set_ups import ground_plan

MACHINE = machine_called("mobile-60t")


def row(count: int, mass_kg: float):
    """Return heavy panels along a line of 12 m each."""
    return [
        box_element(f"p{n}", (12.0 * n, 0.0, 0.0), (12.0 * n + 10.0, 0.2, 3.0), mass_kg=mass_kg, ifc_class="IfcWall")
        for n in range(count)
    ]


def asked(lifted, others=(), yard=None, share: float | None = 0.85, standing=None):
    """Return what a crane is chosen for, in the order of the arguments of ``best_moving``."""
    config = SiteConfig(
        model=ModelConfig(path="a.ifc"),
        areas=AreasConfig(yard=yard),
        rules=RulesConfig(highest_utilisation=share),
    )
    plan = ground_plan([*lifted, *others])
    stands = ground_plan(others if standing is None else standing)
    return Wanted(config, lifted, plan, 10.0, None), lifted, others, (plan, stands)


def moving(lifted, others=(), yard=None, share: float | None = 0.85, standing=None) -> MovingCrane | None:
    return best_moving([MACHINE], *asked(lifted, others, yard, share, standing), 0.5)


def test_one_place_is_enough_for_what_it_reaches() -> None:
    found = moving(row(2, 1000.0))
    assert found is not None
    assert (found.served, len(found.cranes), len(found.yard)) == (2, 1, 1)


def test_a_long_row_of_heavy_panels_takes_several_places_each_with_its_yard() -> None:
    lifted = row(8, 6000.0)
    found = moving(lifted)
    assert found is not None
    assert found.served == 8
    assert 2 <= len(found.cranes) <= 4
    assert sorted(itertools.chain(*found.parts)) == list(range(8))
    plan, yards = ground_plan(lifted), [shapely.Polygon(one) for one in found.yard]
    for crane, own, yard in zip(found.cranes, found.parts, yards, strict=True):
        at = shapely.Point(crane.base_m[:2])
        assert plan.distance(at) > crane.mast_size_m / 2.0
        for other in yards:
            assert other.distance(at) > crane.mast_size_m / 2.0
        for part in own:
            _, far_m = allowed_radii_m(crane, lifted[part].mass_kg / 0.85 + crane.tackle_kg * (1.0 / 0.85 - 1.0))
            x, y = lifted[part].mesh.bounds_m.mean(axis=0)[:2]
            assert np.hypot(x - crane.base_m[0], y - crane.base_m[1]) <= far_m + MARGIN_M
            assert yard.distance(at) <= far_m
    for one, other in itertools.combinations(yards, 2):
        assert not one.intersects(other)
        assert not plan.intersects(one)


def test_a_fewer_set_of_places_would_not_do() -> None:
    found = moving(row(8, 6000.0))
    assert found is not None
    reach_m = max(allowed_radii_m(found.cranes[0], 6000.0))
    assert 2.0 * reach_m < 94.0 - 10.0  # hook over the first and over the last panel


def test_what_is_cast_on_the_ground_keeps_the_crane_away() -> None:
    lifted = row(3, 1000.0)
    block = box_element("cast", (-40.0, -40.0, 0.0), (80.0, -4.0, 3.0), mass_kg=1e6)
    found = moving(lifted, [block])
    assert found is not None
    assert all(crane.base_m[1] > 0.2 for crane in found.cranes)


def test_it_stands_on_a_slab_on_the_ground_within_the_building() -> None:
    lifted = row(3, 1000.0)
    slab = box_element("slab", (-60.0, -60.0, 0.1), (100.0, 25.0, 0.32), mass_kg=1e6)
    yard = (((-4.0, -20.0), (40.0, -20.0), (40.0, -12.0), (-4.0, -12.0)),)
    found = moving(lifted, [slab], yard, standing=[])
    assert found is not None
    assert found.served == 3
    assert {crane.base_m[2] for crane in found.cranes} == {0.32}


def test_a_given_yard_stays() -> None:
    yard = (((-4.0, -20.0), (4.0, -20.0), (4.0, -12.0), (-4.0, -12.0)),)
    found = moving(row(4, 1000.0), yard=yard)
    assert found is not None
    assert found.yard == yard
    for crane in found.cranes:
        assert shapely.Polygon(yard[0]).distance(shapely.Point(crane.base_m[:2])) < 40.0


@pytest.mark.parametrize("mass_kg", [90_000.0])
def test_what_no_place_serves_is_left_out(mass_kg: float) -> None:
    assert moving(row(1, mass_kg)) is None
    found = moving([*row(1, 1000.0), box_element("q", (30.0, 0.0, 0.0), (40.0, 0.2, 3.0), mass_kg=mass_kg)])
    assert found is not None
    assert found.parts == ((0,),)


def test_the_whole_charts_count_if_they_set_more() -> None:
    found = []
    for radius_m in (8.0, 9.0, 10.0):  # about where it lies beside the crane: 92 % of what a boom carries there
        most_kg = max(float(capacity_kg(one.chart, radius_m)) for one in MACHINE.cranes)
        mass_kg = 0.92 * most_kg - MACHINE.usual.tackle_kg
        lifted = [*row(1, 1000.0), box_element("heavy", (30.0, 0.0, 0.0), (40.0, 0.2, 3.0), mass_kg=mass_kg)]
        found.append([one.served for share in (0.85, None) if (one := moving(lifted, share=share)) is not None])
    assert [1, 2] in found


def test_each_machine_has_its_own_set_ups() -> None:
    machines = [MACHINE, machine_called("hammerhead-45"), machine_called("mobile-220t")]
    found = list(each_moving(machines, *asked(row(8, 6000.0)), 0.5))
    assert [one.machine.name for one in found] == ["mobile-60t", "mobile-220t"]
    assert len(found[0].cranes) > len(found[1].cranes)
    for one in found:
        assert one.lifts_s > 0.0
        assert (one.moves_s > 0.0) == (len(one.cranes) > 1)


def test_what_is_near_given_set_ups_is_in_the_way_only_if_it_is_where_the_crane_stands() -> None:
    lifted = row(1, 1000.0)
    yard = (((-2.0, -22.0), (12.0, -22.0), (12.0, -12.0), (-2.0, -12.0)),)
    wanted, *more = asked(lifted, yard=yard)
    near, on_it = (replace(MACHINE.usual, base_m=(5.0, y_m, 0.0)) for y_m in (-5.5, 0.1))
    assert not fit_of_moving([near], wanted, *more).unserved
    assert len(fit_of_moving([on_it], wanted, *more).unserved) == 1
