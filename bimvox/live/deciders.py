"""Who decides: rules on what is seen now, rules with prediction, Monte Carlo roll-outs, and an oracle."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bimvox.live.episode import CHOICES, WAIT, WAIT_S, Episode, Stage
from bimvox.live.forecast import blocked_rows, blocked_ticks, imagined
from bimvox.live.traffic import Habits, copied
from bimvox.live.way import TICK_S, Way, seconds_of

Decider = Callable[[Episode], int]
"""From an episode that is not over to a candidate, or ``WAIT``."""

_KNOWN = Habits()


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
        possible = options(episode, self.waits, CHOICES)
        if len(possible) == 1:
            return possible[0][0]
        blocked = np.zeros(len(possible))
        for sample in range(self.samples):
            start = imagined(episode, self.habits, sample)
            for n, (_, lift, way, lead_s) in enumerate(possible):
                crowd = copied(start)
                episode.let_pass(crowd, self.habits, lead_s)
                chosen = episode.job.lifts[lift].ways[way]
                blocked[n] += blocked_ticks(chosen, episode.job.ground, self.habits, crowd, self.near_m)
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
        for choice, lift, way, lead_s in options(episode, self.waits, len(episode.job.lifts)):
            spent_s = episode.imagined_s(episode.future(), episode.habits, lead_s, lift, way)
            found[choice] = min(spent_s - _usual_s(episode, lift), found.get(choice, np.inf))
        return min(found, key=found.__getitem__)


def options(episode: Episode, waits: int, tried: int) -> list[tuple[int, int, int, float]]:
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
