from math import pi

import pytest
from hypothesis import given
from hypothesis import strategies as st
from named_cranes import default_crane
from ruckig import InputParameter, Ruckig, Trajectory

from bimvox.crane.tower_crane import AxisLimits, CranePose
from bimvox.crane.travel import point_to_point_s, rest_to_rest_s

CRANE = default_crane("hammerhead-45")
POSITIVE = st.floats(0.02, 3.0)


@given(st.floats(0.001, 100.0), POSITIVE, POSITIVE, POSITIVE, st.booleans())
def test_the_closed_form_is_ruckigs_time(way, rate, acceleration, jerk, backwards):
    state = InputParameter(1)
    state.current_position, state.target_position = [0.0], [-way if backwards else way]
    state.max_velocity, state.max_acceleration, state.max_jerk = [rate], [acceleration], [jerk]
    found = Trajectory(1)
    Ruckig(1).calculate(state, found)
    signed = -way if backwards else way
    assert rest_to_rest_s(signed, AxisLimits(rate, acceleration, jerk)) == pytest.approx(found.duration, rel=1e-6)


def test_no_distance_takes_no_time():
    assert rest_to_rest_s(0.0, CRANE.hoist) == 0.0


def test_the_bound_is_the_slowest_axis():
    start, end = CranePose(0.0, 10.0, 5.0), CranePose(1.0, 11.0, 5.0)
    assert point_to_point_s(CRANE, start, end, 0.0) == rest_to_rest_s(1.0, CRANE.slewing)
    assert point_to_point_s(CRANE, start, end, 60.0) == 2 * rest_to_rest_s(55.0, CRANE.hoist)
    up = CranePose(0.0, 10.0, 25.0)
    assert point_to_point_s(CRANE, start, up, 20.0) == rest_to_rest_s(20.0, CRANE.hoist)
    over = rest_to_rest_s(30.0, CRANE.hoist) + rest_to_rest_s(10.0, CRANE.hoist)
    assert point_to_point_s(CRANE, start, up, 35.0) == pytest.approx(over)


@given(st.floats(-9.0, 9.0), st.floats(-9.0, 9.0), st.floats(3.0, 45.0), st.floats(3.0, 45.0), st.floats(0.0, 30.0))
def test_it_takes_the_short_direction_and_is_the_same_back(a, b, near, far, height):
    one, other = CranePose(a, near, height), CranePose(b, far, 7.0)
    there, back = point_to_point_s(CRANE, one, other, 12.0), point_to_point_s(CRANE, other, one, 12.0)
    assert there == pytest.approx(back)
    turned = CranePose(b + 2 * pi, far, 7.0)
    assert point_to_point_s(CRANE, one, turned, 12.0) == pytest.approx(there)
    assert there >= rest_to_rest_s(far - near, CRANE.trolley)


def test_braking_agrees_with_the_limits():
    # From 0.8 rpm at 0.3 deg/s^2: 16 s for the acceleration, and one more for the jerk.
    slewing = CRANE.slewing
    full_turn, half_turn = rest_to_rest_s(2 * pi, slewing), rest_to_rest_s(pi, slewing)
    assert full_turn - half_turn == pytest.approx(pi / slewing.rate)
    assert half_turn - pi / slewing.rate == pytest.approx(17.0, abs=0.1)
