"""The batched construction site behind stable-baselines3's ``VecEnv``."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvStepReturn

from bimvox.env.actions import ACTION_COUNT
from bimvox.paper.env.batched import BatchedPaperSite


class PaperVecEnv(VecEnv):
    """Adapter: what stable-baselines3 asks of a vectorised environment, from one kernel call a step.

    Only the sites whose episode has ended have an ``info`` of their own (``terminal_observation``,
    ``TimeLimit.truncated``, ``is_success``, ``assembled``); the others share one empty dictionary, new in every step.

    Args:
        batch: The sites.
        copy: Whether every step hands out observations of its own. Without, it hands out those of the batch, of which
            two arrays must take turns: an observation holds until the step after the next, which is all that
            stable-baselines3's learners need; they copy into their replay memory.

    Raises:
        ValueError: No copies, and a batch whose observations hold for one step only.
    """

    def __init__(self, batch: BatchedPaperSite, *, copy: bool = True) -> None:
        if not copy and batch.turns < 2:
            raise ValueError(f"copy: a batch of turns={batch.turns} overwrites what it hands out; make it with turns=2")
        self.batch = batch
        self.render_mode = None
        self._copy = copy
        self._actions: NDArray[np.int64] = np.zeros(batch.sites, np.int64)
        super().__init__(batch.sites, batch.observation_space, gymnasium.spaces.Discrete(ACTION_COUNT))

    def reset(self) -> NDArray[np.float32]:
        """Begin an episode on every site; a seed set by ``seed`` takes effect here."""
        if self._seeds[0] is not None:
            self.batch.seed(self._seeds[0])
        self._reset_seeds()
        self._reset_options()
        observations = self.batch.reset()
        return observations.copy() if self._copy else observations

    def step_async(self, actions: NDArray[np.int64]) -> None:
        """Keep the actions for ``step_wait``."""
        self._actions = np.asarray(actions, np.int64)

    def step_wait(self) -> VecEnvStepReturn:
        """Take the step."""
        copied = np.empty_like(self.batch.observations) if self._copy else None
        step = self.batch.step(self._actions, copy_to=copied)
        ended = step.ended
        infos: list[dict[str, Any]] = [{}] * self.num_envs
        for n in np.flatnonzero(ended):
            infos[n] = {
                "terminal_observation": step.final_observations[n].copy(),
                "TimeLimit.truncated": bool(step.truncated[n]),
                "is_success": bool(step.terminated[n]),
                "assembled": int(step.final_states[n, 0]),
            }
        return step.observations if copied is None else copied, step.rewards.copy(), ended, infos

    def close(self) -> None:
        """End the threads of the batch."""
        self.batch.close()

    def get_attr(self, attr_name: str, indices: int | Iterable[int] | None = None) -> list[Any]:
        """Return an attribute of the sites; they share all of them."""
        return [getattr(self, attr_name)] * len(self._chosen(indices))

    def set_attr(self, attr_name: str, value: Any, indices: int | Iterable[int] | None = None) -> None:
        """Refuse: sites of a batch have no attributes of their own."""
        raise NotImplementedError(f"sites of a batch have no attribute {attr_name!r} of their own to set")

    def env_method(
        self, method_name: str, *method_args: Any, indices: int | Iterable[int] | None = None, **method_kwargs: Any
    ) -> list[Any]:
        """Refuse: sites of a batch have no methods of their own."""
        raise NotImplementedError(f"sites of a batch have no method {method_name!r} of their own to call")

    def env_is_wrapped(
        self, wrapper_class: type[gymnasium.Wrapper[Any, Any, Any, Any]], indices: int | Iterable[int] | None = None
    ) -> list[bool]:
        """No site is wrapped."""
        return [False] * len(self._chosen(indices))

    def _chosen(self, indices: int | Iterable[int] | None) -> Sequence[int]:
        return list(self._get_indices(indices))
