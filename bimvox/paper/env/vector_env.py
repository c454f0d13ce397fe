"""The batched sites behind Gymnasium's ``VectorEnv``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from bimvox.env.actions import ACTION_COUNT, known_options
from bimvox.paper.env.ansi import ansi_picture
from bimvox.paper.env.batch_kernels import PaperStep
from bimvox.paper.env.batched import BatchedPaperSite
from bimvox.paper.env.layout import PaperLayout
from bimvox.paper.env.presets import site_named
from bimvox.paper.env.spec import PaperSpec

INFO_KEYS = ("is_success", "bumped", "assembled", "component", "steps", "late")


class PaperVectorEnv(VectorEnv[NDArray[np.float32], NDArray[np.int64], NDArray[Any]]):
    """N sites stepped at once. A site whose episode ends begins a new one in the same step (``SAME_STEP``).

    ``infos`` holds an array for each key of ``INFO_KEYS`` and its mask ``_key``. If an episode has ended,
    ``final_obs`` holds its last observation and ``final_info`` its last ``infos``.

    Args:
        num_envs: N.
        site: The site, or a key of ``PRESETS``; default: the paper's experiment.
        observation: A key of ``OBSERVATIONS``.
        reward: A key of ``PAPER_REWARDS``.
        layouts: Episodes are drawn from these. None draws a new layout for each.
        render_mode: None, ``rgb_array`` or ``ansi``: one picture per site.
        copy: Whether ``reset`` and ``step`` return copies. Otherwise they return the environment's own arrays, which
            the step after the next overwrites. Copying the paper's map takes longer than stepping.
        threads: Number of threads. None takes one per core, but fewer for few sites.
        **changes: Fields of ``PaperSpec`` that replace those of ``site``.

    Raises:
        ValueError: A name is unknown, or the site is impossible.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012  (Gymnasium's own convention)
        "render_modes": ["rgb_array", "ansi"],
        "render_fps": 4,
        "autoreset_mode": AutoresetMode.SAME_STEP,
    }

    # One parameter per option of gymnasium.make_vec, which passes them by name.
    def __init__(
        self,
        num_envs: int = 1,
        site: PaperSpec | str = "paper",
        *,
        observation: str = "paper_flat",
        reward: str = "paper",
        layouts: Sequence[PaperLayout] | None = None,
        render_mode: str | None = None,
        copy: bool = True,
        threads: int | None = None,
        **changes: Any,
    ) -> None:
        if render_mode is not None and render_mode not in self.metadata["render_modes"]:
            known = ", ".join(self.metadata["render_modes"])
            raise ValueError(f"render_mode: {render_mode!r} is unknown; there are None, {known}")
        self.batch = BatchedPaperSite(
            replace(site_named(site), **changes),
            num_envs,
            observation=observation,
            reward=reward,
            layouts=layouts,
            threads=threads,
        )
        self.num_envs = num_envs
        self.render_mode = render_mode
        self.single_observation_space = self.batch.observation_space
        self.single_action_space = gymnasium.spaces.Discrete(ACTION_COUNT)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._copy = copy
        self._begun = False
        self._everywhere = np.ones(num_envs, np.bool_)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begin an episode on every site; a seed determines everything drawn from here on.

        Raises:
            ValueError: There are options; it takes none.
        """
        super().reset(seed=seed)
        known_options(options)
        if seed is not None or self._np_random is None:
            self.batch.seed(int(self.np_random.integers(2**63)))
        observations = self.batch.reset()
        self._begun = True
        nowhere = np.zeros(self.num_envs, np.bool_)
        return self._kept(observations), self._infos(self.batch.states, nowhere, nowhere, self._everywhere)

    def step(
        self, actions: NDArray[np.int64]
    ) -> tuple[NDArray[np.float32], NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]:
        """Take one action on every site; see Gymnasium.

        Raises:
            ActionError: The actions are not N integers from 0 to 5.
            ResetNeeded: Before the first ``reset``.
        """
        if not self._begun:
            raise ResetNeeded("step: no episode has begun; call reset() first")
        step = self.batch.step(actions)
        ended = step.ended
        late = step.late & ~ended
        infos = self._infos(self.batch.states, step.bumped & ~ended, late, self._everywhere)
        if ended.any():
            infos["final_obs"] = self._final_observations(step, ended)
            infos["_final_obs"] = ended
            infos["final_info"] = self._infos(step.final_states, step.bumped & ended, step.late & ended, ended)
            infos["_final_info"] = ended.copy()
        observations, rewards, terminated, truncated = (
            self._kept(a) for a in (step.observations, step.rewards, step.terminated, step.truncated)
        )
        return observations, rewards, terminated, truncated, infos

    def render(self) -> tuple[Any, ...] | None:
        """Return a picture of every site in the form of the render mode. None without a render mode."""
        pictures = (self.batch.picture(n) for n in range(self.num_envs))
        if self.render_mode is None:
            return None
        if self.render_mode == "ansi":
            return tuple(ansi_picture(picture) for picture in pictures)
        from bimvox.paper.rendering.picture import paper_site_pixels

        return tuple(paper_site_pixels(picture) for picture in pictures)

    def close_extras(self, **kwargs: Any) -> None:
        """End the threads."""
        self.batch.close()

    def _kept(self, array: NDArray[Any]) -> NDArray[Any]:
        return array.copy() if self._copy else array

    def _final_observations(self, step: PaperStep, ended: NDArray[np.bool_]) -> NDArray[np.object_]:
        final: NDArray[np.object_] = np.full(self.num_envs, None, dtype=object)
        for n in np.flatnonzero(ended):
            final[n] = self._kept(step.final_observations[n])
        return final

    def _infos(
        self, states: NDArray[np.int64], bumped: NDArray[np.bool_], late: NDArray[np.bool_], where: NDArray[np.bool_]
    ) -> dict[str, Any]:
        assembled = states[:, 0].copy()
        values = (
            assembled >= self.batch.spec.count,
            bumped,
            assembled,
            np.minimum(assembled + 1, self.batch.spec.count),
            states[:, 5].copy(),
            late,
        )
        infos: dict[str, Any] = dict(zip(INFO_KEYS, values, strict=True))
        infos.update({f"_{key}": where.copy() for key in INFO_KEYS})
        return infos
