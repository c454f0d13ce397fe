"""One training run with tests at intervals; both layers consist of such runs."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import torch
from stable_baselines3.common.callbacks import BaseCallback

from bimvox.paper.env.batched import BatchedPaperSite
from bimvox.paper.env.layout import PaperLayout
from bimvox.paper.env.spec import PaperSpec
from bimvox.paper.policy.config import PaperDqnConfig
from bimvox.paper.policy.dqn import PaperDqn
from bimvox.paper.policy.vec_env import PaperVecEnv
from bimvox.policy.learner.network import ValueNetwork

Tester = Callable[[ValueNetwork, int], bool]
"""Tests a network after so many steps, and returns whether training may stop."""


def learn(
    spec: PaperSpec,
    config: PaperDqnConfig,
    test: Tester,
    *,
    seed: int,
    budget: int,
    layouts: Sequence[PaperLayout] | None = None,
    initial: ValueNetwork | None = None,
) -> int:
    """Train until a test returns True, or the budget is used up.

    Args:
        spec: The site.
        config: The choices.
        test: Called every ``config.test_every`` steps, and at the end of the budget.
        seed: The same arguments give the same weights.
        budget: Steps.
        layouts: Episodes are drawn from these. None draws them as ``spec`` says.
        initial: Network to start from.

    Returns:
        The steps taken.
    """
    torch.set_num_threads(1)  # more threads slow down layers this small
    batch = BatchedPaperSite(
        spec,
        config.sites,
        observation=config.flat_observation,
        reward=config.reward,
        layouts=layouts,
        seed=seed,
        threads=1,
    )
    dqn = PaperDqn(PaperVecEnv(batch), config, seed=seed, budget=budget, initial=initial)
    dqn.learn(budget, callback=_Tests(test, config.test_every, budget))
    return int(dqn.num_timesteps)


class _Tests(BaseCallback):
    """Tests during one call of ``learn``: calling it in slices would restart the exploration schedule."""

    def __init__(self, test: Tester, interval: int, budget: int) -> None:
        super().__init__()
        self._test = test
        self._interval = interval
        self._budget = budget
        self._next = interval

    def _on_step(self) -> bool:
        if self.num_timesteps < min(self._next, self._budget):
            return True
        self._next += self._interval
        return not self._test(self.model.network, self.num_timesteps)  # type: ignore[attr-defined]
