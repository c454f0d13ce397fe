"""Everyone on the site moves by a tick, and is seen."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.env.pool import random_unit
from bimvox.live.pace import gap_m
from bimvox.live.traffic import (
    DWELLS_S,
    GOAL_X,
    GOAL_Y,
    HELD_S,
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
)
from bimvox.live.way import TICK_S

CLOSED_M = 0.5
"""The zone below a load at rest is closed this far around the load and its swing."""
_SHORTEST_S = 20.0
_SMOOTH = 0.15
"""Share of the newest difference of two seen places in the velocity as seen."""
_PATIENCE_S = 20.0
"""Who waits longer at a closed zone goes somewhere else; a lorry leaves the site."""
_WALKS_M_S = 0.4
"""Who is seen faster than this is on the move."""


@kernel
def pass_tick(
    ground: Ground, habits: Habits, crowd: Crowd, delay: int, noise_m: float, load: NDArray[np.float64], closed: bool
) -> None:
    """Move everyone by a tick, then see them.

    Args:
        ground: Where others go.
        habits: How they behave.
        crowd: Everyone; changed.
        delay: Ticks by which they are seen late.
        noise_m: Largest error of a seen place.
        load: Where the load is (``placed``).
        closed: Whether the load is suspended at rest, so that the zone below it is closed: nobody enters it.
    """
    state = crowd.state
    for n in range(state.shape[0]):
        if state[n, KIND] == TRACK:
            x, y = _on_track(ground, state, n)
        else:
            if state[n, DWELLS_S] > 0.0:
                state[n, DWELLS_S] -= TICK_S
                if state[n, DWELLS_S] <= 0.0:
                    _set_out(ground, habits, crowd, n)
                continue
            x, y = _towards_goal(state, n)
        if closed and _goes_nearer(load, state, n, x, y):
            crowd.counts[0] += TICK_S
            state[n, HELD_S] += TICK_S
            if state[n, HELD_S] >= _PATIENCE_S and state[n, KIND] != TRACK:
                _turn_back(ground, habits, crowd, n)
            continue
        state[n, HELD_S] = 0.0
        state[n, X], state[n, Y] = x, y
        if state[n, KIND] == TRACK:
            state[n, DWELLS_S] += TICK_S
        elif x == state[n, GOAL_X] and y == state[n, GOAL_Y]:
            _arrive(ground, habits, crowd, n)
    _see(crowd, delay, noise_m)


@leaf_kernel
def _goes_nearer(load: NDArray[np.float64], state: NDArray[np.float64], n: int, x: float, y: float) -> bool:
    """Return whether someone would enter the closed zone of a load, or go further into its margin."""
    gap = gap_m(load, x, y)
    if gap > load[8] + state[n, RADIUS] + CLOSED_M:
        return False
    return gap <= load[8] + state[n, RADIUS] or gap < gap_m(load, state[n, X], state[n, Y])


@leaf_kernel
def _towards_goal(state: NDArray[np.float64], n: int) -> tuple[float, float]:
    dx, dy = state[n, GOAL_X] - state[n, X], state[n, GOAL_Y] - state[n, Y]
    distance, step = np.sqrt(dx * dx + dy * dy), state[n, SPEED] * TICK_S
    if distance <= step:
        return state[n, GOAL_X], state[n, GOAL_Y]
    return state[n, X] + dx / distance * step, state[n, Y] + dy / distance * step


@leaf_kernel
def _on_track(ground: Ground, state: NDArray[np.float64], n: int) -> tuple[float, float]:
    """Return where a recorded track is a tick later; after its end it stays there."""
    track, last = ground.track, ground.spans[int(state[n, HOME]) + 1] - 1
    row, at_s = int(state[n, LEG]), state[n, DWELLS_S] + TICK_S
    while row < last and track[row + 1, 0] <= at_s:
        row += 1
    state[n, LEG] = row
    if row == last or at_s <= track[row, 0]:
        return track[row, 1], track[row, 2]
    share = (at_s - track[row, 0]) / (track[row + 1, 0] - track[row, 0])
    x = track[row, 1] + share * (track[row + 1, 1] - track[row, 1])
    return x, track[row, 2] + share * (track[row + 1, 2] - track[row, 2])


@kernel
def _set_out(ground: Ground, habits: Habits, crowd: Crowd, n: int) -> None:
    """Give someone whose dwell has ended a new goal and a speed."""
    state, draws = crowd.state, crowd.draws
    if state[n, KIND] == LORRY:
        state[n, LEG] = 1.0 if state[n, LEG] <= 0.0 else -(ground.road_m.shape[0] - 2.0)
        low, high = habits.drive_low_m_s, habits.drive_high_m_s
        row = int(abs(state[n, LEG]))
        state[n, GOAL_X], state[n, GOAL_Y] = ground.road_m[row, 0], ground.road_m[row, 1]
    else:
        if random_unit(draws[n : n + 1]) >= habits.at_home:
            state[n, HOME] = float(int(random_unit(draws[n : n + 1]) * (ground.areas.shape[0] - 1)))
        first, last = ground.areas[int(state[n, HOME])], ground.areas[int(state[n, HOME]) + 1]
        place = first + int(random_unit(draws[n : n + 1]) * (last - first))
        state[n, GOAL_X], state[n, GOAL_Y] = ground.places_m[place, 0], ground.places_m[place, 1]
        low, high = habits.walk_low_m_s, habits.walk_high_m_s
    state[n, SPEED] = low + random_unit(draws[n : n + 1]) * (high - low)


@kernel
def _turn_back(ground: Ground, habits: Habits, crowd: Crowd, n: int) -> None:
    """Give someone who has waited for long at a closed zone another goal."""
    state = crowd.state
    state[n, HELD_S] = 0.0
    if state[n, KIND] == LORRY:
        state[n, LEG] = 0.0
        state[n, GOAL_X], state[n, GOAL_Y] = ground.road_m[0, 0], ground.road_m[0, 1]
    else:
        _set_out(ground, habits, crowd, n)


@kernel
def _arrive(ground: Ground, habits: Habits, crowd: Crowd, n: int) -> None:
    """Begin a dwell, or take the next leg of the road: a negative leg leads out."""
    state, draws = crowd.state, crowd.draws
    mean_s = habits.dwell_s
    if state[n, KIND] == LORRY:
        row, last = int(abs(state[n, LEG])), ground.road_m.shape[0] - 1
        if 0 < row < last:
            state[n, LEG] += 1.0
            row = int(abs(state[n, LEG]))
            state[n, GOAL_X], state[n, GOAL_Y] = ground.road_m[row, 0], ground.road_m[row, 1]
            return
        mean_s = habits.unload_s if row == last else habits.away_s
        state[n, LEG] = float(row)
    state[n, DWELLS_S] = max(_SHORTEST_S, -mean_s * np.log(1.0 - random_unit(draws[n : n + 1])))


@kernel
def _see(crowd: Crowd, delay: int, noise_m: float) -> None:
    """Note the places, and see those of ``delay`` ticks ago with an error of at most ``noise_m``."""
    state, was_m, seen_m, draws = crowd.state, crowd.was_m, crowd.seen_m, crowd.draws
    count = state.shape[0]
    for back in range(was_m.shape[0] - 1, 0, -1):
        for n in range(count):
            was_m[back, n, 0], was_m[back, n, 1] = was_m[back - 1, n, 0], was_m[back - 1, n, 1]
    for n in range(count):
        was_m[0, n, 0], was_m[0, n, 1] = state[n, X], state[n, Y]
        own = draws[count + n : count + n + 1]
        far, angle = noise_m * np.sqrt(random_unit(own)), 2.0 * np.pi * random_unit(own)
        x, y = was_m[delay, n, 0] + far * np.cos(angle), was_m[delay, n, 1] + far * np.sin(angle)
        vx, vy = (x - seen_m[n, 0]) / TICK_S, (y - seen_m[n, 1]) / TICK_S
        seen_m[n, 0], seen_m[n, 1] = x, y
        state[n, VX] += _SMOOTH * (vx - state[n, VX])
        state[n, VY] += _SMOOTH * (vy - state[n, VY])
        speed = np.sqrt(state[n, VX] ** 2 + state[n, VY] ** 2)
        state[n, STILL_S] = 0.0 if speed > _WALKS_M_S else state[n, STILL_S] + TICK_S
