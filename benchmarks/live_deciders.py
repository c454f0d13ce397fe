"""Deciders that the live site is measured against: Monte Carlo roll-outs of drawn futures, and an oracle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bimvox.compiled import kernel
from bimvox.env.pool import random_unit
from bimvox.live.episode import CHOICES, WAIT, WAIT_S, Episode, Stage
from bimvox.live.shield import LOAD_COLUMNS, carry, idle
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
    copied,
    generators_of,
    pass_tick,
    ticks_of,
)
from bimvox.live.way import TICK_S, Way, gap_m, placed, seconds_of

_KNOWN = Habits()
_PATIENCE_S = 1800.0
_NO_TAPE = np.zeros((0, 2))
_STANDS_S = 4.0
"""Who has been seen at rest for so long dwells."""


@dataclass(frozen=True, slots=True)
class MonteCarlo:
    """Rolls out drawn futures of the others, and takes the candidate with the least mean cost over them.

    The cost is that of ``Rules``, with the others where they are in that future when the load gets there.

    Attributes:
        samples: Futures, the same ones for all candidates.
        habits: How the others are assumed to behave.
        near_m: Who is nearer to the load, in addition to its own radius, is in the way.
        weight: Cost of a second of the way on which somebody is in the way, in seconds.
        waits: Waiting is tried at most this often in a row.
    """

    samples: int = 8
    habits: Habits = _KNOWN
    near_m: float = 4.0
    weight: float = 2.0
    waits: int = 3

    def __call__(self, episode: Episode) -> int:
        """Return the candidate with the least mean cost."""
        possible = _options(episode, self.waits, CHOICES)
        if len(possible) == 1:
            return possible[0][0]
        blocked = np.zeros(len(possible))
        for sample in range(self.samples):
            start = imagined(episode, self.habits, sample)
            for n, (_, lift, way, lead_s) in enumerate(possible):
                crowd = copied(start)
                let_pass(episode, crowd, self.habits, lead_s)
                chosen = episode.job.lifts[lift].ways[way]
                blocked[n] += _blocked_ticks(chosen, episode.job.ground, self.habits, crowd, self.near_m)
        costs = [
            lead_s + seconds_of(episode.job.lifts[lift].ways[way]) - _usual_s(episode, lift)
            for _, lift, way, lead_s in possible
        ]
        best = int(np.argmin(np.array(costs) + self.weight * TICK_S * blocked / self.samples))
        return possible[best][0]


@dataclass(frozen=True, slots=True)
class Oracle:
    """Knows what everybody will do, and takes what is in place soonest: a bound for what knowledge can bring, greedy.

    Attributes:
        waits: Waiting is tried at most this often in a row.
    """

    waits: int = 12

    def __call__(self, episode: Episode) -> int:
        """Return the candidate that loses least time."""
        found: dict[int, float] = {}
        for choice, lift, way, lead_s in _options(episode, self.waits, len(episode.job.lifts)):
            spent_s = imagined_s(episode, lead_s, lift, way)
            found[choice] = min(spent_s - _usual_s(episode, lift), found.get(choice, np.inf))
        return min(found, key=found.__getitem__)


def _options(episode: Episode, waits: int, tried: int) -> list[tuple[int, int, int, float]]:
    """Return what can be decided: choice, lift, way, and seconds until its load can be raised."""
    if episode.stage is Stage.LIFT:
        lifts = [(n, episode.job.lifts[n]) for n in episode.candidates[:tried]]
        return [(n, n, way, episode.lead_s(n)) for n, lift in lifts for way in range(len(lift.ways))]
    assert episode.hooked is not None
    found = [(way, episode.hooked, way, 0.0) for way in episode.candidates]
    if episode.waited < waits:
        found += [(WAIT, episode.hooked, way, WAIT_S) for way in episode.candidates]
    return found


def _usual_s(episode: Episode, lift: int) -> float:
    """Return the part of a lift's time that no decision changes: attaching the slings, and the planned way."""
    one = episode.job.lifts[lift]
    return seconds_of(one.ways[0]) + (one.hook_on_s if episode.stage is Stage.LIFT else 0.0)


def let_pass(episode: Episode, crowd: Crowd, habits: Habits, seconds: float) -> None:
    """Let time pass in an imagined future."""
    idle(episode.job.ground, habits, crowd, episode.sight, ticks_of(seconds), np.zeros(LOAD_COLUMNS), _NO_TAPE)


def imagined_s(episode: Episode, lead_s: float, lift: int, way: int) -> float:
    """Return how long a lift takes from now until its load is in place, as it will be: for an oracle alone.

    Args:
        episode: The episode.
        lead_s: How long it takes until the load can be raised.
        lift: The position of the lift.
        way: The number of its way.
    """
    crowd, habits, job = copied(episode.crowd), episode.habits, episode.job
    let_pass(episode, crowd, habits, lead_s)
    limits = (0, ticks_of(_PATIENCE_S))
    spent = carry(job.lifts[lift].ways[way], job.ground, habits, crowd, episode.sight, limits, episode.room, _NO_TAPE)
    return (ticks_of(lead_s) + spent) * TICK_S


@kernel
def _blocked_ticks(way: Way, ground: Ground, habits: Habits, crowd: Crowd, near_m: float) -> int:
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
    crowd = copied(episode.crowd)
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
