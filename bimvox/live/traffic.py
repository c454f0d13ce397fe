"""People and lorries on a site: where they go, how they behave, where they are now, and how they move and are seen."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.env.pool import random_unit
from bimvox.live.way import TICK_S, gap_m

CREW, LORRY, TRACK = 0, 1, 2
"""Kinds: a crew that walks as one, a lorry, and something that follows a recorded track."""

X, Y, GOAL_X, GOAL_Y, SPEED, DWELLS_S, LEG, KIND, RADIUS, FASTEST, HOME, VX, VY, STILL_S, _HELD_S = range(15)
"""Columns of ``Crowd.state``: place, goal (m), speed (m/s), rest of a dwell (s; of a track: its time), leg of the road
(of a track: its row), kind, radius of the disc around it (m), highest speed that is assumed (m/s), number of the area
where a crew works, velocity as seen (m/s), how long it has been seen at rest, and how long it
waits at a closed zone (s)."""
_COLUMNS = 15


class Ground(NamedTuple):
    """Where others go on a site.

    Attributes:
        places_m: (P, 2) float64 where crews work, the ones of an area next to each other.
        areas: (A + 1,) int64 the first place of each area, and P.
        road_m: (R, 2) float64 the lorries' road, from outside the site to where they stand.
        track: (T, 3) float64 time (s), x and y (m) of recorded tracks, one after the other.
        spans: (K + 1,) int64 the first row of each track, and T.
        large: (K,) bool whether a track is a vehicle's.
    """

    places_m: NDArray[np.float64]
    areas: NDArray[np.int64]
    road_m: NDArray[np.float64]
    track: NDArray[np.float64]
    spans: NDArray[np.int64]
    large: NDArray[np.bool_]


NO_TRACK = (np.zeros((0, 3)), np.zeros(1, np.int64), np.zeros(0, np.bool_))
"""No recorded tracks, as the last fields of ``Ground``."""


class Habits(NamedTuple):
    """How others behave: what a simulation draws from, and what a forecast assumes.

    Attributes:
        walk_low_m_s: Lowest speed of a walk.
        walk_high_m_s: Highest speed of a walk.
        dwell_s: Mean time at a work place (exponential, at least 20 s).
        at_home: Share of the walks within the area where a crew works; otherwise it goes to work in another one.
        drive_low_m_s: Lowest speed of a lorry.
        drive_high_m_s: Highest speed of a lorry.
        unload_s: Mean time of a lorry at its stand.
        away_s: Mean time between two lorries.
    """

    walk_low_m_s: float = 0.7
    walk_high_m_s: float = 1.4
    dwell_s: float = 120.0
    at_home: float = 0.7
    drive_low_m_s: float = 0.8
    drive_high_m_s: float = 1.4
    unload_s: float = 420.0
    away_s: float = 900.0


class Sight(NamedTuple):
    """What is known of others, and what the shield assumes.

    Attributes:
        delay: Ticks by which positions are seen late.
        noise_m: Largest error of a seen position.
    """

    delay: int = 1
    noise_m: float = 0.3


class Crowd(NamedTuple):
    """Everyone on the site at one time. A copy of its arrays has the same future.

    Attributes:
        state: (N, _COLUMNS) float64.
        was_m: (D + 1, N, 2) float64 true places, now first.
        seen_m: (N, 2) float64 places as seen now.
        draws: (2 N,) uint64 generators: N for what they do, N for the errors of what is seen.
        counts: (3,) float64 seconds that someone waits at the zone of a load at rest; ticks at which a suspended load
            was over someone or something; ticks at which the crane yielded.
    """

    state: NDArray[np.float64]
    was_m: NDArray[np.float64]
    seen_m: NDArray[np.float64]
    draws: NDArray[np.uint64]
    counts: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Density:
    """How much traffic there is.

    Attributes:
        crews: Number of crews.
        lorries: Number of lorries that come and go.
    """

    crews: int
    lorries: int


DENSITIES = {"light": Density(1, 1), "medium": Density(2, 1), "heavy": Density(4, 1)}

CREW_RADIUS_M, LORRY_RADIUS_M = 0.6, 4.2
"""Discs that contain a crew of two, and a lorry of 8.0 m by 2.5 m."""
WALK_LIMIT_M_S, DRIVE_LIMIT_M_S = 1.5, 1.5
"""Highest speeds that the shield assumes: brisk walking, and walking pace for vehicles on the site."""


def crowd_of(ground: Ground, density: Density, sight: Sight, seed: int) -> Crowd:
    """Return the traffic of a seed at its start: crews at work places, lorries on their way; tracks at their start.

    ``density``: how many there are, besides the recorded tracks; ``seed``: chooses everything that is random, now and
    later.
    """
    tracks = len(ground.spans) - 1
    count = density.crews + density.lorries + tracks
    draw = np.random.default_rng(seed)
    state = np.zeros((count, _COLUMNS))
    for n in range(density.crews):
        home = int(draw.integers(len(ground.areas) - 1))
        state[n, :2] = ground.places_m[draw.integers(ground.areas[home], ground.areas[home + 1])]
        state[n, [KIND, RADIUS, FASTEST, HOME]] = CREW, CREW_RADIUS_M, WALK_LIMIT_M_S, home
        state[n, DWELLS_S] = draw.exponential(Habits().dwell_s)
    for n in range(density.crews, density.crews + density.lorries):
        state[n, :2] = ground.road_m[0]
        state[n, [KIND, RADIUS, FASTEST]] = LORRY, LORRY_RADIUS_M, DRIVE_LIMIT_M_S
        state[n, DWELLS_S] = draw.uniform(0.0, Habits().away_s)
    for k in range(tracks):
        n, first = density.crews + density.lorries + k, int(ground.spans[k])
        state[n, :2] = ground.track[first, 1:]
        state[n, KIND] = TRACK
        state[n, RADIUS] = LORRY_RADIUS_M if ground.large[k] else CREW_RADIUS_M
        state[n, FASTEST] = DRIVE_LIMIT_M_S if ground.large[k] else WALK_LIMIT_M_S
        state[n, [LEG, HOME]] = first, k
    state[:, GOAL_X], state[:, GOAL_Y] = state[:, X], state[:, Y]
    was_m = np.repeat(state[None, :, :2], sight.delay + 1, axis=0)
    return Crowd(state, was_m, was_m[0].copy(), generators_of(seed, 2 * count), np.zeros(3))


def copied(crowd: Crowd) -> Crowd:
    """Return a copy with the same future."""
    state, was_m, seen_m, draws, counts = crowd
    return Crowd(state.copy(), was_m.copy(), seen_m.copy(), draws.copy(), counts.copy())


def ticks_of(seconds: float) -> int:
    """Return the number of whole ticks that last at least so long."""
    return int(np.ceil(seconds / TICK_S - 1e-9))


def generators_of(seed: int, count: int) -> NDArray[np.uint64]:
    """Return (N,) uint64 generators of a seed, one a row, so that a copy of a crowd draws the same."""
    return np.random.default_rng(seed).integers(2**64, size=count, dtype=np.uint64)


_CLOSED_M = 0.5
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
            state[n, _HELD_S] += TICK_S
            if state[n, _HELD_S] >= _PATIENCE_S and state[n, KIND] != TRACK:
                _turn_back(ground, habits, crowd, n)
            continue
        state[n, _HELD_S] = 0.0
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
    if gap > load[8] + state[n, RADIUS] + _CLOSED_M:
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
    state[n, _HELD_S] = 0.0
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
