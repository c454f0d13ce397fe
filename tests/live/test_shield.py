"""The shield: whoever moves how, up to the speeds that it assumes, nobody is ever under a suspended load."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bimvox.live.env import example_crane, example_job
from bimvox.live.shield import carry, prediction_room
from bimvox.live.traffic import (
    CREW,
    CREW_RADIUS_M,
    FASTEST,
    GOAL_X,
    GOAL_Y,
    HOME,
    KIND,
    RADIUS,
    TRACK,
    WALK_LIMIT_M_S,
    Crowd,
    Ground,
    Habits,
    Sight,
)
from bimvox.live.way import TICK_S, gap_m, placed

SIGHT = Sight()
NOBODY = np.zeros((0, 2))


def crowd_at(places_m: np.ndarray, *, kind: int = CREW, sight: Sight = SIGHT, seed: int = 0) -> Crowd:
    count = len(places_m)
    state = np.zeros((count, 15))
    state[:, :2] = state[:, [GOAL_X, GOAL_Y]] = places_m
    state[:, KIND], state[:, RADIUS], state[:, FASTEST] = kind, CREW_RADIUS_M, WALK_LIMIT_M_S
    state[:, HOME] = np.arange(count) if kind == TRACK else 0
    was_m = np.repeat(places_m[None], sight.delay + 1, axis=0)
    draws = np.random.default_rng(seed).integers(2**64, size=2 * count, dtype=np.uint64)
    return Crowd(state, was_m, np.array(places_m, float), draws, np.zeros(3))


def tracks_ground(tracks: list[np.ndarray]) -> Ground:
    spans = np.cumsum([0, *(len(track) for track in tracks)])
    large = np.zeros(len(tracks), np.bool_)
    return Ground(np.zeros((1, 2)), np.array([0, 1]), np.zeros((2, 2)), np.concatenate(tracks), spans, large)


def driven(way, ground: Ground, crowd: Crowd, limit: int = 4000) -> np.ndarray:
    drive = np.zeros((limit, 2))
    spent = carry(way, ground, Habits(), crowd, SIGHT, (0, limit), prediction_room(), drive)
    return drive[:spent]


@given(seed=st.integers(0, 2**32), number=st.integers(0, 11), way=st.integers(0, 1), hunts=st.booleans())
@settings(max_examples=60)
def test_whoever_moves_how_nobody_is_under_a_suspended_load(seed, number, way, hunts):
    """Others run at the highest assumed speed, some of them to where the load will be, and turn at random."""
    chosen, draw = example_job().lifts[number].ways[way], np.random.default_rng(seed)
    tracks = []
    for _ in range(3):
        middle = chosen.hook_m[draw.integers(len(chosen.hook_m))]
        at, time_s, rows = middle + draw.uniform(-30.0, 30.0, 2), 0.0, []
        for _ in range(400):
            rows.append((time_s, *at))
            goal = chosen.hook_m[min(int(time_s / TICK_S), len(chosen.hook_m) - 1)] if hunts else middle
            goal = goal + draw.normal(0.0, 6.0, 2)
            step_s = float(draw.uniform(0.5, 4.0))
            far = float(np.hypot(*(goal - at)))
            at = at + (goal - at) / max(far, 1e-9) * min(far, WALK_LIMIT_M_S * step_s)
            time_s += step_s
        tracks.append(np.array(rows))
    crowd = crowd_at(np.array([track[0, 1:] for track in tracks]), kind=TRACK, seed=seed)
    crowd.state[:, 6] = tracks_ground(tracks).spans[:-1]
    driven(chosen, tracks_ground(tracks), crowd, 1500)
    assert crowd.counts[1] == 0.0


def test_the_count_of_violations_can_fail():
    """Two tracks that are faster than the shield assumes catch a load."""
    way = example_job().lifts[3].ways[0]
    middle = way.hook_m[len(way.hook_m) // 2]
    runs = np.array([[0.0, *(middle + 60.0)], [30.0, *(middle + 60.0)], [33.0, *middle], [400.0, *middle]])
    hits = 0.0
    for late_s in range(0, 40, 4):
        track = runs + np.array([late_s, 0.0, 0.0])
        crowd = crowd_at(track[:1, 1:], kind=TRACK)
        driven(way, tracks_ground([track]), crowd, 400)
        hits += crowd.counts[1]
    assert hits > 0.0


def test_without_others_the_way_takes_as_long_as_planned():
    for lift in example_job().lifts[:3]:
        for way in lift.ways:
            drive = driven(way, tracks_ground([np.zeros((1, 3))]), crowd_at(NOBODY))
            assert abs(len(drive) - (len(way.rests) - 1)) <= 2 + way.delay
            assert drive[-1, 0] == len(way.rests) - 1


def test_somebody_who_stays_under_the_way_stops_the_load_before_him():
    way = example_job().lifts[0].ways[0]
    middle = way.hook_m[len(way.hook_m) // 2]
    crowd = crowd_at(middle[None])
    crowd.state[:, 5] = 1e9
    drive = driven(way, tracks_ground([np.array([[0.0, *middle]])]), crowd)
    assert drive[-1, 1] == 0.0
    load = np.zeros(9)
    placed(way, float(drive[-1, 0]), 0.0, load)
    assert 2.0 < gap_m(load, *middle) < 20.0


def test_axes_stay_within_their_accelerations_when_stopping_and_starting():
    """Of the rates between ticks; braking and restarting are the crane's own, not a jump."""
    crane, way = example_crane(), example_job().lifts[0].ways[0]
    middle = way.hook_m[int(0.6 * len(way.hook_m))]
    leaves = np.array([[0.0, *middle], [90.0, *middle], [120.0, middle[0] + 40.0, middle[1]]])
    crowd = crowd_at(middle[None], kind=TRACK)
    drive = driven(way, tracks_ground([leaves]), crowd)
    assert drive[-1, 0] == len(way.rests) - 1
    assert drive[5:-20, 1].min() < 0.2
    assert len(drive) > 1.5 * len(way.rests)
    rates = np.stack([np.interp(drive[:, 0], np.arange(len(way.rests)), way.rate[:, n]) for n in range(3)], axis=1)
    moved = np.diff(rates * drive[:, 1:], axis=0) / TICK_S
    for n, axis in enumerate((crane.slewing, crane.trolley, crane.hoist)):
        assert np.abs(moved[:, n]).max() <= 1.02 * axis.acceleration


@pytest.mark.parametrize("seed", [1, 7])
def test_nobody_enters_the_zone_below_a_load_at_rest(seed):
    way = example_job().lifts[2].ways[0]
    place = way.hook_m[-1]
    comes = np.array(
        [[0.0, place[0] + 60.0, place[1]], [150.0, place[0] + 60.0, place[1]], [210.0, *place], [2000.0, *place]]
    )
    crowd = crowd_at(comes[:1, 1:], kind=TRACK, seed=seed)
    spent = carry(way, tracks_ground([comes]), Habits(), crowd, SIGHT, (400, 4000), prediction_room(), np.zeros((0, 2)))
    assert spent > 400
    assert crowd.counts[1] == 0.0
    assert crowd.counts[0] > 0.0
