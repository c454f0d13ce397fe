"""Two cranes: the schedule's bounds and the proof's points agree, and faulty motions are found."""

import dataclasses

import numpy as np
import pytest
from named_cranes import default_crane, default_luffing_crane
from two_cranes import shifted, two_crane_plan, waiting

from bimvox.bim.building import TriangleMesh
from bimvox.crane.conflict import (
    COLUMNS,
    HOOK_HIGH,
    HOOK_LOW,
    LOAD_HALF,
    LOWEST,
    RADIUS_HIGH,
    RADIUS_LOW,
    SLEW_HIGH,
    SLEW_LOW,
    SPAN_NS,
    CraneTrack,
    first_conflict,
    joined,
)
from bimvox.crane.outline import outline_of
from bimvox.cranes.lift import REACTION_S, approach_track, carrying_track
from bimvox.proof.crane.distance import least_distances, stopping_swing
from bimvox.proof.crane.separation import _shape, check_cranes, check_turns
from bimvox.records.motion import PhaseName
from bimvox.records.proof import Check
from bimvox.stop.brake_axes import brake, braking_distances, state_at

S = 1_000_000_000


def with_separation(plan, separation_m):
    rules = dataclasses.replace(plan.site.rules, crane_separation_m=separation_m)
    return dataclasses.replace(plan, site=dataclasses.replace(plan.site, rules=rules))


def proof(plan, motions):
    cranes, turns = Check("cranes"), Check("turns")
    check_cranes(cranes, plan.site, motions)
    check_turns(turns, plan.site, plan, motions)
    return cranes, turns


def track(plan, motions, number):
    site, lifts = plan.site, {lift.order: lift for lift in plan.lifts}
    parts = []
    for motion in motions:
        if motion.crane == number:
            if motion.approach is not None:
                parts.append(approach_track(site, site.cranes[number], motion.approach, motion.start_ns))
            parts.append(carrying_track(site, site.cranes[number], lifts[motion.order], motion))
    return joined(parts)


def conflict(plan, motions):
    outlines = tuple(outline_of(crane) for crane in plan.site.cranes)
    tracks = [track(plan, motions, number) for number in (0, 1)]
    return first_conflict(outlines, *tracks, plan.site.rules.crane_separation_m)


def test_lifts_one_after_the_other_pass():
    plan, motions = two_crane_plan()
    assert {motion.crane for motion in motions} == {0, 1}
    assert any(phase.name is PhaseName.WAIT for motion in motions for phase in motion.phases)
    cranes, turns = proof(plan, motions)
    assert cranes.passed, cranes.failures
    assert turns.passed, turns.failures
    assert cranes.samples > 10_000
    assert 0.0 < cranes.worst < 1.0
    assert conflict(plan, motions) is None


@pytest.mark.parametrize("late_s", [140, 160, 180, 200])
def test_a_crane_that_is_late_meets_the_other(late_s):
    plan, motions = two_crane_plan()
    late = shifted(motions, 1, late_s * S)
    cranes, _ = proof(plan, late)
    assert not cranes.passed
    assert "west" in cranes.failures[0]
    assert "east" in cranes.failures[0]
    assert cranes.culprits
    assert conflict(plan, late) is not None


@pytest.mark.parametrize("late_s", [0, 20, 60, 100, 120, 130, 250, 300, 400, 600])
def test_what_the_bounds_let_pass_passes_the_proof(late_s):
    plan, motions = two_crane_plan()
    late = shifted(motions, 1, late_s * S)
    if conflict(plan, late) is None:
        assert proof(plan, late)[0].passed


def test_a_larger_separation_is_the_only_thing_that_fails():
    plan, motions = two_crane_plan()
    wide = with_separation(plan, 8.0)
    cranes, turns = proof(wide, motions)
    assert not cranes.passed
    assert turns.passed
    assert conflict(wide, motions) is not None


def test_cranes_that_only_pass_each_other_must_also_be_able_to_stop():
    plan, motions = two_crane_plan()
    cranes, _ = proof(plan, shifted(motions, 1, 121 * S))
    assert cranes.failures
    assert all("told to stop" in failure for failure in cranes.failures)


@pytest.mark.parametrize("names", ["connected", "after", "near"])
def test_turns_that_are_not_kept_are_named(names):
    plan, motions = two_crane_plan()
    plan = next_to_the_first(plan, names)
    lifts = {motion.order: motion for motion in motions}
    later = lifts[1]
    wait_ns = next(phase.end_ns - phase.start_ns for phase in later.phases if phase.name is PhaseName.WAIT)
    hurried = waiting(
        dataclasses.replace(
            later,
            phases=tuple(phase for phase in later.phases if phase.name is not PhaseName.WAIT),
            raising=dataclasses.replace(later.raising, time_ns=later.raising.time_ns - wait_ns),
            loaded=dataclasses.replace(later.loaded, time_ns=later.loaded.time_ns - wait_ns),
        ),
        later.start_ns,
        0,
    )
    _, turns = proof(plan, [hurried if motion.order == 1 else motion for motion in motions])
    assert turns.failed == 2
    assert turns.failures[0].startswith("lift 2 is hooked on at 0.000 s, before lift 1 is raised")
    assert turns.failures[1].startswith("lift 2 comes to its place at")
    assert turns.culprits == {plan.site.components[later.component].id}


@pytest.mark.parametrize(("names", "may"), [("nothing", True), ("near", False), ("far", True)])
def test_a_part_comes_to_its_place_while_one_that_is_not_next_to_it_is_braced(names, may):
    plan, motions = two_crane_plan()
    plan = next_to_the_first(plan, names)
    first, second, *_ = sorted(motions, key=lambda motion: motion.order)
    between_ns = (first.set_ns + first.released_ns) // 2
    _, turns = proof(plan, shifted(motions, second.crane, between_ns - second.set_ns))
    named = [failure for failure in turns.failures if failure.startswith("lift 2 comes to its place")]
    assert bool(named) != may
    assert all("next to it stands by itself" in failure for failure in named)
    _, turns = proof(plan, shifted(motions, second.crane, first.set_ns - second.set_ns - S))
    assert [failure for failure in turns.failures if failure.startswith("lift 2 comes to its place")]


def next_to_the_first(plan, names):
    """Return a plan in which the part of the second lift is named, or stands, next to that of the first one."""
    parts = list(plan.site.components)
    first, second = (parts[lift.component] for lift in sorted(plan.lifts, key=lambda lift: lift.order)[:2])
    size_m = first.mesh.bounds_m[1, 1] - first.mesh.bounds_m[0, 1]
    near, far = (
        TriangleMesh(first.mesh.vertices_m + np.array([0.0, size_m + gap_m, 0.0]), first.mesh.faces)
        for gap_m in (2.9, 3.1)
    )
    more = {
        "connected": {"hints": dataclasses.replace(second.hints, connected=(first.id,))},
        "after": {"after": (first.id,)},
        "near": {"mesh": near},
        "far": {"mesh": far},
        "nothing": {},
    }[names]
    parts[second.index] = dataclasses.replace(second, **more)
    return dataclasses.replace(plan, site=dataclasses.replace(plan.site, components=tuple(parts)))


def test_a_later_delivery_waits_for_the_one_before():
    plan, motions = two_crane_plan()
    assert proof(plan, motions)[1].passed
    last = max(lift.order for lift in plan.lifts)
    lifts = tuple(
        dataclasses.replace(lift, place=dataclasses.replace(lift.place, delivery=int(lift.order >= last - 1)))
        for lift in plan.lifts
    )
    delivered = dataclasses.replace(plan, lifts=lifts)
    assert proof(delivered, motions)[1].passed
    early = shifted(motions, 0, -30 * S)
    before = proof(plan, early)[1].failed
    _, turns = proof(delivered, early)
    assert turns.failed == before + 1
    assert any("lift 6 is of a later delivery, hooked on" in failure for failure in turns.failures)


def test_the_bounds_of_a_span_hold_every_stop_in_it():
    plan, motions = two_crane_plan()
    lifts = {lift.order: lift for lift in plan.lifts}
    rng = np.random.default_rng(3)
    for motion in motions[:4]:
        site, crane = plan.site, plan.site.cranes[motion.crane]
        own = carrying_track(site, crane, lifts[motion.order], motion)
        start_ns = motion.start_ns + int(motion.loaded.time_ns[0])
        for told_ns in rng.integers(start_ns, motion.start_ns + int(motion.loaded.time_ns[-1]) - 2 * S, 20).tolist():
            at_ns, state = state_at(motion, told_ns)
            span = own.spans[(at_ns - int(REACTION_S * S) - own.start_ns) // SPAN_NS]
            limits = (crane.slewing, crane.trolley, crane.hoist)
            for axis, (low, high) in enumerate(
                ((SLEW_LOW, SLEW_HIGH), (RADIUS_LOW, RADIUS_HIGH), (HOOK_LOW, HOOK_HIGH))
            ):
                stop = brake(
                    float(state.position[axis]), float(state.rate[axis]), float(state.acceleration[axis]), limits[axis]
                )
                slack = 2e-3 if axis == 0 else 2e-2
                assert span[low] - slack <= stop.end <= span[high] + slack


def test_in_an_extract_only_known_times_are_checked():
    """Between two lifts that do not follow each other directly, the position of the crane is unknown."""
    plan, motions = two_crane_plan()
    few = [motion for motion in motions if motion.order in (1, 3, 6)]
    check = Check("cranes")
    check_cranes(check, plan.site, few, is_whole=False)
    assert check.passed, check.failures
    whole = Check("cranes")
    check_cranes(whole, plan.site, motions)
    assert 0 < check.samples < whole.samples


def test_braking_distances_agree_with_braking():
    limits = default_crane("hammerhead-65").slewing
    rng = np.random.default_rng(1)
    rate = rng.uniform(-limits.rate, limits.rate, 200)
    acceleration = rng.uniform(-limits.acceleration, limits.acceleration, 200)
    low, high = braking_distances(rate, acceleration, limits)
    for n in range(200):
        stop = brake(0.0, float(rate[n]), float(acceleration[n]), limits)
        way = stop.at(np.linspace(0.0, stop.duration_s, 2000))
        assert low[n] == pytest.approx(min(way.min(), 0.0), abs=1e-6)
        assert high[n] == pytest.approx(max(way.max(), 0.0), abs=1e-6)


def test_a_stopped_load_swings_no_further_than_its_bound():
    seconds = np.arange(0.0, 20.0, 0.25)
    limits = default_crane("hammerhead-65").trolley
    stop = brake(20.0, 1.0, 0.0, limits)
    poses = np.stack([np.zeros_like(seconds), stop.at(seconds), np.full_like(seconds, 10.0)], axis=1)
    swing = stopping_swing(poses, np.array([0.0, 1.0, 0.0]), 40.0, 0.25)
    assert (np.diff(swing) >= 0.0).all()
    assert 0.5 < swing[-1] <= 2.0 * limits.acceleration * 30.0 / 9.80665 + 0.05
    assert stopping_swing(np.repeat(poses[-1:], 80, axis=0), np.zeros(3), 40.0, 0.25).max() == pytest.approx(0.0)


def pose(slew, radius, height, load_m=0.5, drop_m=2.0):
    return np.array([[slew, radius, height, -load_m, load_m, -load_m, load_m, drop_m, 0.0]])


def test_a_luffing_jib_is_measured_where_it_is():
    """The hook of the other crane may be next to the low part of the jib and above it, but not near its tip."""
    luffing = default_luffing_crane("luffing-40")
    high = dataclasses.replace(default_crane("hammerhead-65"), base_m=(60.0, 0.0, 0.0), jib_height_m=120.0)
    shapes = _shape(luffing), _shape(high)
    steep = pose(0.0, 12.0, 20.0)
    tip_m = luffing.luffing.pivot_height_m + 38.0
    over_foot = pose(np.pi, 57.5, 60.0)
    at_tip = pose(np.pi, 48.0, tip_m)
    assert least_distances(shapes[0], steep, shapes[1], over_foot, 2.0)[0] > 2.0
    assert least_distances(shapes[0], steep, shapes[1], at_tip, 2.0)[0] < 2.0


def test_a_luffing_crane_next_to_a_hammerhead():
    """The jib ends above its hook: if raised, it is clear of what it meets if lowered."""
    luffing = default_luffing_crane("luffing-40")
    hammerhead = dataclasses.replace(
        default_crane("hammerhead-45"), base_m=(60.0, 0.0, 0.0), jib_height_m=50.0, jib_length_m=45.0
    )
    outlines = outline_of(luffing), outline_of(hammerhead)

    def at(slew, radius, height):
        row = np.zeros(COLUMNS)
        row[[SLEW_LOW, SLEW_HIGH]], row[[RADIUS_LOW, RADIUS_HIGH]] = slew, radius
        row[[HOOK_LOW, HOOK_HIGH]], row[LOWEST], row[LOAD_HALF] = height, height - 3.0, 1.0
        return CraneTrack(0, row[None], row, row)

    other = at(np.pi, 20.0, 20.0)
    assert first_conflict(outlines, at(0.0, 10.0, 20.0), other, 2.0) is None
    met = first_conflict(outlines, at(0.0, 38.0, 20.0), other, 2.0)
    assert met is not None
    assert met.parts[1] in ("jib", "rope", "load")
