from dataclasses import replace
from math import atan2, hypot, pi, radians

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from named_cranes import LUFFING_CRANES, MOBILE_CRANES, default_crane, default_luffing_crane

from bimvox.crane.kinematics import axes_of_joints, joint_limits, joint_names, joints_of, rigged, winch_limits
from bimvox.crane.reach import HOOK_FORBIDDEN, hook_floor, hook_top
from bimvox.crane.tower_crane import (
    HOIST_SHARE,
    AxisLimits,
    LuffingJib,
    WorkingRange,
    columns_in_range,
    luff_of_radius,
    radius_limits,
    radius_of_luff,
    tip_height_m,
)
from bimvox.errors import InputError
from bimvox.grid.frame import GridFrame

ALL = (*LUFFING_CRANES, *MOBILE_CRANES)
SHARE = st.floats(0.0, 1.0)


@given(st.sampled_from(ALL), st.floats(-pi, pi), SHARE, st.floats(0.0, 30.0))
def test_joints_survive_the_round_trip(crane, slew, share, rope):
    low, high = crane.luffing.luff_rad
    joints = np.array([[slew, low + share * (high - low), rope]])
    assert joints_of(crane, axes_of_joints(crane, joints)) == pytest.approx(joints, abs=1e-9)
    axes = axes_of_joints(crane, joints)
    assert axes_of_joints(crane, joints_of(crane, axes)) == pytest.approx(axes, abs=1e-9)
    assert joint_names(crane) == ("slewing", "luffing", "hoist")


@pytest.mark.parametrize("crane", ALL, ids=lambda crane: crane.name)
def test_radii_and_height_follow_from_the_jib(crane):
    jib = crane.luffing
    assert luff_of_radius(jib, np.array([crane.jib_length_m, crane.min_radius_m])) == pytest.approx(jib.luff_rad)
    assert radius_of_luff(jib, np.array(jib.luff_rad)) == pytest.approx([crane.jib_length_m, crane.min_radius_m])
    assert tip_height_m(jib, np.array([crane.min_radius_m]))[0] == pytest.approx(crane.jib_height_m)
    assert crane.chart.radius_m[-1] <= crane.jib_length_m


@given(st.sampled_from(ALL), SHARE, SHARE, st.floats(0.2, 3.0), st.integers(0, 5))
def test_no_motion_within_the_radius_limits_exceeds_luffing_or_winch(crane, a, b, frequency, seed):
    """Any smooth motion of the radius, with the hook within its share, stays within the limits of the joints."""
    jib = crane.luffing
    near, far = sorted(crane.min_radius_m + s * (crane.jib_length_m - crane.min_radius_m) for s in (a, b))
    limits = radius_limits(jib, jib.winch, near, far)
    # A sine as fast as the limits and the range of radii allow.
    amplitude = (far - near) / 2.0
    w = frequency
    if amplitude < 1e-3:
        return
    most = min(
        limits.rate / (w * amplitude), limits.acceleration / (w**2 * amplitude), limits.jerk / (w**3 * amplitude)
    )
    amplitude *= min(1.0, most)
    t = np.linspace(0.0, 2 * pi / w, 4001)
    phase = seed
    r = (near + far) / 2.0 + amplitude * np.sin(w * t + phase)
    lift = HOIST_SHARE * min(jib.winch.rate / w, jib.winch.acceleration / w**2, jib.winch.jerk / w**3)
    z = 5.0 + lift * np.sin(w * t)
    joints = joints_of(crane, np.stack([np.zeros_like(r), r, z], axis=1))
    for axis, limit in ((1, jib.limits), (2, jib.winch)):
        values = joints[:, axis]
        for order, most in enumerate((limit.rate, limit.acceleration, limit.jerk), start=1):
            values = np.gradient(values, t)
            assert np.abs(values[5 * order : -5 * order]).max() <= most * 1.01


def test_the_gear_holds_for_the_winch_and_the_hook_has_its_share():
    crane = default_luffing_crane("luffing-40")
    light, heavy = rigged(crane, 0.0), rigged(crane, 6000.0)
    assert (winch_limits(crane, 0.0).rate, winch_limits(crane, 6000.0).rate) == (1.0, 0.5)
    assert light.hoist.rate == HOIST_SHARE * 1.0 and heavy.hoist.rate == HOIST_SHARE * 0.5
    assert light.trolley.rate >= heavy.trolley.rate
    assert joint_limits(crane)[1] == crane.luffing.limits
    assert rigged(light, 0.0) == light


def test_a_steep_jib_moves_the_radius_faster_than_a_flat_one():
    jib = default_luffing_crane("luffing-55").luffing
    near, far = jib.radii_m
    assert (
        radius_limits(jib, jib.winch, near, near + 1.0).rate > 2.0 * radius_limits(jib, jib.winch, far - 1.0, far).rate
    )


def test_impossible_jibs_are_refused():
    any_limits = AxisLimits(1.0, 1.0, 1.0)
    good = LuffingJib(0.0, 3.0, 20.0, (radians(20), radians(80)), any_limits, any_limits, 3.0, 1.0, 2.0, 1.0)
    for bad in ({"luff_rad": (1.0, 0.5)}, {"luff_rad": (0.5, 1.6)}, {"pivot_offset_m": -6.0}):
        with pytest.raises(InputError):
            replace(good, **bad)


FRAME = GridFrame((-20.0, -20.0, -0.5), 0.5)
COLUMNS = (80, 80)


@example(2.1895463772853665, 2 * pi, 0.0, 1.0)
@example(0.75, 6.25, 0.0, 6.0)  # the sector without slewing is narrower than a column
@given(st.floats(-pi, pi), st.floats(0.3, 2 * pi), st.floats(0.0, 8.0), st.floats(1.0, 12.0))
def test_a_column_in_range_has_all_its_points_in_range(first, width, near, depth):
    given_range = WorkingRange((first, first + width), (near, near + depth))
    inside = columns_in_range(given_range, (0.3, -0.2, 0.0), FRAME.origin_m, 0.5, COLUMNS)
    for i, j in np.argwhere(inside)[::17]:
        for u, v in ((0.0, 0.0), (1.0, 1.0), (0.5, 0.0), (0.2, 0.9)):
            x, y = -20.0 + 0.5 * (i + u) - 0.3, -20.0 + 0.5 * (j + v) + 0.2
            # A chord between two corners is nearer to the axis than the corners, but by no more than its sag.
            assert near - 0.5 <= hypot(x, y) <= near + depth + 1e-6
            if hypot(x, y) > 1.0:
                turned = (atan2(y, x) - first) % (2 * pi)
                assert turned <= width + 1e-6 or turned >= 2 * pi - 1e-6


def test_the_limiter_is_in_the_map_of_the_hook():
    crane = replace(default_crane("hammerhead-30"), working_range=WorkingRange((0.0, pi), (5.0, 15.0), 12.0))
    floor = hook_floor(crane, FRAME, np.zeros(COLUMNS, np.int32), 100.0, rope=True)
    allowed = np.argwhere(floor != HOOK_FORBIDDEN) * 0.5 - 20.0
    assert len(allowed)
    assert allowed[:, 1].min() >= -1e-9
    top = hook_top(crane, FRAME, (*COLUMNS, 60))
    # The hook at 12 m minus slings of 2.5 m: the top of the load is at 9.5 m, 20 cells above the underside of the slab.
    assert (top == 20).all()
    assert hook_top(crane, FRAME, (*COLUMNS, 20)).size == 0


def test_empty_ranges_are_refused():
    for bad in ({"slew_rad": (1.0, 1.0)}, {"slew_rad": (0.0, 7.0)}, {"radius_m": (5.0, 4.0)}):
        with pytest.raises(InputError):
            WorkingRange(**bad)
