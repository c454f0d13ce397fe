from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from named_cranes import crane_pose, default_crane, hook_point

from bimvox.crane.kinematics import hook_of, nearest_turn, pose_of, unwrap_slew
from bimvox.crane.tower_crane import CranePose

CRANE = default_crane("hammerhead-45", (12.5, -7.25, 0.5))
LENGTH = st.floats(-80.0, 80.0)


@given(st.lists(st.tuples(LENGTH, LENGTH, LENGTH), min_size=1, max_size=8))
def test_a_hook_point_survives_the_round_trip(points):
    hook_m = np.array(points)
    assert hook_of(CRANE, *pose_of(CRANE, hook_m)) == pytest.approx(hook_m, abs=1e-9)


@given(st.floats(-pi + 1e-6, pi - 1e-6), st.floats(0.01, 80.0), st.floats(0.0, 60.0))
def test_a_pose_survives_the_round_trip(slew, radius, height):
    back = crane_pose(CRANE, hook_point(CRANE, CranePose(slew, radius, height)))
    assert (back.slew_rad, back.radius_m, back.height_m) == pytest.approx((slew, radius, height), abs=1e-7)


def test_slew_is_counter_clockwise_from_plus_x():
    around = np.array([[10, 0, 3], [0, 10, 3], [-10, -0.0, 3], [0, -10, 3]])
    hook_m = around + CRANE.base_m
    slew, radius, height = pose_of(CRANE, hook_m)
    assert slew == pytest.approx([0.0, pi / 2, pi, -pi / 2])
    assert radius == pytest.approx([10.0] * 4)
    assert height == pytest.approx([3.5] * 4)


def test_shapes_follow_the_input():
    slew, radius, height = pose_of(CRANE, np.zeros((4, 5, 3)))
    assert slew.shape == radius.shape == height.shape == (4, 5)
    assert hook_of(CRANE, slew, radius, 3.0).shape == (4, 5, 3)


@given(st.lists(st.floats(-3.0, 3.0), min_size=1, max_size=30), st.floats(-20.0, 20.0))
def test_unwrapping_hides_no_turn(steps, start):
    angles = start + np.cumsum(steps)
    wrapped = np.remainder(angles + pi, 2 * pi) - pi
    unwrapped = unwrap_slew(wrapped, start_rad=angles[0])
    assert unwrapped == pytest.approx(angles, abs=1e-9)


@given(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0))
def test_the_nearest_turn_is_the_same_angle_and_within_half_a_turn(angle, near):
    turned = nearest_turn(angle, near)
    assert abs(turned - near) <= pi + 1e-9
    assert np.cos(turned - angle) == pytest.approx(1.0, abs=1e-9)
