from math import hypot, pi

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from named_cranes import crane_pose, default_crane, default_luffing_crane
from scipy.optimize import linprog
from scipy.sparse import coo_matrix

from bimvox.crane.kinematics import hook_of, joint_limits, joints_of
from bimvox.crane.tower_crane import CranePose
from bimvox.crane.travel import rest_to_rest_s
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


HAMMERHEAD = default_crane("hammerhead-45")
CRANES = {"hammerhead": HAMMERHEAD, "luffing": LUFFING}


def line(x0_m, y0_m, x1_m, y1_m, rise_m=0.0, kind=Line.SITE):
    """Return the move between two points on the plan."""
    slew, later = np.unwrap([np.arctan2(y0_m, x0_m), np.arctan2(y1_m, x1_m)]).tolist()
    start = CranePose(slew, hypot(x0_m, y0_m), 10.0)
    return Move(start, CranePose(later, hypot(x1_m, y1_m), 10.0 + rise_m), kind)


def evenly_split_s(crane, move):
    """Return the time if each limit is split evenly over its terms, at their largest over the whole line."""
    points = hook_of(crane, *axes_along(crane, move, np.linspace(0.0, 1.0, 2001)).T)[:, :2]
    r = np.linalg.norm(points - crane.base_m[:2], axis=1).min()
    quarter = pi / 2.0 if move.line is Line.ARC else 1.0
    one = np.linalg.norm(points[-1] - points[0]) * quarter
    two, three = (one * quarter, one * quarter**2) if move.line is Line.ARC else (0.0, 0.0)
    up = [abs(move.difference[2]) * quarter**n if n == 1 or move.line is Line.ARC else 0.0 for n in (1, 2, 3)]
    slewing = (one / r, two / r + (one / r) ** 2, three / r + 3.0 * one * two / r**2 + 2.0 * (one / r) ** 3)
    radial = (one, two + one**2 / r, three + 3.0 * one * two / r + 2.0 * one**3 / r**2)
    rates, accelerations, jerks = [], [], []
    axes = tuple(zip((crane.slewing, crane.trolley, crane.hoist), (slewing, radial, up), strict=True))
    for limits, (first, second, third) in axes:
        if first > 0.0:
            parts = 2.0 if second else 1.0
            rates += [limits.rate / first]
            accelerations += [limits.acceleration / (parts * first)]
            jerks += [limits.jerk / ((2.0 * parts - 1.0) * first)]
        if second > 0.0:
            rates += [(limits.acceleration / (2.0 * second)) ** 0.5, (limits.jerk / (3.0 * third)) ** (1 / 3)]
    rate = min(rates)
    accelerations += [limits.jerk / (9.0 * second * rate) for limits, (_, second, _) in axes if second > 0.0]
    return rest_to_rest_s(1.0, type(crane.slewing)(rate, min(accelerations), min(jerks)))


def least_s(crane, move, steps=200):
    """Return the least time under each axis's rate and acceleration, whatever the jerk.

    By the squares w of the share's rate at points of the line: acceleration and rate are linear in them, and the
    quickest motion has the largest w everywhere.
    """
    share = np.linspace(0.0, 1.0, 4 * steps + 1)
    axes = axes_along(crane, move, share)
    first = np.gradient(axes, share[1], axis=0, edge_order=2)
    second = np.gradient(first, share[1], axis=0, edge_order=2)[2::4]
    most = np.full(steps + 1, 1e6)
    rows, columns, values = [], [], []
    for axis, limits in enumerate((crane.slewing, crane.trolley, crane.hoist)):
        at, between = first[::4, axis], first[2::4, axis]
        most = np.minimum(most, (limits.rate / np.maximum(np.abs(at), 1e-9)) ** 2)
        for sign in (1.0, -1.0):
            row = np.arange(steps) + steps * len(rows)
            rows.append(np.concatenate([row, row]))
            columns.append(np.concatenate([np.arange(steps), np.arange(1, steps + 1)]))
            change = between * steps / 2.0
            both = np.concatenate([second[:, axis] / 2.0 - change, second[:, axis] / 2.0 + change])
            values.append(sign * both / limits.acceleration)
    most[[0, -1]] = 0.0
    table = coo_matrix((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))).tocsr()
    bounds = np.column_stack([np.zeros(steps + 1), most])
    found = linprog(-np.ones(steps + 1), A_ub=table, b_ub=np.ones(table.shape[0]), bounds=bounds)
    rate = np.sqrt(np.maximum(found.x, 0.0))
    return float((2.0 / steps / (rate[1:] + rate[:-1])).sum())


PLACES = st.integers(-420, 420).map(lambda n: n / 10.0)


@settings(max_examples=150, deadline=None)
@given(PLACES, PLACES, PLACES, PLACES, st.sampled_from([0.0, 3.0]), st.sampled_from([Line.SITE, Line.ARC]))
@pytest.mark.parametrize("crane", CRANES.values(), ids=CRANES)
def test_it_takes_no_longer_than_with_limits_split_evenly(crane, x0_m, y0_m, x1_m, y1_m, rise_m, kind):
    move = line(x0_m, y0_m, x1_m, y1_m, rise_m, kind)
    radii_m = axes_along(crane, move, np.linspace(0.0, 1.0, 101))[:, 1]
    assume(crane.min_radius_m < radii_m.min() and radii_m.max() < crane.jib_length_m)
    assume(hypot(x1_m - x0_m, y1_m - y0_m) > 0.2)
    assert move_time_s(crane, move) <= 1.005 * evenly_split_s(crane, move)


@pytest.mark.parametrize(
    ("move", "most"),
    [
        (line(18.0, 2.0, 9.0, 4.0), 1.95),
        (line(15.0, -20.0, 15.0, 20.0), 1.65),
        (line(20.0, 0.0, 20.0, 2.5), 1.15),
        (line(8.0, 0.0, 24.0, 0.0), 1.1),
        (line(10.0, -30.0, 10.0, 5.0), 1.9),
        (line(14.0, 3.0, 18.0, 9.0, 2.0), 1.55),
    ],
)
def test_it_is_close_to_the_least_time(move, most):
    ratio = move_time_s(HAMMERHEAD, move) / least_s(HAMMERHEAD, move)
    assert 1.0 <= ratio <= most


def test_a_luffing_jib_goes_by_the_radii_of_the_line():
    near, far = line(14.0, -2.0, 14.0, 2.0), line(34.0, -2.0, 34.0, 2.0)
    assert share_limits(LUFFING, near) != share_limits(LUFFING, far)
    radial = line(14.0, 0.0, 18.0, 0.0)
    assert move_time_s(LUFFING, radial) == pytest.approx(move_time_s(LUFFING, Move(radial.start, radial.end)), rel=0.01)
