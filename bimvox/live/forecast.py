"""What a decider may think of the others from what is seen: where they will be, and futures drawn from a model."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bimvox.compiled import kernel
from bimvox.env.pool import random_unit
from bimvox.live.move import pass_tick
from bimvox.live.pace import gap_m, placed
from bimvox.live.traffic import (
    CREW,
    DWELLS_S,
    GOAL_X,
    GOAL_Y,
    HOME,
    KIND,
    LEG,
    LORRY,
    RADIUS,
    SPEED,
    STILL_S,
    TRACK,
    VX,
    VY,
    Crowd,
    Ground,
    Habits,
    X,
    Y,
    generators_of,
)
from bimvox.live.way import TICK_S, Way

if TYPE_CHECKING:
    from bimvox.live.episode import Episode

_STANDS_S = 4.0
"""Who has been seen at rest for so long dwells."""


@kernel
def blocked_rows(way: Way, crowd: Crowd, near_m: float, horizon: float) -> int:
    """Return the number of rows of a way on which anybody is near the load, at constant velocity.

    Args:
        way: The way, executed without a stop.
        crowd: Everyone, as seen.
        near_m: Who is nearer to the load, in addition to its own radius, counts.
        horizon: Ticks for which they go on at the velocity as seen; then they stay.
    """
    load, found = np.empty(9), 0
    state, seen_m = crowd.state, crowd.seen_m
    for row in range(way.rests.shape[0]):
        placed(way, float(row), 1.0, load)
        for n in range(state.shape[0]):
            ahead_s = min(float(row), horizon) * TICK_S if state[n, STILL_S] < _STANDS_S else 0.0
            x, y = seen_m[n, 0] + ahead_s * state[n, VX], seen_m[n, 1] + ahead_s * state[n, VY]
            if gap_m(load, x, y) <= near_m + state[n, RADIUS]:
                found += 1
                break
    return found


@kernel
def blocked_ticks(way: Way, ground: Ground, habits: Habits, crowd: Crowd, near_m: float) -> int:
    """Return the ticks at which anybody is near the load of a way that is executed without a stop, as others move on.

    Args:
        way: The way.
        ground: Where others go.
        habits: How they behave.
        crowd: Everyone; changed.
        near_m: Who is nearer to the load, in addition to its own radius, counts.
    """
    load, found, state = np.zeros(9), 0, crowd.state
    for row in range(way.rests.shape[0]):
        placed(way, float(row), 1.0, load)
        pass_tick(ground, habits, crowd, 0, 0.0, load, False)
        for n in range(state.shape[0]):
            if gap_m(load, state[n, X], state[n, Y]) <= near_m + state[n, RADIUS]:
                found += 1
                break
    return found


def imagined(episode: Episode, habits: Habits, sample: int) -> Crowd:
    """Return everyone with a drawn future, made only from what is seen and from habits.

    Who stands, dwells for a time drawn anew. Who walks, walks to a place drawn from those ahead.

    Args:
        episode: The episode.
        habits: How they are assumed to behave.
        sample: Number of the future; equal numbers draw equally at one time.
    """
    crowd = episode.future()
    count = len(crowd.state)
    crowd.draws[:] = generators_of((episode.ticks << 12) + sample, 2 * count)
    _imagine(episode.job.ground, habits, crowd)
    return crowd


@kernel
def _imagine(ground: Ground, habits: Habits, crowd: Crowd) -> None:
    state, seen_m, draws = crowd.state, crowd.seen_m, crowd.draws
    for n in range(state.shape[0]):
        state[n, X], state[n, Y] = seen_m[n, 0], seen_m[n, 1]
        for back in range(crowd.was_m.shape[0]):
            crowd.was_m[back, n, 0], crowd.was_m[back, n, 1] = seen_m[n, 0], seen_m[n, 1]
        speed = np.sqrt(state[n, VX] ** 2 + state[n, VY] ** 2)
        stands = state[n, STILL_S] >= _STANDS_S
        if state[n, KIND] == TRACK:
            # Where a recorded track leads is not known: it is taken for a crew.
            state[n, KIND], state[n, HOME] = CREW, 0.0
        if state[n, KIND] == LORRY:
            _imagine_lorry(ground, habits, crowd, n, stands)
            continue
        state[n, HOME] = float(int(random_unit(draws[n : n + 1]) * (ground.areas.shape[0] - 1)))
        if stands:
            state[n, HOME] = float(_area_of(ground, state[n, X], state[n, Y]))
            state[n, DWELLS_S] = max(TICK_S, -habits.dwell_s * np.log(1.0 - random_unit(draws[n : n + 1])))
            continue
        state[n, DWELLS_S] = 0.0
        state[n, SPEED] = min(max(speed, habits.walk_low_m_s), habits.walk_high_m_s)
        _choose_ahead(ground, crowd, n)


@kernel
def _imagine_lorry(ground: Ground, habits: Habits, crowd: Crowd, n: int, stands: bool) -> None:
    state, draws, last = crowd.state, crowd.draws, ground.road_m.shape[0] - 1
    to_gate = np.hypot(state[n, X] - ground.road_m[0, 0], state[n, Y] - ground.road_m[0, 1])
    to_stand = np.hypot(state[n, X] - ground.road_m[last, 0], state[n, Y] - ground.road_m[last, 1])
    if stands:
        mean_s = habits.away_s if to_gate < to_stand else habits.unload_s
        state[n, LEG] = 0.0 if to_gate < to_stand else float(last)
        state[n, DWELLS_S] = max(TICK_S, -mean_s * np.log(1.0 - random_unit(draws[n : n + 1])))
        return
    state[n, DWELLS_S] = 0.0
    inwards = state[n, VX] * (ground.road_m[last, 0] - state[n, X]) + state[n, VY] * (
        ground.road_m[last, 1] - state[n, Y]
    )
    row = last if inwards > 0.0 else 0
    state[n, LEG] = float(row)
    state[n, GOAL_X], state[n, GOAL_Y] = ground.road_m[row, 0], ground.road_m[row, 1]
    state[n, SPEED] = 0.5 * (habits.drive_low_m_s + habits.drive_high_m_s)


@kernel
def _area_of(ground: Ground, x: float, y: float) -> int:
    """Return the area of the nearest work place."""
    best, found = np.inf, 0
    for area in range(ground.areas.shape[0] - 1):
        for place in range(ground.areas[area], ground.areas[area + 1]):
            away = (ground.places_m[place, 0] - x) ** 2 + (ground.places_m[place, 1] - y) ** 2
            if away < best:
                best, found = away, area
    return found


@kernel
def _choose_ahead(ground: Ground, crowd: Crowd, n: int) -> None:
    """Give someone who walks a goal: of some drawn places, the one that lies ahead best."""
    state, best = crowd.state, -np.inf
    speed = np.sqrt(state[n, VX] ** 2 + state[n, VY] ** 2) + 1e-9
    for _ in range(8):
        place = int(random_unit(crowd.draws[n : n + 1]) * ground.places_m.shape[0])
        dx, dy = ground.places_m[place, 0] - state[n, X], ground.places_m[place, 1] - state[n, Y]
        along = (dx * state[n, VX] + dy * state[n, VY]) / (speed * (np.sqrt(dx * dx + dy * dy) + 1e-9))
        if along > best:
            best = along
            state[n, GOAL_X], state[n, GOAL_Y] = ground.places_m[place, 0], ground.places_m[place, 1]
