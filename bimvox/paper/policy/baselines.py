"""What the learned policies are measured against: acting at random, the exact distance field, tabular Q-learning."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bimvox.env.actions import ACTION_COUNT
from bimvox.env.distance import distance_field
from bimvox.grid.summed_area import summed_area_table
from bimvox.paper.env.batched import BatchedPaperSite
from bimvox.paper.env.layout import PaperLayout
from bimvox.paper.env.spec import PaperSpec
from bimvox.paper.policy.episodes import Episode, run_episodes
from bimvox.paper.policy.learning import CurvePoint
from bimvox.site.collision import CollisionSpace


def random_policy(spec: PaperSpec, layouts: Sequence[PaperLayout], *, seed: int) -> tuple[Episode, ...]:
    """Act at random, one episode of every layout, judged by the paper's reward."""
    return run_episodes(None, spec, layouts, observation="window", reward="paper", exploration=1.0, seed=seed)


def teacher_moves(spec: PaperSpec, layouts: Sequence[PaperLayout]) -> NDArray[np.int64]:
    """Go down the exact distance field of every layout: what our mode is taught by, and the shortest path there is.

    Returns:
        (L,) int64 moves needed; -1 where there is no way, or none within the steps of an episode.
    """
    count = len(layouts)
    batch = BatchedPaperSite(spec, count, observation="window", layouts=layouts, threads=1, teacher=True)
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
    """Measure the wall time of one exact distance field, of the first component among all others stored."""
    batch = BatchedPaperSite(spec, 1, observation="window", threads=1)
    batch.reset()
    part = spec.in_building_order().components[0]
    layout = batch.layout(0)
    size = np.array(part.size_vox, np.int32)
    nothing = np.zeros(3, np.int32)
    space = CollisionSpace(
        summed_area_table(batch.cells(0) != 0),
        np.concatenate([nothing, size])[None],
        nothing,
        np.zeros(spec.shape[:2], np.int32),
        nothing,
        np.zeros((0, 0, 0), np.bool_),
    )
    target = np.array(layout.targets[0], np.int32)
    distance_field(space, target)
    began = time.perf_counter()
    for _ in range(fields):
        distance_field(space, target)
    return (time.perf_counter() - began) / fields


@dataclass(frozen=True, slots=True, eq=False)
class TabularResult:
    """What tabular Q-learning came to.

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
        """Steps at the test that was good enough, None where none was."""
        return self.steps if self.reached else None


def tabular_q(
    spec: PaperSpec,
    layouts: Sequence[PaperLayout],
    *,
    seed: int,
    budget: int,
    test_episodes: int,
    required_successes: int,
    test_every: int = 2_000,
    rate: float = 0.5,
    discount: float = 0.99,
    exploration_last: float = 0.02,
    exploration_share: float = 0.1,
    initial: NDArray[np.float64] | None = None,
) -> TabularResult:
    """Learn a table (Watkins 1989) from the paper's reward, its steps counted and tested as those of the networks are.

    Args:
        spec: A site with one component.
        layouts: What episodes are drawn from, in training and in tests; the target must be the same in all.
        seed: Same arguments, same seed: same table.
        budget: Steps.
        test_episodes: Episodes of a test, each with ``exploration_last`` random actions.
        required_successes: How many of them end the learning.
        test_every: Steps between two tests.
        rate: Share of the new estimate in the table: moves do what they say, so it may be large.
        discount: Per step.
        exploration_last: Share of random actions after the exploration phase; it begins with 1.
        exploration_share: Length of that phase as a share of the budget.
        initial: Table to begin from.

    Raises:
        ValueError: The site has several components, or the layouts have different targets.
    """
    if spec.count != 1 or len({layout.targets for layout in layouts}) != 1:
        raise ValueError("layouts: a table by reference cells serves one component and one target")
    table = np.zeros((*spec.shape, 2, ACTION_COUNT)) if initial is None else initial.copy()
    learner = _TableEpisodes(spec, layouts, table, seed)
    tester = _TableEpisodes(spec, layouts, table, seed + 1)
    phase = max(1.0, exploration_share * budget)
    curve: list[CurvePoint] = []
    steps, reached = 0, False
    while steps < budget and not reached:
        for _ in range(min(budget, steps + test_every) - steps):
            share = 1.0 + min(1.0, steps / phase) * (exploration_last - 1.0)
            learner.step(share, rate, discount)
            steps += 1
        results = [tester.episode(exploration_last) for _ in range(test_episodes)]
        successes = sum(succeeded for succeeded, _ in results)
        curve.append(CurvePoint(steps, successes / test_episodes, float(np.mean([reward for _, reward in results]))))
        reached = successes >= required_successes
    return TabularResult(table, tuple(curve), reached, steps)


class _TableEpisodes:
    """Episodes on one site that act by a table."""

    def __init__(self, spec: PaperSpec, layouts: Sequence[PaperLayout], table: NDArray[np.float64], seed: int) -> None:
        self._batch = BatchedPaperSite(spec, 1, observation="window", layouts=layouts, threads=1, seed=seed)
        self._limit = spec.steps_before_late
        self._table = table
        self._random = np.random.default_rng(seed)
        self._batch.reset()

    def step(self, exploration: float, rate: float, discount: float) -> tuple[bool, bool, float]:
        """Take one action, learn from it where ``rate`` is not 0; return success, end and reward."""
        row = self._row(self._batch.states[0])
        if self._random.random() < exploration:
            action = int(self._random.integers(ACTION_COUNT))
        else:
            action = int(self._random.choice(np.flatnonzero(row == row.max())))
        step = self._batch.step([action])
        reward, done = float(step.rewards[0]), bool(step.terminated[0])
        if rate > 0.0:
            wanted = reward if done else reward + discount * self._row(step.final_states[0]).max()
            row[action] += rate * (wanted - row[action])
        return done, bool(step.ended[0]), reward

    def episode(self, exploration: float) -> tuple[bool, float]:
        """Run one episode without learning; return success and reward."""
        total, ended, succeeded = 0.0, False, False
        while not ended:
            succeeded, ended, reward = self.step(exploration, 0.0, 1.0)
            total += reward
        return succeeded, total

    def _row(self, state: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the values at a state, columns as the fields of ``PaperState``; a view."""
        _, x, y, z, _, steps, _ = state
        row: NDArray[np.float64] = self._table[x, y, z, int(steps >= self._limit)]
        return row
