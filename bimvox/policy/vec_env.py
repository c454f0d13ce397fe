"""Batched environments behind stable-baselines3's ``VecEnv``."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, Protocol

import gymnasium
import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvStepReturn

from bimvox.env.actions import ACTION_COUNT
from bimvox.env.batched import BatchedLiftEnv, BatchStep
from bimvox.env.observation import VIEW_SIZE


class Step(Protocol):
    """The parts of a step of N environments that the adapter reads."""

    @property
    def observations(self) -> NDArray[np.float32]:
        """(N, *shape), of the new episode if the old one ended."""

    @property
    def rewards(self) -> NDArray[np.float32]:
        """(N,)."""

    @property
    def truncated(self) -> NDArray[np.bool_]:
        """(N,) the steps were used up."""

    @property
    def ended(self) -> NDArray[np.bool_]:
        """(N,) the episode ended."""

    @property
    def final_observations(self) -> NDArray[np.float32]:
        """(N, *shape), valid for ended episodes only."""


class BatchVecEnv(VecEnv):
    """Adapter from one kernel call per step to stable-baselines3's vectorised environment.

    Only environments whose episode has ended have an ``info`` of their own: ``terminal_observation``,
    ``TimeLimit.truncated`` and what :meth:`outcome` adds. The others share one empty dictionary, new in every step.

    Args:
        count: N.
        observation_space: Of one environment.
    """

    def __init__(self, count: int, observation_space: gymnasium.spaces.Box) -> None:
        self.render_mode = None
        self._actions: NDArray[np.int64] = np.zeros(count, np.int64)
        super().__init__(count, observation_space, gymnasium.spaces.Discrete(ACTION_COUNT))

    def begin(self, seed: int | None) -> NDArray[np.float32]:
        """Begin an episode in every environment, and return the observations."""
        raise NotImplementedError

    def take(self, actions: NDArray[np.int64]) -> tuple[Step, NDArray[np.float32]]:
        """Take one step, and return it with the observations to hand out."""
        raise NotImplementedError

    def outcome(self, step: Any, n: int) -> dict[str, Any]:
        """Return what the ``info`` says about the end of one episode."""
        raise NotImplementedError

    def reset(self) -> NDArray[np.float32]:
        """Begin an episode in every environment; a seed set by ``seed`` takes effect here."""
        seed = self._seeds[0]
        self._reset_seeds()
        self._reset_options()
        return self.begin(seed)

    def step_async(self, actions: NDArray[np.int64]) -> None:
        """Keep the actions for ``step_wait``."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """Take the step."""
        step, observations = self.take(self._actions)
        ended = step.ended
        infos: list[dict[str, Any]] = [{}] * self.num_envs
        for n in np.flatnonzero(ended):
            infos[n] = {
                "terminal_observation": step.final_observations[n].copy(),
                "TimeLimit.truncated": bool(step.truncated[n]),
                **self.outcome(step, int(n)),
            }
        return observations, step.rewards.copy(), ended, infos

    def close(self) -> None:
        """Do nothing: nothing is open."""

    def get_attr(self, attr_name: str, indices: int | Iterable[int] | None = None) -> list[Any]:
        """Return an attribute, which all environments of the batch share."""
        return [getattr(self, attr_name)] * len(self._chosen(indices))

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
        return [False] * len(self._chosen(indices))

    def _chosen(self, indices: int | Iterable[int] | None) -> Sequence[int]:
        return list(self._get_indices(indices))


class LiftVecEnv(BatchVecEnv):
    """Lifts for stable-baselines3.

    Observations are the batch's own arrays and hold until the step after the next. Learners need no more: they copy
    into their replay memory.

    Args:
        batch: The lifts.
    """

    def __init__(self, batch: BatchedLiftEnv) -> None:
        self.batch = batch
        self.last_step: BatchStep | None = None
        super().__init__(batch.lifts, gymnasium.spaces.Box(-1.0, 1.0, (VIEW_SIZE,), np.float32))

    def begin(self, seed: int | None) -> NDArray[np.float32]:
        """Begin an episode of every lift."""
        if seed is not None:
            self.batch.seed(seed)
        return self.batch.reset()

    def take(self, actions: NDArray[np.int64]) -> tuple[Step, NDArray[np.float32]]:
        """Take one step of every lift."""
        self.last_step = self.batch.step(actions)
        return self.last_step, self.last_step.observations

    def outcome(self, step: BatchStep, n: int) -> dict[str, Any]:
        """Return whether the lift arrived."""
        return {"is_success": bool(step.arrived[n])}
