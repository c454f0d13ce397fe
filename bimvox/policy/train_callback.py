"""Tests at intervals during a training, as a callback of stable-baselines3."""

from __future__ import annotations

from collections.abc import Callable

from stable_baselines3.common.callbacks import BaseCallback


class TestsAtIntervals(BaseCallback):
    """Tests during one call of ``learn``: calling it in slices would restart the exploration schedule.

    Args:
        test: Called with the steps so far every ``interval`` steps and at the end of the budget; training stops if it
            returns True.
        interval: Environment steps between two tests.
        budget: Environment steps.
        done: Steps already taken by an interrupted training.
    """

    def __init__(self, test: Callable[[int], bool], interval: int, budget: int, done: int = 0) -> None:
        super().__init__()
        self._test = test
        self._interval = interval
        self._budget = budget
        self._next = done + interval

    def _on_step(self) -> bool:
        if self.num_timesteps < min(self._next, self._budget):
            return True
        self._next += self._interval
        return not self._test(self.num_timesteps)
