from math import sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from named_cranes import HAMMERHEADS

from bimvox.crane.load_chart import LoadChart, capacity_kg, max_radius_m, permitted_wind_m_s, utilisation, wind_force_n
from bimvox.errors import InputError


@st.composite
def charts(draw):
    steps = draw(st.lists(st.floats(0.5, 20.0), min_size=1, max_size=8))
    drops = draw(st.lists(st.floats(0.0, 3000.0), min_size=len(steps), max_size=len(steps)))
    radii = np.cumsum(steps)
    capacities = 500.0 + np.cumsum(drops)[::-1]
    return LoadChart(tuple(radii.tolist()), tuple(capacities.tolist()))


@given(charts(), st.lists(st.floats(0.0, 200.0), min_size=1, max_size=20))
def test_capacity_is_that_of_the_next_listed_radius(chart, radii):
    capacity = capacity_kg(chart, np.array(radii))
    for r, c in zip(radii, capacity.tolist(), strict=True):
        further = [able for at, able in zip(chart.radius_m, chart.capacity_kg, strict=True) if at >= r - 1e-6]
        assert c == capacity_kg(chart, r) == (further[0] if further else 0.0)


@given(charts())
def test_the_chart_holds_at_its_points_and_nothing_beyond(chart):
    at_points = capacity_kg(chart, np.array(chart.radius_m))
    assert at_points.tolist() == list(chart.capacity_kg)
    assert capacity_kg(chart, np.array(chart.radius_m) + 1e-9).tolist() == list(chart.capacity_kg)
    assert capacity_kg(chart, chart.radius_m[-1] * 1.0001) == 0.0
    assert capacity_kg(chart, 0.0) == chart.capacity_kg[0]


@given(charts(), st.floats(1.0, 40_000.0))
def test_the_largest_radius_carries_the_mass_and_no_larger_one_does(chart, mass):
    radius = max_radius_m(chart, mass)
    if radius == 0.0:
        assert mass > chart.capacity_kg[0]
        return
    assert capacity_kg(chart, radius) >= mass
    assert capacity_kg(chart, radius + 2e-6) < mass


def test_between_two_listed_radii_the_smaller_capacity_holds():
    chart = LoadChart((20.0, 40.0), (10_000.0, 5_000.0))
    assert capacity_kg(chart, np.array([1.0, 20.0, 20.1, 40.0, 40.1])).tolist() == [10_000, 10_000, 5_000, 5_000, 0]
    assert max_radius_m(chart, 5_001.0) == 20.0
    assert max_radius_m(chart, 5_000.0) == 40.0
    assert utilisation(chart, np.array([30.0, 40.0, 41.0]), 2_500.0).tolist() == [0.5, 0.5, np.inf]


@pytest.mark.parametrize("crane", HAMMERHEADS, ids=lambda crane: crane.name)
def test_default_charts_are_charts_and_reach_the_end_of_the_jib(crane):
    assert crane.chart.radius_m[-1] == crane.jib_length_m


@pytest.mark.parametrize(
    ("radii", "capacities", "says"),
    [
        ((), (), "0 radii"),
        ((1.0, 2.0), (5.0,), "2 radii and 1 capacities"),
        ((2.0, 1.0), (5.0, 4.0), "does not ascend"),
        ((1.0, 2.0), (4.0, 5.0), "capacity grows"),
        ((1.0, 2.0), (4.0, float("nan")), "nan"),
        ((-1.0, 2.0), (5.0, 4.0), "-1"),
    ],
)
def test_invalid_charts_are_refused(radii, capacities, says):
    with pytest.raises(InputError, match=says):
        LoadChart(radii, capacities)


MASS = st.floats(10.0, 50_000.0)
AREA = st.floats(0.01, 200.0)


def test_the_formula_of_the_manuals():
    # A wall of 12 m2 and 3 t, drag 2.0: 24 m2 of sail area instead of the assumed 3.6 m2.
    assert permitted_wind_m_s(20.0, 3000.0, 12.0, 2.0) == pytest.approx(20.0 * sqrt(3.6 / 24.0))
    assert permitted_wind_m_s(20.0, 3000.0, 1.7, 2.0) == 20.0
    assert wind_force_n(20.0, 10.0, 1.2) == pytest.approx(10.0 * 1.2 * 250.0)  # 250 N/m2 at 20 m/s, as EN 13001-2


@given(MASS, AREA, st.floats(0.5, 2.5), st.floats(1.0, 30.0))
def test_at_the_permitted_speed_the_force_is_what_the_crane_assumes(mass, area, drag, limit):
    speed = permitted_wind_m_s(limit, mass, area, drag)
    assert 0.0 < speed <= limit
    if speed < limit:
        supposed = wind_force_n(limit, 1.2e-3 * mass, 1.0)
        assert wind_force_n(speed, area, drag) == pytest.approx(supposed, rel=1e-9)
