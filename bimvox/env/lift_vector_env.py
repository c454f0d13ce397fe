"""Many lifts as one vectorised Gymnasium environment: ``gymnasium.make_vec("bimvox/Lift-v0", num_envs=N)``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from bimvox.env.actions import ACTION_COUNT, known_options, known_render_mode
from bimvox.env.batched import BatchedLiftEnv
from bimvox.env.dynamics import StepLimit
from bimvox.env.pool import YARD_ONLY, StartMix
from bimvox.env.problem import LiftProblem, default_problem
from bimvox.processes import processors

_LIFTS_A_THREAD = 64
"""Fewer lifts are not worth a thread."""


class LiftVectorEnv(VectorEnv[NDArray[np.float32], NDArray[np.int64], NDArray[Any]]):
    """N lifts stepped at once. A lift whose episode ends begins a new one in the same step (``SAME_STEP``).

    ``infos`` holds ``cell_vox``, (N, 3). If an episode has ended, ``final_obs`` holds its last observation and
    ``final_info`` its ``is_success``; keys with an underline say of which lifts. Dynamics, observation and reward are
    those of :class:`bimvox.env.lift_env.LiftEnv`.

    Args:
        num_envs: N.
        problems: Episodes are drawn from these; default: the paper's site.
        reward_name: A key of ``REWARDS``.
        mix: Where episodes begin; default: only at the problems' yard starts.
        limit: How many actions an episode may take.
        render_mode: None.
        copy: Whether ``reset`` and ``step`` return copies. Otherwise they return the environment's own arrays, which
            the step after the next overwrites.
        threads: Number of threads. None takes one per core, but fewer for few lifts.

    Raises:
        ValueError: A problem is not learnable, or there is a render mode.
    """

    metadata: dict[str, Any] = {"render_modes": [], "autoreset_mode": AutoresetMode.SAME_STEP}  # noqa: RUF012

    # One parameter per option of gymnasium.make_vec, which passes them by name.
    def __init__(
        self,
        num_envs: int = 1,
        problems: Sequence[LiftProblem] | None = None,
        *,
        reward_name: str = "shaped",
        mix: StartMix = YARD_ONLY,
        limit: StepLimit = StepLimit(),  # noqa: B008  (immutable)
        render_mode: str | None = None,
        copy: bool = True,
        threads: int | None = None,
    ) -> None:
        self.render_mode = known_render_mode(render_mode, self.metadata["render_modes"])
        most = max(1, min(processors(), num_envs // _LIFTS_A_THREAD))
        self.batch = BatchedLiftEnv(
            (default_problem(),) if problems is None else tuple(problems),
            num_envs,
            reward_name=reward_name,
            mix=mix,
            limit=limit,
            threads=most if threads is None else threads,
        )
        self.num_envs = num_envs
        self.single_observation_space = self.batch.observation_space
        self.single_action_space = gymnasium.spaces.Discrete(ACTION_COUNT)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._copy, self._begun = copy, False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begin an episode of every lift; a seed determines everything drawn from here on.

        Raises:
            ValueError: There are options; it takes none.
        """
        super().reset(seed=seed)
        known_options(options)
        if seed is not None or not self._begun:
            self.batch.seed(int(self.np_random.integers(2**63)))
        observations = self.batch.reset()
        self._begun = True
        return self._kept(observations), self._infos()

    def step(
        self, actions: NDArray[np.int64]
    ) -> tuple[NDArray[np.float32], NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]:
        """Take one action of every lift; see Gymnasium.

        Raises:
            ActionError: The actions are not N integers from 0 to 5.
            ResetNeeded: Before the first ``reset``.
        """
        if not self._begun:
            raise ResetNeeded("step: no episode has begun; call reset() first")
        step = self.batch.step(actions)
        infos, ended = self._infos(), step.ended
        if ended.any():
            final: NDArray[np.object_] = np.full(self.num_envs, None, dtype=object)
            for n in np.flatnonzero(ended):
                final[n] = self._kept(step.final_observations[n])
            infos |= {"final_obs": final, "_final_obs": ended}
            infos |= {"final_info": {"is_success": step.terminated.copy(), "_is_success": ended.copy()}}
            infos |= {"_final_info": ended.copy()}
        observations, rewards, terminated, truncated = (
            self._kept(a) for a in (step.observations, step.rewards, step.terminated, step.truncated)
        )
        return observations, rewards, terminated, truncated, infos

    def close_extras(self, **kwargs: Any) -> None:
        """End the threads."""
        self.batch.close()

    def _kept(self, array: NDArray[Any]) -> NDArray[Any]:
        return array.copy() if self._copy else array

    def _infos(self) -> dict[str, Any]:
        return {"cell_vox": self.batch.state.cell.copy(), "_cell_vox": np.ones(self.num_envs, np.bool_)}
