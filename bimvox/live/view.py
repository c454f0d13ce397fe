"""What a learner sees of a decision: a row of figures for each candidate, for waiting, and for the episode."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.live.episode import CHOICES, WAIT, Episode, Stage
from bimvox.live.forecast import blocked_rows
from bimvox.live.traffic import KIND, STILL_S, VX, VY
from bimvox.live.way import TICK_S, Way, seconds_of

FEATURES = 12
"""Of a candidate: 1; seconds until its load can be raised; seconds of its way; shares of its way on which somebody is
nearer than 6 m and than 12 m now, and nearer than 6 m at constant velocity; distances of the nearest to pick and place;
their speeds, and how long they have been seen at rest."""
SIZE = CHOICES * FEATURES + 6
_NEAR_M, _WIDE_M, _HORIZON = 6.0, 12.0, 30.0


def view_of(episode: Episode) -> NDArray[np.float32]:
    """Return (SIZE,) float32 in [-1, 1]: the candidates in order, then the stage, waits, progress, and who is there."""
    view = np.zeros(SIZE)
    for row, candidate in enumerate(episode.candidates):
        view[row * FEATURES : (row + 1) * FEATURES] = _features(episode, candidate)
    state = episode.crowd.state
    view[-6:] = (
        1.0 if episode.stage is Stage.WAY else -1.0,
        episode.waited / 10.0,
        len(episode.done) / len(episode.job.lifts),
        len(episode.candidates) / CHOICES,
        float((state[:, KIND] != 1).sum()) / 10.0,
        float((state[:, STILL_S] > 5.0).mean()) if len(state) else 0.0,
    )
    return np.clip(view, -1.0, 1.0).astype(np.float32)


def mask_of(episode: Episode) -> NDArray[np.bool_]:
    """Return (CHOICES + 1,) which actions are candidates; the last one, to wait, always is."""
    mask = np.zeros(CHOICES + 1, np.bool_)
    mask[: len(episode.candidates)] = True
    mask[CHOICES] = True
    return mask


def decision_of(episode: Episode, action: int) -> int:
    """Return the decision of an action; an action that is not a candidate waits."""
    candidates = episode.candidates
    return candidates[action] if action < len(candidates) else WAIT


def _features(episode: Episode, candidate: int) -> NDArray[np.float64]:
    if episode.stage is Stage.WAY:
        lift, way = episode.lift, episode.lift.ways[candidate]
    else:
        lift = episode.job.lifts[candidate]
        way = lift.ways[0]
    crowd, rows = episode.crowd, len(way.rests)
    pick, place = _nearest(episode, way, 0), _nearest(episode, way, -1)
    return np.array(
        [
            1.0,
            episode.lead_s(candidate) / 300.0,
            seconds_of(way) / 150.0,
            blocked_rows(way, crowd, _NEAR_M, 0.0) / rows,
            blocked_rows(way, crowd, _WIDE_M, 0.0) / rows,
            blocked_rows(way, crowd, _NEAR_M, _HORIZON / TICK_S) / rows,
            *pick,
            *place,
        ]
    )


def _nearest(episode: Episode, way: Way, row: int) -> tuple[float, float, float]:
    """Return distance, speed and seconds at rest of who is nearest to the hook at an end of a way."""
    state, seen_m = episode.crowd.state, episode.crowd.seen_m
    if not len(state):
        return 1.0, 0.0, 1.0
    away_m = np.hypot(*(seen_m - way.hook_m[row]).T)
    n = int(np.argmin(away_m))
    return away_m[n] / 40.0, float(np.hypot(state[n, VX], state[n, VY])) / 2.0, state[n, STILL_S] / 300.0
