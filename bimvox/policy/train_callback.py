"""The tests of a site's training, as a callback of stable-baselines3."""

from __future__ import annotations

import time

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback

from bimvox.env.batched import BatchedLiftEnv
from bimvox.policy.dqn import network_of
from bimvox.policy.train import Record

HARD_PROBLEMS_FIRST = 4.0
"""How much more often a problem is drawn that failed from every start in the last test than one that succeeded."""


class Tests(BaseCallback):
    """Tests during one call of ``learn``: calling it in slices would restart the exploration schedule.

    Args:
        record: Tests every network, and returns whether it is good enough.
        batch: Its problems are weighted by their failures.
        budget: Environment steps.
        done: Steps already taken by an interrupted training.
        seconds: Time limit, checked at every test.
    """

    def __init__(self, record: Record, batch: BatchedLiftEnv, budget: int, done: int, seconds: float | None) -> None:
        super().__init__()
        self._done = done
        self._ends = None if seconds is None else time.monotonic() + seconds
        self._record = record
        self._batch = batch
        self._budget = budget
        self._next = 0

    def _on_training_start(self) -> None:
        self._next = self._done + self._interval

    def _on_step(self) -> bool:
        if self.num_timesteps < min(self._next, self._budget):
            return True
        self._next += self._interval
        if self._record.test(network_of(self.model), self.num_timesteps):  # type: ignore[arg-type]
            return False
        if self._ends is not None and time.monotonic() >= self._ends:
            return False
        evaluation = self._record.evaluation
        if evaluation is not None:
            tries = np.bincount(evaluation.problem)
            failed = np.bincount(evaluation.problem, weights=~evaluation.arrived) / tries
            self._batch.weigh_problems(1.0 + (HARD_PROBLEMS_FIRST - 1.0) * failed)
        return True

    @property
    def _interval(self) -> int:
        return int(self.model.config.test_every)  # type: ignore[attr-defined]
