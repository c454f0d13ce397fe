"""Two cranes near each other: the bounds against poses drawn from them."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from named_cranes import default_crane, default_luffing_crane

from bimvox.crane.conflict import (
    COLUMNS,
    HOOK_HIGH,
    HOOK_LOW,
    LOAD_HALF,
    LOWEST,
    RADIUS_HIGH,
    RADIUS_LOW,
    ROPE_HALF,
    SLEW_HIGH,
    SLEW_LOW,
    SPAN_NS,
    CraneTrack,
    first_conflict,
    first_start,
    joined,
)
from bimvox.crane.outline import highest_point_m, outline_of

SEPARATION_M = 2.0


def hammerhead(x_m=0.0, jib_height_m=30.0, jib_m=40.0):
    crane = default_crane("hammerhead-45")
    return dataclasses.replace(
        crane, base_m=(x_m, 0.0, 0.0), jib_height_m=jib_height_m, jib_length_m=jib_m, mast_size_m=1.6
    )


def row(slew=(0.0, 0.0), radius=(20.0, 20.0), hook=(10.0, 10.0), lowest=5.0, load=1.0, rope=0.1):
    made = np.zeros(COLUMNS)
    made[[SLEW_LOW, SLEW_HIGH]] = slew
    made[[RADIUS_LOW, RADIUS_HIGH]] = radius
    made[[HOOK_LOW, HOOK_HIGH]] = hook
    made[[LOWEST, LOAD_HALF, ROPE_HALF]] = lowest, load, rope
    return made


def track(*rows, start_ns=0):
    spans = np.array(rows)
    return CraneTrack(start_ns, spans, spans[0], spans[-1])


def conflict(cranes, a, b, **more):
    return first_conflict((outline_of(cranes[0]), outline_of(cranes[1])), a, b, SEPARATION_M, **more)


def strip_points(crane, along, half, slew):
    """Return points along the edges of a strip."""
    s = np.linspace(*along, 60)
    u, v = np.array([np.cos(slew), np.sin(slew)]), np.array([-np.sin(slew), np.cos(slew)])
    edges = [s[:, None] * u + side * half * v for side in (-1.0, 0.0, 1.0)]
    return np.concatenate(edges) + np.array(crane.base_m[:2])


def jibs_apart(a, b, slew_a, slew_b):
    points = [
        np.concatenate(
            [
                strip_points(crane, (0.0, outline_of(crane).jib_end_m), outline_of(crane).jib_half_m, slew),
                strip_points(crane, (-outline_of(crane).tail_m, 0.0), outline_of(crane).tail_half_m, slew),
            ]
        )
        for crane, slew in ((a, slew_a), (b, slew_b))
    ]
    return float(np.linalg.norm(points[0][:, None] - points[1][None], axis=2).min())


def test_two_jibs_that_face_each_other_meet_and_two_that_face_away_do_not():
    a, b = hammerhead(), hammerhead(60.0)
    met = conflict((a, b), track(row((0.0, 0.0))), track(row((np.pi, np.pi))))
    assert met is not None
    assert met.parts == ("jib", "jib")
    assert met.distance_m == 0.0
    assert conflict((a, b), track(row((np.pi, np.pi))), track(row((0.0, 0.0)))) is None


def test_what_is_swept_between_two_poses_counts_not_only_the_poses():
    a, b = hammerhead(), hammerhead(60.0)
    away = track(row((1.5, 1.5)))
    across = track(row((np.pi - 1.0, np.pi + 1.0)))
    for slew in (np.pi - 1.0, np.pi + 1.0):
        assert conflict((a, b), track(row((0.3, 0.3))), track(row((slew, slew)))) is None
    assert conflict((a, b), track(row((0.3, 0.3))), across) is not None
    assert conflict((a, b), away, across) is None


def test_an_upper_jib_passes_over_a_lower_crane_and_its_rope_does_not():
    low, high = hammerhead(), hammerhead(45.0, jib_height_m=60.0)
    outline = outline_of(high)
    assert highest_point_m(low) + SEPARATION_M <= min(outline.jib_m[0], outline.tail_height_m[0])
    over = track(row((np.pi, np.pi), radius=(10.0, 10.0), hook=(50.0, 50.0), lowest=45.0))
    lower = track(row((0.0, 0.0), radius=(20.0, 20.0)))
    assert conflict((low, high), lower, over) is None
    through = track(row((np.pi, np.pi), radius=(10.0, 10.0), hook=(20.0, 20.0), lowest=15.0))
    met = conflict((low, high), lower, through)
    assert met is not None
    assert met.parts == ("jib", "rope")
    high_load = track(row((np.pi, np.pi), radius=(10.0, 10.0), hook=(34.0, 34.0), lowest=31.0))
    assert conflict((low, high), lower, high_load).parts[1] == "load"


def test_loads_keep_apart_where_the_jibs_do_not_meet():
    low, high = hammerhead(), hammerhead(42.0, jib_height_m=60.0)
    a = track(row((0.3, 0.3), radius=(20.0, 20.0)))
    hook = np.array([20.0 * np.cos(0.3) - 42.0 + 3.9, 20.0 * np.sin(0.3)])
    slew, radius = float(np.arctan2(hook[1], hook[0])), float(np.hypot(*hook))
    near = row((slew, slew), radius=(radius, radius), load=1.0)
    near[HOOK_LOW] = near[HOOK_HIGH] = 5.0
    near[LOWEST] = 0.0
    met = conflict((low, high), a, track(near))
    assert met is not None


def test_a_mast_in_the_way_of_a_jib():
    a, b = hammerhead(), hammerhead(30.0, jib_height_m=30.0)
    met = conflict((a, b), track(row((0.0, 0.0))), track(row((0.0, 0.0))))
    assert met is not None
    assert conflict((a, b), track(row((np.pi, np.pi))), track(row((0.0, 0.0)))) is None


@pytest.mark.slow
@settings(max_examples=40)
@given(
    st.floats(-np.pi, np.pi),
    st.floats(0.0, 1.2),
    st.floats(-np.pi, np.pi),
    st.floats(0.0, 1.2),
    st.floats(0.0, 1.0),
    st.floats(0.0, 1.0),
    st.floats(55.0, 85.0),
)
def test_bounds_that_are_apart_hold_no_two_jibs_that_are_near(low_a, wide_a, low_b, wide_b, at_a, at_b, apart):
    a, b = hammerhead(), hammerhead(apart)
    found = conflict((a, b), track(row((low_a, low_a + wide_a))), track(row((low_b, low_b + wide_b))))
    if found is None:
        assert jibs_apart(a, b, low_a + at_a * wide_a, low_b + at_b * wide_b) >= SEPARATION_M - 1e-6
    else:
        # The reverse, within the tolerance of the search and of square ends: some poses in the bounds are near.
        grid = [
            jibs_apart(a, b, low_a + u * wide_a, low_b + v * wide_b)
            for u in np.linspace(0.0, 1.0, 13)
            for v in np.linspace(0.0, 1.0, 13)
        ]
        step_m = 41.0 * max(wide_a, wide_b) / 24.0
        assert min(grid) <= SEPARATION_M + 0.05 + 2.0 * step_m + 1.6


def test_cranes_stand_before_and_after_their_tracks():
    a, b = hammerhead(), hammerhead(60.0)
    facing, away = row((0.0, 0.0)), row((np.pi / 2, np.pi / 2))
    other = track(row((np.pi, np.pi)), start_ns=0)
    assert conflict((a, b), track(away, facing, start_ns=10 * SPAN_NS), other).time_ns == 11 * SPAN_NS
    back = CraneTrack(0, np.array([away]), away, facing)
    assert conflict((a, b), back, other).time_ns == SPAN_NS
    parked = CraneTrack(back.end_ns, back.last[None, :], back.last, back.last)
    assert conflict((a, b), parked, other, from_ns=20 * SPAN_NS).time_ns >= 20 * SPAN_NS
    early = CraneTrack(100 * SPAN_NS, np.array([away]), facing, away)
    assert conflict((a, b), early, other, from_ns=0).time_ns == 0
    assert conflict((a, b), early, other, from_ns=100 * SPAN_NS) is None


def test_a_shifted_track_meets_what_it_would_have_met_later():
    a, b = hammerhead(), hammerhead(60.0)
    away, facing = row((np.pi / 2, np.pi / 2)), row((0.0, 0.0))
    once = track(*[away] * 5, facing, *[away] * 5)
    other = track(*[row((-np.pi / 2, -np.pi / 2))] * 20, row((np.pi, np.pi)), *[row((np.pi / 2, np.pi / 2))] * 20)
    assert conflict((a, b), once, other) is None
    assert conflict((a, b), once.later(15 * SPAN_NS), other).time_ns == 20 * SPAN_NS
    # A time between two spans is found in both.
    assert conflict((a, b), once.later(15 * SPAN_NS - SPAN_NS // 2), other) is not None
    assert conflict((a, b), once.later(15 * SPAN_NS + SPAN_NS // 2), other) is not None
    assert conflict((a, b), once.later(17 * SPAN_NS), other) is None


@pytest.mark.parametrize("late_ns", [0, SPAN_NS // 3, 5 * SPAN_NS, 5 * SPAN_NS + 1])
def test_joined_tracks_hold_every_one_of_them(late_ns):
    one = track(row((0.1, 0.2)), row((0.2, 0.4)))
    other = dataclasses.replace(track(row((0.4, 0.5)), row((0.5, 0.9)), row((0.9, 1.0))), first=row((0.4, 0.4)))
    other = other.later(one.end_ns + late_ns)
    whole = joined([one, other])
    assert whole.start_ns == 0
    assert whole.end_ns >= other.end_ns
    assert np.isfinite(whole.spans).all()
    for part in (one, other):
        for n, own in enumerate(part.spans):
            for inside in (1, SPAN_NS - 1):
                held = whole.spans[(part.start_ns + n * SPAN_NS + inside) // SPAN_NS]
                assert held[SLEW_LOW] <= own[SLEW_LOW]
                assert held[SLEW_HIGH] >= own[SLEW_HIGH]
    if late_ns > 2 * SPAN_NS:
        between = whole.spans[one.end_ns // SPAN_NS + 1]
        assert between[SLEW_HIGH] == pytest.approx(0.4)


def test_the_outline_of_a_luffing_crane_luffs_and_rises_above_its_pivot():
    luffing = default_luffing_crane("luffing-40")
    assert outline_of(luffing).luffs
    assert highest_point_m(luffing) > luffing.luffing.pivot_height_m


@pytest.mark.parametrize("still", [1, 7])
def test_a_crane_at_rest_meets_what_comes_at_the_time_at_which_it_comes(still):
    cranes = hammerhead(), hammerhead(60.0)
    east, west = row(slew=(0.0, 0.0)), row(slew=(np.pi, np.pi))
    waiting = track(*[east] * (3 * still))
    coming = track(*[east] * (2 * still), *[west] * still)
    assert conflict(cranes, waiting, coming).time_ns == 2 * still * SPAN_NS
    assert conflict(cranes, waiting, track(*[west] * still, *[east] * still)).time_ns == 0


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("late_ns", [0, 20 * SPAN_NS + 1], ids=["at once", "later"])
def test_the_first_start_is_the_first_one_without_a_conflict(seed, late_ns):
    random = np.random.default_rng(seed)
    cranes = hammerhead(), hammerhead(60.0)
    outlines = outline_of(cranes[0]), outline_of(cranes[1])

    def wandering(count, middle):
        angles = middle + np.cumsum(random.uniform(-0.15, 0.15, count))
        return track(*(row(slew=(angle - 0.02, angle + 0.02)) for angle in angles))

    a, b = wandering(12, 0.5 * seed / 6), wandering(60, np.pi).later(late_ns)
    step, last = 2 * SPAN_NS, 90 * SPAN_NS
    free = [
        shift
        for shift in range(0, last + 1, step)
        if first_conflict(outlines, a.later(shift), b, SEPARATION_M, from_ns=shift) is None
    ]
    found = first_start(outlines, a, b, SEPARATION_M, (0, step, last), last)
    assert found == min(free, default=None)
    if free and free[0] > 0:
        assert first_start(outlines, a, b, SEPARATION_M, (0, step, free[0] - 1), last) is None


@pytest.mark.parametrize("late_ns", [-3 * SPAN_NS, 0, SPAN_NS // 2])
@pytest.mark.parametrize("until", [4, 30, 200])
def test_a_crane_comes_when_the_other_one_has_left_the_place_where_it_stops_for_the_last_time(late_ns, until):
    cranes = hammerhead(), hammerhead(60.0)
    outlines = outline_of(cranes[0]), outline_of(cranes[1])
    west, east = row(slew=(np.pi, np.pi)), row(slew=(0.0, 0.0))
    north = row(slew=(np.pi / 2.0, np.pi / 2.0))
    coming = track(*[north] * 6, *[east] * 2).later(late_ns)
    there = track(*[west] * 20, *[north] * 40, *[west] * 30, *[north] * 50)
    step, until_ns = 3 * SPAN_NS, until * SPAN_NS
    shifts = range(0, 250 * SPAN_NS, step)
    met = [first_conflict(outlines, coming.later(n), there, SEPARATION_M, from_ns=n) is not None for n in shifts]
    free = next(n for n, is_met in enumerate(met) if not is_met)
    assert free > 20
    wanted = shifts[free] if free == 0 or shifts[free - 1] <= until_ns else None
    assert first_start(outlines, coming, there, SEPARATION_M, (0, step, 2**62), until_ns) == wanted
