"""The batched environment behind stable-baselines3's ``VecEnv``."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvStepReturn

from bimvox.env.actions import ACTION_COUNT
from bimvox.env.batched import BatchedLiftEnv, BatchStep
from bimvox.env.observation import VIEW_SIZE


class LiftVecEnv(VecEnv):
    """Adapter: what stable-baselines3 asks of a vectorised environment, from one kernel call a step.

    Observations are the batch's own arrays and hold until the step after the next, which is all that learners need:
    they copy into their replay memory. Lifts whose episode goes on share one empty ``info``.

    Args:
        batch: The lifts.
    """

    def __init__(self, batch: BatchedLiftEnv) -> None:
        self.batch = batch
        self.render_mode = None
        self.last_step: BatchStep | None = None
        self._actions: NDArray[np.int64] = np.zeros(batch.lifts, np.int64)
        super().__init__(
            batch.lifts,
            gymnasium.spaces.Box(-1.0, 1.0, (VIEW_SIZE,), np.float32),
            gymnasium.spaces.Discrete(ACTION_COUNT),
        )

    def reset(self) -> NDArray[np.float32]:
        """Begin an episode of every lift; a seed set by ``seed`` takes effect here."""
        if self._seeds[0] is not None:
            self.batch.seed(self._seeds[0])
        self._reset_seeds()
        self._reset_options()
        return self.batch.reset()

    def step_async(self, actions: NDArray[np.int64]) -> None:
        """Keep the actions for ``step_wait``."""
        self._actions = np.asarray(actions, np.int64)

    def step_wait(self) -> VecEnvStepReturn:
        """Take the step."""
        step = self.batch.step(self._actions)
        ended = step.ended
        infos: list[dict[str, Any]] = [{}] * self.num_envs
        for n in np.flatnonzero(ended):
            infos[n] = {
                "terminal_observation": step.final_observations[n].copy(),
                "TimeLimit.truncated": bool(step.truncated[n]),
                "is_success": bool(step.arrived[n]),
            }
        self.last_step = step
        return step.observations, step.rewards, ended, infos

    def close(self) -> None:
        """Nothing is held open."""

    def get_attr(self, attr_name: str, indices: int | Iterable[int] | None = None) -> list[Any]:
        """Return an attribute of the lifts; they share all of them."""
        return [getattr(self, attr_name)] * len(self._chosen(indices))

    def set_attr(self, attr_name: str, value: Any, indices: int | Iterable[int] | None = None) -> None:
        """Refuse: lifts of a batch have no attributes of their own."""
        raise NotImplementedError(f"lifts of a batch have no attribute {attr_name!r} of their own to set")

    def env_method(
        self, method_name: str, *method_args: Any, indices: int | Iterable[int] | None = None, **method_kwargs: Any
    ) -> list[Any]:
        """Refuse: lifts of a batch have no methods of their own."""
        raise NotImplementedError(f"lifts of a batch have no method {method_name!r} of their own to call")

    def env_is_wrapped(
        self, wrapper_class: type[gymnasium.Wrapper[Any, Any, Any, Any]], indices: int | Iterable[int] | None = None
    ) -> list[bool]:
        """No lift is wrapped."""
        return [False] * len(self._chosen(indices))

    def _chosen(self, indices: int | Iterable[int] | None) -> Sequence[int]:
        return list(self._get_indices(indices))
