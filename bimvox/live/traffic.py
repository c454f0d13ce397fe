"""People and lorries on a site: where they go, how they behave, and where they are now."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.live.way import TICK_S

CREW, LORRY, TRACK = 0, 1, 2
"""Kinds: a crew that walks as one, a lorry, and something that follows a recorded track."""

X, Y, GOAL_X, GOAL_Y, SPEED, DWELLS_S, LEG, KIND, RADIUS, FASTEST, HOME, VX, VY, STILL_S, HELD_S = range(15)
"""Columns of ``Crowd.state``: place, goal (m), speed (m/s), rest of a dwell (s; of a track: its time), leg of the road
(of a track: its row), kind, radius of the disc around it (m), highest speed that is assumed (m/s), number of the area
where a crew works, velocity as seen (m/s), how long it has been seen at rest, and how long it
waits at a closed zone (s)."""
COLUMNS = 15


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
        state: (N, COLUMNS) float64.
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

    Args:
        ground: Where others go.
        density: How many there are, besides the recorded tracks.
        sight: How they are seen.
        seed: Chooses everything that is random, now and later.
    """
    tracks = len(ground.spans) - 1
    count = density.crews + density.lorries + tracks
    draw = np.random.default_rng(seed)
    state = np.zeros((count, COLUMNS))
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
