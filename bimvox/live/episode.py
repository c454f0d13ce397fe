"""One run over a job in traffic: somebody decides which lift is next, which way it takes, and when to wait."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from bimvox.errors import shown
from bimvox.live.shield import LOAD_COLUMNS, carry, idle, prediction_room
from bimvox.live.traffic import Crowd, Density, Ground, Habits, Sight, crowd_of, ticks_of
from bimvox.live.way import TICK_S, Way, seconds_of


@dataclass(frozen=True, slots=True, eq=False)
class LiveLift:
    """One lift.

    Attributes:
        number: Its number in the plan, from 1.
        name: The part's name.
        ways: Its proven ways, the planned one first.
        hook_on_s: How long the crew attaches the slings.
        fix_s: How long the load is aligned, fixed and released at its place.
        earlier: Positions in ``LiveJob.lifts`` of those that must be set before.
    """

    number: int
    name: str
    ways: tuple[Way, ...]
    hook_on_s: float
    fix_s: float
    earlier: frozenset[int] = frozenset()


@dataclass(frozen=True, slots=True, eq=False)
class LiveJob:
    """Lifts of one crane in the order of the plan, and the ground on which others move.

    Attributes:
        name: Name of the site.
        lifts: The lifts.
        approach_s: (N + 1, N) float64 how long the empty hook takes to a pick: in row 0 at the start, in row n + 1 from
            the place of lift n.
        ground: Where others go.
    """

    name: str
    lifts: tuple[LiveLift, ...]
    approach_s: NDArray[np.float64]
    ground: Ground

    def ready(self, done: Iterable[int]) -> tuple[int, ...]:
        """Return the positions of the lifts that may be next, in the order of the plan."""
        left = frozenset(range(len(self.lifts))) - (gone := frozenset(done))
        return tuple(n for n in sorted(left) if self.lifts[n].earlier <= gone)

    def usual_s(self, n: int) -> float:
        """Return how long a lift takes in the order of the plan, on its planned way, without traffic."""
        lift = self.lifts[n]
        return float(self.approach_s[n, n]) + lift.hook_on_s + seconds_of(lift.ways[0]) + lift.fix_s

    @property
    def undisturbed_s(self) -> float:
        """How long all lifts take so."""
        return sum(self.usual_s(n) for n in range(len(self.lifts)))


WAIT = -1
"""The decision to wait for ``WAIT_S``."""
WAIT_S = 10.0

CHOICES = 8
"""Most candidates of a decision: the first lifts of the plan that may be next, or the ways of a lift."""

_GIVE_UP = 4.0
"""An episode is cut after this multiple of the time without traffic."""
_NO_TAPE = np.zeros((0, 2))
_NO_LOAD = np.zeros(LOAD_COLUMNS)
_SIGHT, _HABITS = Sight(), Habits()


class Stage(StrEnum):
    """What is decided."""

    LIFT = "lift"
    """Which of the ready lifts is next: the hook then goes there, and the crew attaches the slings."""
    WAY = "way"
    """Which way the load takes, now that it could be raised."""
    OVER = "over"


class Episode:
    """A run over a job, deterministic from its seed and the decisions.

    Args:
        job: The lifts and the ground.
        density: How much traffic there is.
        seed: Of the traffic.
        habits: How others behave.
        sight: How they are seen.
        taped: Whether every tick is recorded.
        limit: After how many ticks it is cut; None: after a multiple of the time without traffic.

    Attributes:
        tape: (T, 2 + 4 N) what ``carry`` records, a row a tick, if it is ``taped``.
    """

    def __init__(
        self,
        job: LiveJob,
        density: Density,
        seed: int,
        *,
        habits: Habits = _HABITS,
        sight: Sight = _SIGHT,
        taped: bool = False,
        limit: int | None = None,
    ) -> None:
        self.job, self.habits, self.sight = job, habits, sight
        self.crowd: Crowd = crowd_of(job.ground, density, sight, seed)
        self.room = prediction_room()
        self.ticks, self.waited, self.before = 0, 0, -1
        self.done: list[int] = []
        self.hooked: int | None = None
        self.limit = ticks_of(_GIVE_UP * job.undisturbed_s) if limit is None else limit
        self.tape = _NO_TAPE
        if taped:
            longest_s = max(map(job.usual_s, range(len(job.lifts))))  # the last lift may begin just before the limit
            self.tape = np.zeros((self.limit + 4 * ticks_of(longest_s), 2 + 4 * len(self.crowd.state)))

    @property
    def stage(self) -> Stage:
        """What is to be decided."""
        if len(self.done) == len(self.job.lifts) or self.ticks >= self.limit:
            return Stage.OVER
        return Stage.LIFT if self.hooked is None else Stage.WAY

    @property
    def candidates(self) -> tuple[int, ...]:
        """What can be decided: positions of lifts in the job, or numbers of ways of the lift on the hook."""
        if self.hooked is not None:
            return tuple(range(len(self.job.lifts[self.hooked].ways)))[:CHOICES]
        return self.job.ready(self.done)[:CHOICES]

    @property
    def lift(self) -> LiveLift:
        """The lift on the hook."""
        assert self.hooked is not None
        return self.job.lifts[self.hooked]

    @property
    def time_s(self) -> float:
        """How long the episode has taken."""
        return self.ticks * TICK_S

    @property
    def behind_s(self) -> float:
        """How much longer it has taken so far than what is done takes without traffic, as planned."""
        usual_s = sum(self.job.usual_s(n) for n in self.done)
        if self.hooked is not None:
            usual_s += float(self.job.approach_s[self.hooked, self.hooked]) + self.lift.hook_on_s
        return self.time_s - usual_s

    @property
    def lost_s(self) -> float:
        """Seconds lost a lift: beyond the time without traffic, in the plan's order and on the planned ways."""
        if self.stage is Stage.OVER:
            return (self.time_s - self.job.undisturbed_s) / len(self.job.lifts)
        return self.behind_s / max(1, len(self.done))

    @property
    def is_cut(self) -> bool:
        """Whether it was given up before the last lift."""
        return self.stage is Stage.OVER and len(self.done) < len(self.job.lifts)

    @property
    def held_s(self) -> float:
        """How long others waited at closed zones, together."""
        return float(self.crowd.counts[0])

    @property
    def violations(self) -> int:
        """Ticks at which anyone was under a suspended load, or a vehicle was."""
        return int(self.crowd.counts[1])

    def lead_s(self, candidate: int) -> float:
        """Return how long it takes until the load of a lift can be raised."""
        if self.hooked is not None:
            return 0.0
        return float(self.job.approach_s[self.before + 1, candidate]) + self.job.lifts[candidate].hook_on_s

    def decide(self, choice: int) -> None:
        """Carry out a decision: a candidate, or ``WAIT``.

        Raises:
            ValueError: If it is neither.
        """
        if choice == WAIT:
            self._pass(ticks_of(WAIT_S))
            self.waited += 1
            return
        if choice not in self.candidates:
            raise ValueError(f"decision {choice}: the candidates are {shown(self.candidates)}, and {WAIT} to wait")
        self.waited = 0
        if self.hooked is None:
            self._pass(ticks_of(self.lead_s(choice)))
            self.hooked = choice
            return
        left = self.limit - self.ticks
        fix = ticks_of(self.lift.fix_s)
        self.ticks += carry(
            self.lift.ways[choice],
            self.job.ground,
            self.habits,
            self.crowd,
            self.sight,
            (fix, max(1, left)),
            self.room,
            self.tape[self.ticks :],
        )
        self.before, self.hooked = self.hooked, None
        if self.ticks < self.limit:
            self.done.append(self.before)

    def _pass(self, ticks: int) -> None:
        idle(self.job.ground, self.habits, self.crowd, self.sight, ticks, _NO_LOAD, self.tape[self.ticks :])
        self.ticks += ticks
