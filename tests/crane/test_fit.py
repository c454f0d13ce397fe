import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from named_cranes import HAMMERHEADS

from bimvox.crane.fit import HOOK_BLOCK_M, MAST_CLEARANCE_M, Ground, distance_to_polygon_m, fit_crane
from bimvox.crane.geometry import mast_box_m
from bimvox.crane.load_chart import capacity_kg
from bimvox.errors import InputError

BUILDING = np.array([[0.0, 0.0], [20.0, 0.0], [20.0, 12.0], [0.0, 12.0]])
YARD = np.array([[25.0, 0.0], [35.0, 0.0], [35.0, 12.0], [25.0, 12.0]])


def test_the_smallest_crane_that_serves_every_point_is_chosen_clear_of_everything():
    points = np.concatenate([BUILDING, YARD])
    crane = fit_crane(points, 1500.0, Ground((BUILDING, YARD)), 18.0, cranes=HAMMERHEADS)
    assert crane.name == "hammerhead-30"
    assert crane.jib_height_m == 18.0 + HOOK_BLOCK_M
    radii = np.hypot(*(points - np.array(crane.base_m[:2])).T)
    assert (radii >= crane.min_radius_m).all()
    assert (capacity_kg(crane.chart, radii) >= 1500.0 + crane.tackle_kg).all()
    low, high = np.array(mast_box_m(crane))
    for area in (BUILDING, YARD):
        gap = np.maximum(area.min(axis=0) - high[:2], low[:2] - area.max(axis=0)).max()
        assert gap >= MAST_CLEARANCE_M - 1e-9
    assert high[2] == crane.jib_height_m


def test_heavier_parts_need_a_larger_crane_and_the_same_input_gives_the_same_one():
    points, masses = np.concatenate([BUILDING, YARD]), [9000.0] * 4 + [1000.0] * 4
    crane = fit_crane(points, masses, Ground((BUILDING, YARD)), 18.0, cranes=HAMMERHEADS)
    assert crane.name == "hammerhead-75"
    assert fit_crane(points, masses, Ground((BUILDING, YARD)), 18.0, cranes=HAMMERHEADS) == crane


def test_what_no_crane_can_carry_is_reported_with_point_and_mass():
    with pytest.raises(InputError, match=r"60000 kg are needed at \(20\.0, 12\.0\)") as caught:
        fit_crane(BUILDING, [1000.0, 1000.0, 60_000.0, 1000.0], Ground((BUILDING,)), 10.0, cranes=HAMMERHEADS)
    assert "hammerhead-75" in str(caught.value)
    with pytest.raises(InputError, match="no place for the mast"):
        fit_crane(BUILDING, 100.0, Ground((BUILDING, BUILDING * 20.0 - 150.0)), 10.0, cranes=HAMMERHEADS)
    with pytest.raises(InputError, match="no point"):
        fit_crane(np.zeros((0, 2)), [], Ground((BUILDING,)), 10.0, cranes=HAMMERHEADS)


@settings(max_examples=50, deadline=None)
@given(st.floats(-10.0, 40.0), st.floats(-10.0, 40.0))
def test_distance_to_a_polygon_is_that_of_shapely(x, y):
    from shapely.geometry import Point, Polygon

    corners = np.array([[0.0, 0.0], [30.0, 0.0], [30.0, 10.0], [12.0, 10.0], [12.0, 25.0], [0.0, 25.0]])
    found = distance_to_polygon_m(np.array([[x, y]]), corners)[0]
    assert found == pytest.approx(Polygon(corners).distance(Point(x, y)), abs=1e-9)


def test_default_cranes_ascend_by_size():
    assert [crane.jib_length_m for crane in HAMMERHEADS] == [30.0, 45.0, 65.0, 75.0]
