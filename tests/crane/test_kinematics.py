from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from named_cranes import HAMMERHEADS, crane_pose, default_crane, hook_point, reevings

from bimvox.crane.kinematics import hoist_limits, hook_of, nearest_turn, pose_of, rigged, unwrap_slew, with_reeving
from bimvox.crane.load_chart import LoadChart, capacity_kg
from bimvox.crane.tower_crane import CranePose, Reeving
from bimvox.errors import InputError

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


PER_MIN = 1.0 / 60.0


@given(st.floats(0.0, 30_000.0), st.floats(0.0, 30_000.0), st.sampled_from(HAMMERHEADS))
def test_a_heavier_load_is_never_hoisted_faster(one_kg, other_kg, crane):
    light, heavy = sorted((one_kg, other_kg))
    assert hoist_limits(crane, heavy).rate <= hoist_limits(crane, light).rate


def test_the_hook_block_counts_for_the_gear():
    crane = default_crane("hammerhead-65")
    assert hoist_limits(crane, 5000.0 - crane.tackle_kg).rate == pytest.approx(67.0 * PER_MIN, abs=1e-4)
    assert hoist_limits(crane, 5001.0 - crane.tackle_kg).rate == pytest.approx(43.0 * PER_MIN, abs=1e-4)
    assert rigged(crane, 0.0, 1.5).sling_m == crane.sling_m + 1.5


@pytest.mark.parametrize("crane", HAMMERHEADS, ids=lambda crane: crane.name)
def test_a_reeving_changes_what_it_says_and_nothing_else(crane):
    for reeving in reevings(crane.name):
        other = with_reeving(crane, reeving)
        assert with_reeving(other, reeving) == other
        assert (other.falls, other.chart, other.hook_block_kg) == (reeving.falls, reeving.chart, reeving.hook_block_kg)
        assert (other.slewing, other.jib_length_m, other.rigging_mass_kg) == (
            crane.slewing,
            crane.jib_length_m,
            crane.rigging_mass_kg,
        )
    assert with_reeving(crane, reevings(crane.name)[0]) == crane


@pytest.mark.parametrize("name", ["hammerhead-65", "hammerhead-75"])
def test_two_falls_carry_half_as_much_twice_as_fast(name):
    four, two = reevings(name)
    assert (four.falls, two.falls) == (4, 2)
    assert two.chart.capacity_kg[0] == four.chart.capacity_kg[0] / 2
    assert two.gears[0][1] == pytest.approx(2 * four.gears[0][1], abs=1e-3)
    # At the end of the jib, two falls gain only the lighter hook block.
    radii = np.linspace(50.0, four.chart.radius_m[-1], 40)
    gain = capacity_kg(two.chart, radii) - capacity_kg(four.chart, radii)
    assert (gain >= 0.0).all() and (gain <= four.hook_block_kg).all()


def test_invalid_gears_are_refused():
    chart = LoadChart((10.0,), (1000.0,))
    with pytest.raises(InputError, match="reeving of 2 falls"):
        Reeving(2, chart, gears=((500.0, 0.5), (1000.0, 0.6)))
    with pytest.raises(InputError, match="0 falls"):
        Reeving(0, chart)
