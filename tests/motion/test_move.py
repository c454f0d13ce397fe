from math import pi

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from named_cranes import crane_pose, default_crane, default_luffing_crane

from bimvox.crane.bound import rest_to_rest_s
from bimvox.crane.kinematics import hook_of, joint_limits, joints_of
from bimvox.crane.tower_crane import CranePose
from bimvox.motion.move import Line, Move, axes_along, axes_of, move_time_s, share_limits
from bimvox.motion.profile import profile_of

CRANE = default_crane("hammerhead-45", (3.0, -2.0, 0.0))
AXES = (CRANE.slewing, CRANE.trolley, CRANE.hoist)
POSES = st.builds(
    CranePose, *(st.integers(a, b).map(lambda n: n / 100.0) for a, b in ((-300, 300), (400, 4500), (200, 3000)))
)


def moves(pair):
    (start, end), line = pair
    turn = (
        np.clip(end.slew_rad - start.slew_rad, -0.8, 0.8) if line is not Line.JOINT else end.slew_rad - start.slew_rad
    )
    return Move(start, CranePose(start.slew_rad + float(turn), end.radius_m, end.height_m), line)


MOVES = st.tuples(st.tuples(POSES, POSES), st.sampled_from(Line)).map(moves).filter(lambda move: move.start != move.end)


@settings(max_examples=150, deadline=None)
@given(MOVES)
def test_no_axis_exceeds_a_limit_and_both_ends_are_at_rest(move):
    profile = profile_of(share_limits(CRANE, move))
    time = np.linspace(0.0, profile.duration_s, 4001)
    step = time[1] - time[0]
    axes = axes_along(CRANE, move, profile.share_at(time))
    assert axes[0] == pytest.approx(axes_of(move.start), abs=1e-9)
    assert axes[-1] == pytest.approx(axes_of(move.end), abs=1e-9)
    rate, acceleration, jerk = (np.diff(axes, n, axis=0) / step**n for n in (1, 2, 3))
    # Differences are means of the derivative, so they exceed its limit by rounding at most.
    for axis, limits in enumerate(AXES):
        assert np.abs(rate[:, axis]).max() <= limits.rate * (1 + 1e-6) + 1e-9
        assert np.abs(acceleration[:, axis]).max() <= limits.acceleration * (1 + 1e-4) + 1e-8 / step**2 * 1e-4
        assert np.abs(jerk[:, axis]).max() <= limits.jerk * (1 + 1e-2) + 1e-11 / step**3
        assert abs(rate[0, axis]) <= limits.jerk * step**2 + 1e-9
        assert abs(rate[-1, axis]) <= limits.jerk * step**2 + 1e-9


LUFFING = default_luffing_crane("luffing-40")


@settings(max_examples=100, deadline=None)
@given(MOVES)
def test_no_joint_of_a_luffing_crane_exceeds_a_limit(move):
    start, end = (
        CranePose(pose.slew_rad, 9.0 + 28.0 * pose.radius_m / 45.0, pose.height_m) for pose in (move.start, move.end)
    )
    move = Move(start, end, move.line)
    points = axes_along(LUFFING, move, np.linspace(0.0, 1.0, 201))
    assume(points[:, 1].min() > LUFFING.min_radius_m)
    profile = profile_of(share_limits(LUFFING, move))
    time = np.linspace(0.0, profile.duration_s, 2001)
    step = time[1] - time[0]
    joints = joints_of(LUFFING, axes_along(LUFFING, move, profile.share_at(time)))
    rate, acceleration, jerk = (np.abs(np.diff(joints, n, axis=0)).max(axis=0) / step**n for n in (1, 2, 3))
    for axis, limits in enumerate(joint_limits(LUFFING)):
        assert rate[axis] <= limits.rate * (1 + 1e-6) + 1e-9
        assert acceleration[axis] <= limits.acceleration * (1 + 1e-4) + 1e-12 / step**2
        assert jerk[axis] <= limits.jerk * (1 + 1e-2) + 1e-11 / step**3


@settings(max_examples=60, deadline=None)
@given(POSES, POSES)
def test_a_joint_line_is_straight_and_as_fast_as_its_slowest_axis_allows(start, end):
    move = Move(start, end)
    if start == end:
        return
    profile = profile_of(share_limits(CRANE, move))
    axes = axes_along(CRANE, move, profile.share_at(np.linspace(0.0, profile.duration_s, 300)))
    gone = (axes - axes[0]) - profile.share_at(np.linspace(0.0, profile.duration_s, 300))[:, None] * (
        axes[-1] - axes[0]
    )
    assert np.abs(gone).max() < 1e-9
    own = [rest_to_rest_s(way, limits) for way, limits in zip(move.difference, AXES, strict=True)]
    assert profile.duration_s >= max(own) - 1e-6
    assert move_time_s(CRANE, move) == pytest.approx(profile.duration_s, rel=1e-6)


def test_a_site_line_is_straight_in_the_site():
    move = Move(CranePose(0.2, 20.0, 9.0), CranePose(0.5, 22.0, 9.0), Line.SITE)
    points = hook_of(CRANE, *axes_along(CRANE, move, np.linspace(0.0, 1.0, 50)).T)
    way = points[-1] - points[0]
    assert np.linalg.norm(np.cross(points - points[0], way / np.linalg.norm(way)), axis=1).max() < 1e-9


def test_an_arc_keeps_its_distance_from_the_foot():
    foot = hook_of(CRANE, 0.4, 25.0, 2.0)
    start = crane_pose(CRANE, foot + np.array([6.0, 0.0, 0.0]), near_slew_rad=0.4)
    move = Move(start, CranePose(0.4, 25.0, 8.0), Line.ARC)
    points = hook_of(CRANE, *axes_along(CRANE, move, np.linspace(0.0, 1.0, 50)).T)
    assert np.linalg.norm(points - foot, axis=1) == pytest.approx(6.0)
    assert (np.diff(points[:, 2]) > 0.0).all()


def test_a_site_line_across_minus_x_does_not_make_a_whole_turn():
    move = Move(CranePose(pi - 0.1, 20.0, 9.0), CranePose(pi + 0.1, 20.0, 9.0), Line.SITE)
    slew = axes_along(CRANE, move, np.linspace(0.0, 1.0, 50))[:, 0]
    assert (np.diff(slew) > 0.0).all()
    assert slew[-1] == pytest.approx(pi + 0.1)
