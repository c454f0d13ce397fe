import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from named_cranes import HAMMERHEADS

from bimvox.crane.fit import HOOK_BLOCK_M, distance_to_polygon_m, distances_m, radii_for_m, standing
from bimvox.crane.load_chart import capacity_kg
from bimvox.crane.reach import allowed_radii_m


def test_the_hook_of_a_standing_machine_reaches_the_height():
    crane = standing(HAMMERHEADS[0], 18.0)
    assert crane.jib_height_m == 18.0 + HOOK_BLOCK_M
    assert crane.highest_hook_m >= 18.0


def test_many_radii_and_distances_are_those_of_each():
    crane, masses = HAMMERHEADS[1], np.array([1500.0, 300.0, 1500.0, 60_000.0])
    found = radii_for_m(crane, masses)
    assert found.tolist() == [list(allowed_radii_m(crane, mass)) for mass in masses.tolist()]
    assert capacity_kg(crane.chart, found[0, 1]) >= 1500.0 + crane.tackle_kg - 1e-6
    assert found[3, 1] < found[3, 0]
    assert distances_m(np.array([[0.0, 0.0], [3.0, 0.0]]), np.array([[3.0, 4.0]])).tolist() == [[5.0], [4.0]]


@settings(max_examples=50, deadline=None)
@given(st.floats(-10.0, 40.0), st.floats(-10.0, 40.0))
def test_distance_to_a_polygon_is_that_of_shapely(x, y):
    from shapely.geometry import Point, Polygon

    corners = np.array([[0.0, 0.0], [30.0, 0.0], [30.0, 10.0], [12.0, 10.0], [12.0, 25.0], [0.0, 25.0]])
    found = distance_to_polygon_m(np.array([[x, y]]), corners)[0]
    assert found == pytest.approx(Polygon(corners).distance(Point(x, y)), abs=1e-9)


def test_default_cranes_ascend_by_size():
    assert [crane.jib_length_m for crane in HAMMERHEADS] == [30.0, 45.0, 65.0, 75.0]
