"""The batched construction site behind stable-baselines3's ``VecEnv``."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.paper.env.batch_kernels import PaperStep
from bimvox.paper.env.batched import BatchedPaperSite
from bimvox.policy.vec_env import BatchVecEnv, Step


class PaperVecEnv(BatchVecEnv):
    """Sites for stable-baselines3. The ``info`` of an ended episode also has ``is_success`` and ``assembled``.

    Args:
        batch: The sites.
        copy: Whether every step hands out observations of its own. Without copies it hands out the batch's arrays.
            Two of them must take turns, so that an observation holds until the step after the next. Learners of
            stable-baselines3 need no more: they copy into their replay memory.

    Raises:
        ValueError: No copies, and a batch whose observations hold for one step only.
    """

    def __init__(self, batch: BatchedPaperSite, *, copy: bool = True) -> None:
        if not copy and batch.turns < 2:
            raise ValueError(f"copy: a batch of turns={batch.turns} overwrites what it hands out; make it with turns=2")
        self.batch = batch
        self._copy = copy
        super().__init__(batch.sites, batch.observation_space)

    def begin(self, seed: int | None) -> NDArray[np.float32]:
        """Begin an episode on every site."""
        if seed is not None:
            self.batch.seed(seed)
        observations = self.batch.reset()
        return observations.copy() if self._copy else observations

    def take(self, actions: NDArray[np.int64]) -> tuple[Step, NDArray[np.float32]]:
        """Take one step on every site."""
        copied = np.empty_like(self.batch.observations) if self._copy else None
        step = self.batch.step(actions, copy_to=copied)
        return step, step.observations if copied is None else copied

    def outcome(self, step: PaperStep, n: int) -> dict[str, Any]:
        """Return whether everything was assembled, and how many components were."""
        return {"is_success": bool(step.terminated[n]), "assembled": int(step.final_states[n, 0])}

    def close(self) -> None:
        """End the threads of the batch."""
        self.batch.close()
