"""Loads hang at rest when shaped moves end; the planner's swing equals that of the proof."""

import dataclasses
from itertools import pairwise

import numpy as np
import pytest
from box_sites import box_site, test_crane
from crane_rooms import crane_room
from double_pendulum import Load, left_m
from hypothesis import given, settings
from hypothesis import strategies as st
from named_cranes import default_crane

from bimvox.crane.tower_crane import AxisLimits, CranePose
from bimvox.crane.travel import point_to_point_s
from bimvox.errors import PlanningError
from bimvox.motion import swing
from bimvox.motion.drive import drive_path
from bimvox.motion.move import Line, Move
from bimvox.motion.profile import LADDER
from bimvox.motion.steady import SwingRules, steadied, swaying
from bimvox.motion.swing import (
    GRAVITY_M_S2,
    PLANNED_RESIDUAL_M,
    Pendulum,
    gust_swing_m,
    half_period_s,
    pendulum_length_m,
    pendulum_of,
    swing_of,
)
from bimvox.motion.time_plan import time_plan
from bimvox.motion.timeline import in_sequence, sampled
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.proof.crane.pendulum import Hung, left_off_m, swung_on, swung_parts
from bimvox.proof.footprint import MotionFootprint, motion_footprint, path_footprint
from bimvox.proof.motion import verify_motions
from bimvox.proof.swing import OFF_REST_M, REST_M
from bimvox.records.motion import LiftMotion
from bimvox.site.lifting import crane_for, masses_on_rope_kg
from bimvox.site.site import Blocker, Rules, SwingRule

OFF_BY = [(mass, rope) for mass in (0.9, 1.0, 1.1) for rope in (0.9, 1.0, 1.1)]
COLUMNS = [("first", (1.0, 1.0, 0.0), (1.5, 1.5, 3.0)), ("second", (5.0, 3.0, 0.0), (5.5, 3.5, 3.0))]


def run_of_30_m():
    """Return the shaped trolley move of 30 m with a rope of 30 m, at 0.25 m/s^2."""
    crane = default_crane("hammerhead-65", jib_height_m=35.0)
    crane = dataclasses.replace(crane, trolley=AxisLimits(76.0 / 60.0, 0.25, 10.0))
    return crane, [Move(CranePose(0.0, 10.0, 5.0), CranePose(0.0, 40.0, 5.0))], Pendulum(0.0)


def test_a_trolley_run_swings_unless_it_is_shaped():
    crane, moves, pendulum = run_of_30_m()
    plain, shaped = in_sequence(crane, moves), in_sequence(crane, moves, pendulum)
    swings = [swaying(timeline, pendulum, 1.0).swing for timeline in (plain, shaped)]
    peaks = [float(np.linalg.norm(swing.offset_m, axis=1).max()) for swing in swings]
    assert swings[0].amplitude_m[-1] > 1.0
    assert swings[1].amplitude_m[-1] < 0.005
    assert peaks[1] < 0.8 < peaks[0]
    assert shaped.duration_s - plain.duration_s == pytest.approx(half_period_s(30.0)) == pytest.approx(5.49, abs=0.01)
    # The line stays straight, and no axis exceeds its limits.
    time_s = np.linspace(0.0, shaped.duration_s, 4000)
    axes = shaped.axes_at(time_s)
    assert (axes[:, [0, 2]] == [0.0, 5.0]).all()
    rate = np.diff(axes[:, 1]) / np.diff(time_s)
    assert rate.max() <= crane.trolley.rate * (1 + 1e-9)
    assert np.abs(np.diff(rate) / np.diff(time_s)[1:]).max() <= crane.trolley.acceleration * (1 + 1e-3)


def test_a_pendulum_under_a_point_that_was_moved_swings_with_its_period():
    crane = default_crane("hammerhead-30", jib_height_m=25.0)
    step_s = 0.02
    axes = np.tile([0.0, 10.0, 15.0], (3000, 1))
    axes[:, 1] += np.minimum(np.arange(3000) * step_s, 0.1) * 10.0  # one metre, at once
    swing = swing_of(crane, axes, step_s, Pendulum(2.0))
    period_s = 2.0 * half_period_s(pendulum_length_m(crane, 15.0, 2.0))
    assert 2.0 * half_period_s(12.0) == period_s == pytest.approx(2 * np.pi * np.sqrt(12.0 / GRAVITY_M_S2))
    x = swing.offset_m[20:, 0]
    crossings = np.flatnonzero((x[:-1] < 0.0) & (x[1:] >= 0.0))
    assert np.diff(crossings).mean() * step_s == pytest.approx(period_s, rel=1e-3)
    assert swing.amplitude_m[20:] == pytest.approx(1.0, abs=0.01)
    assert np.abs(swing.beyond_m(0.05)).max() == pytest.approx(np.abs(swing.offset_m).max() - 0.05)


def test_the_shortest_pendulum_is_half_a_metre():
    crane = default_crane("hammerhead-30", jib_height_m=25.0)
    assert pendulum_length_m(crane, 25.0, 0.1) == 0.5


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 300), st.sampled_from([0.0, 0.3, 1.0, 5.0, 40.0]))
def test_loads_hang_at_rest_at_the_end_by_both_pendulums(seed, ratio):
    room = crane_room(seed)
    pendulum, hung = Pendulum(3.0, ratio), Hung(3.0, 100.0, 100.0 * ratio)
    rigged = room.rigged._replace(pendulum=pendulum)
    timeline, needed_m = drive_path(rigged, room.space, room.path, 0, 0.0)
    way = sampled(timeline, needed_m, rigged)
    motion = LiftMotion(0, 0, None, way, way, (), 0, int(way.time_ns[-1]))
    (swung,) = swung_parts(room.crane, motion, way, hung)
    planned = swaying(timeline, pendulum, 0.25)
    assert planned.swing.amplitude_m[-1] <= PLANNED_RESIDUAL_M
    assert swung.amplitude_m[-1] <= REST_M
    if ratio:
        assert left_off_m(room.crane, way.time_ns, way.axes, hung) <= OFF_REST_M
    # The planner integrates the motion, the proof its samples.
    there = np.stack([np.interp(swung.time_s, planned.time_s, offset) for offset in planned.swing.offset_m.T], axis=1)
    assert np.abs(there - swung.offset_m).max() < 0.012
    assert way.bound_s <= way.duration_s + 1e-6


@pytest.mark.parametrize("ratio", [0.3, 3.0, 30.0])
def test_two_pendulums_of_the_planner_the_proof_and_an_observer_swing_alike(ratio):
    room = crane_room(7)
    load, time_ns = Load(3.0, 100.0, 100.0 * ratio), np.arange(0, 20_000_000_001, 50_000_000)
    share = np.minimum(time_ns / 4e9, 1.0)[:, None]
    axes = np.array([0.0, 9.0, 4.0]) + (10 * share**3 - 15 * share**4 + 6 * share**5) * np.array([0.2, 3.0, 2.0])
    ends = [
        swing_of(room.crane, axes, 0.05, Pendulum(3.0, ratio)).amplitude_m[-1],
        swung_on(room.crane, time_ns, axes, Hung(3.0, 100.0, 100.0 * ratio)).amplitude_m[-1],
        left_m(room.crane, time_ns / 1e9, axes, [(load, 1.0)])[0],
    ]
    assert min(ends) > 0.1
    assert ends == pytest.approx(ends[:1] * 3, rel=0.05)


def test_an_observer_sees_loads_at_rest_when_rope_and_mass_are_a_tenth_off(shaped):
    plan, motions = shaped
    for motion in motions:
        part = plan.site.components[motion.component]
        crane = crane_for(plan.site, plan.site.cranes[0], part)
        block_kg, load_kg = masses_on_rope_kg(crane, part)
        below_m = crane.sling_m + 0.5 * part.shape.size_vox[2] * plan.site.frame.voxel_size_m
        some = [(Load(below_m, block_kg, share * load_kg), rope) for share, rope in OFF_BY]
        assert left_m(crane, motion.loaded.time_ns / 1e9, motion.loaded.axes, some).max() <= 0.10


def test_a_motion_that_rests_only_if_all_is_as_planned_is_refused(shaped, monkeypatch):
    crane, moves, _ = run_of_30_m()
    timeline = in_sequence(crane, moves, Pendulum(3.0, 4.0))
    time_ns = np.arange(0, int(timeline.duration_s * 1e9), 50_000_000)
    axes, hung = timeline.axes_at(time_ns / 1e9), Hung(3.0, 200.0, 800.0)
    assert swung_on(crane, time_ns, axes, hung).amplitude_m[-1] <= REST_M
    assert left_off_m(crane, time_ns, axes, hung) > OFF_REST_M
    monkeypatch.setattr("bimvox.proof.swing.OFF_REST_M", 1e-4)
    plan, motions = shaped
    found = next(check for check in verify_motions(plan, motions).checks if not check.passed)
    assert found.name == "swing"
    assert "with rope and mass off by 10 % the load swings" in found.failures[0]


def test_what_several_pendulums_leave_is_what_each_leaves_by_itself(shaped):
    (plan, motions), planned = shaped, Pendulum(3.0, 4.0)
    crane, way = plan.site.cranes[0], motions[0].loaded
    at_s = np.linspace(way.time_ns[0], way.time_ns[-1], 900) / 1e9
    axes = np.stack([np.interp(at_s, way.time_ns / 1e9, one) for one in way.axes.T], axis=1)
    step_s = float(at_s[1] - at_s[0])
    wanted = np.arange(900) % 300 == 299
    for pendulums in ((planned, *planned.off), (Pendulum(3.0),)):
        for one, left in zip(pendulums, swing.left_m(crane, axes, step_s, pendulums), strict=True):
            whole, some = (swing_of(crane, axes, step_s, one, at) for at in (None, wanted))
            assert np.array_equal(some.offset_m, whole.offset_m)
            assert np.array_equal(some.amplitude_m[wanted], whole.amplitude_m[wanted])
            assert np.isfinite(whole.amplitude_m).all()
            left_m = np.linalg.norm(left[:4]) + np.linalg.norm(left[4:])
            assert left_m == pytest.approx(whole.amplitude_m[-1], rel=1e-9 if one.load_ratio else 0.05)


@pytest.mark.parametrize("ratio", [0.2, 2.0, 20.0])
def test_a_sudden_gust_swings_a_load_no_further_than_twice_its_lean(shaped, ratio):
    (plan, _), part = shaped, shaped[0].site.components[0]
    site = dataclasses.replace(plan.site, rules=Rules(drag_coefficient=1.5))
    part = dataclasses.replace(part, sail_area_m2=3.0, mass_kg=800.0)
    crane = dataclasses.replace(crane_for(site, site.cranes[0], part), hook_block_kg=800.0 / ratio)
    block_kg, load_kg = masses_on_rope_kg(crane, part)
    found_m = gust_swing_m(site, crane, part, 9.0, 8.0)
    below_m = crane.sling_m + 0.5 * part.shape.size_vox[2] * site.frame.voxel_size_m
    axes = np.tile([0.0, 9.0, crane.jib_height_m - 9.0], (3, 1))
    force_n = 1.5 * 3.0 * 0.625 * 8.0**2
    (seen_m,) = left_m(crane, np.arange(3.0), axes, [(Load(below_m, block_kg, load_kg), 1.0)], force_n)
    assert 0.85 * found_m < seen_m <= 1.01 * found_m


def test_the_bound_includes_the_cost_of_shaping():
    crane = default_crane("hammerhead-30")
    start, end = CranePose(0.0, 10.0, 5.0), CranePose(1.5, 20.0, 5.0)
    plain = point_to_point_s(crane, start, end, 6.0)
    assert point_to_point_s(crane, start, end, 6.0, 4.0) == plain + 4.0
    up = CranePose(0.0, 10.0, 25.0)
    assert point_to_point_s(crane, start, up, 6.0, 4.0) == point_to_point_s(crane, start, up, 6.0)


def test_only_moves_sideways_swing_and_a_part_that_stands_on_its_foot_does_not():
    a, b = CranePose(0.0, 10.0, 5.0), CranePose(0.2, 10.0, 9.0)
    assert Move(a, b).swings
    assert Move(a, b, Line.SITE).swings
    assert not Move(a, b, Line.ARC).swings
    assert not Move(a, dataclasses.replace(a, height_m=9.0)).swings


def made(rule):
    crane = test_crane(base=(10.0, -3.0, 0.0), jib=40.0, height=14.0)
    # A fast crane: its loads swing by more than a cell.
    crane = dataclasses.replace(crane, slewing=AxisLimits(0.2, 0.03, 0.03))
    site = box_site(COLUMNS, crane=crane, shape=(40, 30, 24), rules=Rules(swing=rule))
    preparation = prepare(site)
    plan = plan_lifts(site, preparation)
    return plan, time_plan(plan, preparation)


def with_site(plan, **changes):
    return dataclasses.replace(plan, site=dataclasses.replace(plan.site, **changes))


def failed(plan, motions):
    return {check.name for check in verify_motions(plan, motions).checks if not check.passed}


@pytest.fixture(scope="module")
def shaped():
    return made(SwingRule.SHAPED)


def test_motions_without_shaping_fail_only_the_swing_check_if_the_site_requires_shaping(shaped):
    plan, motions = made(SwingRule.OFF)
    assert pendulum_of(plan.site, plan.site.cranes[0], None) is None
    assert failed(plan, motions) == set()
    assert failed(with_site(plan, rules=Rules()), motions) == {"swing"}
    assert failed(*shaped) == set()
    assert sum(m.loaded.duration_s for m in motions) < sum(m.loaded.duration_s for m in shaped[1])


def test_an_object_that_only_the_swing_meets_is_found_by_its_check_alone_and_is_in_the_footprint(shaped):
    plan, motions = shaped
    site = plan.site
    off = dataclasses.replace(site, rules=Rules(swing=SwingRule.OFF))
    every, plain = set(), set()
    for lift, motion in zip(plan.lifts, motions, strict=True):
        every |= _cells(motion_footprint(site, lift, motion))
        plain |= _cells(motion_footprint(off, lift, motion)) | _cells(path_footprint(site, lift))
    swept = {cell for cell in every - plain if (cell[0], cell[1], cell[2] + 1) not in plain}
    assert swept, "the load swings into no cell of its own"
    alone = []
    for cell in sorted(swept)[::7]:
        blocker = Blocker("lamp", "obstruction", np.array([cell], np.int32))
        found = failed(with_site(plan, blockers=(*site.blockers, blocker)), motions)
        alone.append(found == {"swing"})
        assert found <= {"swing"}
    assert any(alone)


def _cells(footprint):
    """Return (column, height) of every cell of a footprint, in a grid of 40 x 30 columns."""
    found = set()
    if isinstance(footprint, MotionFootprint):
        return _cells(footprint.approach) | _cells(footprint.carrying)
    for column, words in zip(footprint.columns.tolist(), footprint.heights.tolist(), strict=True):
        for word, bits in enumerate(words):
            found |= {(column // 30, column % 30, word * 64 + k) for k in range(64) if bits >> k & 1}
    return found


def test_a_load_that_swings_too_far_at_any_pace_is_refused():
    crane, moves, pendulum = run_of_30_m()
    paces = []

    def fault_s(timeline, sway):
        paces.append(timeline.duration_s)
        return timeline.duration_s

    with pytest.raises(PlanningError, match="swings too far"):
        steadied(crane, moves, pendulum, SwingRules(lambda timeline: timeline, fault_s, 1.0))
    assert len(paces) == len(LADDER)
    assert paces[-1] > 5 * paces[0]


def test_each_rung_of_the_ladder_slows_a_move_by_a_fifth_at_most():
    paces = [calm.pace for calm in LADDER]
    assert paces[-1] == 0.12
    assert all(0.79 < slower / faster <= 1.0 for faster, slower in pairwise(paces))
