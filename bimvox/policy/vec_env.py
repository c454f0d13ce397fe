"""Batched environments behind stable-baselines3's ``VecEnv``, and tests at intervals during a training."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, Protocol

import gymnasium
import numpy as np
from numpy.typing import ArrayLike, NDArray
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvStepReturn

from bimvox.env.actions import ACTION_COUNT


class _Step(Protocol):
    """A step of N environments. Its arrays hold until the step after the next."""

    @property
    def observations(self) -> NDArray[np.float32]:
        """(N, *shape), of the new episode if the old one ended."""

    @property
    def rewards(self) -> NDArray[np.float32]:
        """(N,)."""

    @property
    def terminated(self) -> NDArray[np.bool_]:
        """(N,) the task was done."""

    @property
    def truncated(self) -> NDArray[np.bool_]:
        """(N,) the steps were used up."""

    @property
    def ended(self) -> NDArray[np.bool_]:
        """(N,) the episode ended."""

    @property
    def final_observations(self) -> NDArray[np.float32]:
        """(N, *shape), valid for ended episodes only."""

    @property
    def teacher(self) -> NDArray[np.float32]:
        """(N, 6) value of each action before the step by the distance field; empty without a teacher."""


class _Batch(Protocol):
    """N environments that one kernel call steps."""

    @property
    def count(self) -> int:
        """N."""

    @property
    def observation_space(self) -> gymnasium.spaces.Box:
        """Of one environment."""

    def seed(self, seed: int) -> None:
        """Set what the random draws begin with."""

    def reset(self) -> NDArray[np.float32]:
        """Begin N episodes and return their observations."""

    def step(self, actions: ArrayLike) -> _Step:
        """Take one action in each."""

    def chosen_actions(self, values: NDArray[np.float32]) -> NDArray[np.int64]:
        """Return the actions for (N, 6) action values."""

    def close(self) -> None:
        """End its threads."""


class BatchVecEnv(VecEnv):
    """A batch as stable-baselines3's vectorised environment.

    Observations are the batch's own arrays and hold until the step after the next. Learners need no more: they copy
    into their replay memory. Only environments whose episode has ended have an ``info`` of their own:
    ``terminal_observation``, ``TimeLimit.truncated`` and ``is_success``. The others share one empty dictionary.
    """

    def __init__(self, batch: _Batch) -> None:
        self.batch = batch
        self.last_step: _Step | None = None
        self.render_mode = None
        self._actions: NDArray[np.int64] = np.zeros(batch.count, np.int64)
        super().__init__(batch.count, batch.observation_space, gymnasium.spaces.Discrete(ACTION_COUNT))

    def reset(self) -> NDArray[np.float32]:
        """Begin an episode in every environment; a seed set by ``seed`` takes effect here."""
        seed = self._seeds[0]
        self._reset_seeds()
        self._reset_options()
        if seed is not None:
            self.batch.seed(seed)
        return self.batch.reset()

    def step_async(self, actions: NDArray[np.int64]) -> None:
        """Keep the actions for ``step_wait``."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """Take the step."""
        step = self.last_step = self.batch.step(self._actions)
        ended = step.ended
        infos: list[dict[str, Any]] = [{}] * self.num_envs
        for n in np.flatnonzero(ended):
            infos[n] = {
                "terminal_observation": step.final_observations[n].copy(),
                "TimeLimit.truncated": bool(step.truncated[n]),
                "is_success": bool(step.terminated[n]),
            }
        return step.observations, step.rewards.copy(), ended, infos

    def close(self) -> None:
        """End the threads of the batch."""
        self.batch.close()

    def get_attr(self, attr_name: str, indices: int | Iterable[int] | None = None) -> list[Any]:
        """Return an attribute, which all environments of the batch share."""
        return [getattr(self, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: int | Iterable[int] | None = None) -> None:
        """Refuse: the environments of a batch have no attributes of their own."""
        raise NotImplementedError(f"environments of a batch have no attribute {attr_name!r} of their own to set")

    def env_method(
        self, method_name: str, *method_args: Any, indices: int | Iterable[int] | None = None, **method_kwargs: Any
    ) -> list[Any]:
        """Refuse: the environments of a batch have no methods of their own."""
        raise NotImplementedError(f"environments of a batch have no method {method_name!r} of their own to call")

    def env_is_wrapped(
        self, wrapper_class: type[gymnasium.Wrapper[Any, Any, Any, Any]], indices: int | Iterable[int] | None = None
    ) -> list[bool]:
        """Return False for each: none is wrapped."""
        return [False for _ in self._get_indices(indices)]


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
