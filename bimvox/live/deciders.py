"""Who decides: rules on what is seen now, and at constant velocity."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bimvox.compiled import kernel
from bimvox.live.episode import WAIT, Episode, Stage
from bimvox.live.traffic import (
    RADIUS,
    STILL_S,
    VX,
    VY,
    Crowd,
)
from bimvox.live.way import TICK_S, Way, gap_m, placed, seconds_of

if TYPE_CHECKING:
    pass


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
    load, result = np.empty(9), 0
    state, seen_m = crowd.state, crowd.seen_m
    for row in range(way.rests.shape[0]):
        placed(way, float(row), 1.0, load)
        for n in range(state.shape[0]):
            ahead_s = min(float(row), horizon) * TICK_S if state[n, STILL_S] < _STANDS_S else 0.0
            x, y = seen_m[n, 0] + ahead_s * state[n, VX], seen_m[n, 1] + ahead_s * state[n, VY]
            if gap_m(load, x, y) <= near_m + state[n, RADIUS]:
                result += 1
                break
    return result


Decider = Callable[[Episode], int]
"""From an episode that is not over to a candidate, or ``WAIT``."""


def stop_and_wait(episode: Episode) -> int:
    """Take the lifts in the plan's order on the planned ways, at once; the shield stops the crane."""
    return episode.candidates[0]


@dataclass(frozen=True, slots=True)
class Rules:
    """A rule on where others are seen, or will be at constant velocity.

    A lift costs its time until it can be set, and more for every second of its way on which somebody is near the load.
    The default is the rule recommended in docs/live.md.

    Attributes:
        chooses_lift: Whether it chooses the next lift; otherwise it keeps the plan's order.
        near_m: Who is nearer to the load, in addition to its own radius, is in the way.
        weight: Cost of a second of the way on which somebody is in the way, in seconds.
        horizon_s: For how long others are assumed to go on as seen; 0: they stay where they are.
        blocked_s: It waits while more of the best way is blocked than this.
        waits: It waits at most this often in a row.
    """

    chooses_lift: bool = True
    near_m: float = 7.0
    weight: float = 2.0
    horizon_s: float = 0.0
    blocked_s: float = 30.0
    waits: int = 3

    def __call__(self, episode: Episode) -> int:
        """Return the cheapest candidate, or wait if its way is blocked."""
        if episode.stage is Stage.LIFT:
            if not self.chooses_lift:
                return episode.candidates[0]
            costs = [
                episode.lead_s(n)
                + min(self._cost(episode, way) for way in episode.job.lifts[n].ways)
                - seconds_of(episode.job.lifts[n].ways[0])
                for n in episode.candidates
            ]
            return episode.candidates[int(np.argmin(costs))]
        ways = episode.lift.ways
        best = min(episode.candidates, key=lambda n: self._cost(episode, ways[n]))
        if episode.waited < self.waits and self._blocked_s(episode, ways[best]) > self.blocked_s:
            return WAIT
        return best

    def _cost(self, episode: Episode, way: Way) -> float:
        return seconds_of(way) + self.weight * self._blocked_s(episode, way)

    def _blocked_s(self, episode: Episode, way: Way) -> float:
        # While the hook is still on its way to a lift, the others' velocity of now says nothing.
        horizon = 0.0 if episode.stage is Stage.LIFT else self.horizon_s / TICK_S
        return blocked_rows(way, episode.crowd, self.near_m, horizon) * TICK_S
