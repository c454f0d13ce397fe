"""Baselines of the learned policies: random actions, the exact distance field, tabular Q-learning."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.env.actions import ACTION_COUNT
from bimvox.paper.env.batched import BatchedPaperSite
from bimvox.paper.env.layout import PaperLayout
from bimvox.paper.env.site_env import PaperSiteEnv
from bimvox.paper.env.spec import PaperSpec
from bimvox.paper.policy.curve import CurvePoint
from bimvox.paper.policy.episodes import Episode, run_episodes

_RATE = 0.5
"""Share of the new estimate in the table; large, because moves are deterministic."""

_DISCOUNT = 0.99
_EXPLORATION_LAST = 0.02
_EXPLORATION_SHARE = 0.1


def random_policy(spec: PaperSpec, layouts: Sequence[PaperLayout], *, seed: int) -> tuple[Episode, ...]:
    """Return one episode of random actions per layout, judged by the paper's reward."""
    return run_episodes(None, spec, layouts, observation="window", reward="paper", exploration=1.0, seed=seed)


def teacher_moves(spec: PaperSpec, layouts: Sequence[PaperLayout]) -> NDArray[np.int64]:
    """Return the (L,) int64 fewest moves on every layout, by the exact distance field, the teacher of our mode.

    -1 if there is no path, or none within the steps of an episode.
    """
    count = len(layouts)
    batch = BatchedPaperSite(spec, count, observation="window", layouts=layouts, threads=1)
    batch.keep_distance_field()
    batch.reset()
    for n, layout in enumerate(layouts):
        batch.place(n, layout)
    moves = np.full(count, -1, np.int64)
    running = np.ones(count, np.bool_)
    taken = 0
    while running.any():
        step = batch.step(batch.greedy_actions())
        taken += 1
        moves[running & step.terminated] = taken
        running &= ~step.ended
    return moves


def field_seconds(spec: PaperSpec, *, fields: int = 200) -> float:
    """Return the wall time of one exact distance field, for the first component with all others stored."""
    env = PaperSiteEnv(spec)
    env.reset(seed=0)
    env.distance_field()
    began = time.perf_counter()
    for _ in range(fields):
        env.distance_field()
    return (time.perf_counter() - began) / fields


@dataclass(frozen=True, slots=True, eq=False)
class _TabularResult:
    """The result of tabular Q-learning.

    Attributes:
        table: (X, Y, Z, 2, 6) float64 value of each action at each reference cell, on time and late.
        curve: Every test.
        reached: Whether enough test episodes succeeded within the budget.
        steps: Environment steps.
    """

    table: NDArray[np.float64]
    curve: tuple[CurvePoint, ...]
    reached: bool
    steps: int

    @property
    def steps_to_success(self) -> int | None:
        """Steps at the first test that was good enough. None if none was."""
        return self.steps if self.reached else None


class Requirement(NamedTuple):
    """When learning is good enough: ``successes`` of the ``episodes`` of a test succeed."""

    episodes: int
    successes: int
    test_every: int = 2_000


def tabular_q(
    spec: PaperSpec, layouts: Sequence[PaperLayout], *, seed: int, budget: int, required: Requirement
) -> _TabularResult:
    """Learn a table (Watkins 1989) from the paper's reward; steps and tests count as for the networks.

    Episodes are drawn from ``layouts``, in training and in tests. The share of random actions falls from 1 to
    ``_EXPLORATION_LAST`` over the first tenth of the budget, and stays there in tests. The same arguments give the same
    table.

    Raises:
        ValueError: The site has several components, or the layouts have different targets.
    """
    if spec.count != 1 or len({layout.targets for layout in layouts}) != 1:
        raise ValueError("layouts: a table by reference cells serves one component and one target")
    table = np.zeros((*spec.shape, 2, ACTION_COUNT))
    learner = _TableEpisodes(spec, layouts, table, seed)
    tester = _TableEpisodes(spec, layouts, table, seed + 1)
    phase = max(1.0, _EXPLORATION_SHARE * budget)
    curve: list[CurvePoint] = []
    steps, reached = 0, False
    while steps < budget and not reached:
        for _ in range(min(budget, steps + required.test_every) - steps):
            share = 1.0 + min(1.0, steps / phase) * (_EXPLORATION_LAST - 1.0)
            learner.step(share, _RATE)
            steps += 1
        results = [tester.episode() for _ in range(required.episodes)]
        successes = sum(succeeded for succeeded, _ in results)
        curve.append(
            CurvePoint(steps, successes / required.episodes, float(np.mean([reward for _, reward in results])))
        )
        reached = successes >= required.successes
    return _TabularResult(table, tuple(curve), reached, steps)


class _TableEpisodes:
    """Episodes on one site, with actions from a table."""

    def __init__(self, spec: PaperSpec, layouts: Sequence[PaperLayout], table: NDArray[np.float64], seed: int) -> None:
        self._batch = BatchedPaperSite(spec, 1, observation="window", layouts=layouts, threads=1, seed=seed)
        self._limit = spec.steps_before_late
        self._table = table
        self._random = np.random.default_rng(seed)
        self._batch.reset()

    def step(self, exploration: float, rate: float) -> tuple[bool, bool, float]:
        """Take one action, learn from it if ``rate`` is not 0, and return success, end and reward."""
        row = self._row(self._batch.states[0])
        if self._random.random() < exploration:
            action = int(self._random.integers(ACTION_COUNT))
        else:
            action = int(self._random.choice(np.flatnonzero(row == row.max())))
        step = self._batch.step([action])
        reward, done = float(step.rewards[0]), bool(step.terminated[0])
        if rate > 0.0:
            wanted = reward if done else reward + _DISCOUNT * self._row(step.final_states[0]).max()
            row[action] += rate * (wanted - row[action])
        return done, bool(step.ended[0]), reward

    def episode(self) -> tuple[bool, float]:
        """Run one episode without learning, and return success and reward."""
        total, ended, succeeded = 0.0, False, False
        while not ended:
            succeeded, ended, reward = self.step(_EXPLORATION_LAST, 0.0)
            total += reward
        return succeeded, total

    def _row(self, state: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the values at a state, columns as the fields of ``PaperState``; a view."""
        _, x, y, z, _, steps, _ = state
        row: NDArray[np.float64] = self._table[x, y, z, int(steps >= self._limit)]
        return row
