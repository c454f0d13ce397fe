"""One run of training, tested at intervals; both layers are made of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import torch
from stable_baselines3.common.callbacks import BaseCallback

from bimvox.paper.env.batched import BatchedPaperSite
from bimvox.paper.env.layout import PaperLayout
from bimvox.paper.env.spec import PaperSpec
from bimvox.paper.policy.config import PaperDqnConfig
from bimvox.paper.policy.dqn import PaperDqn
from bimvox.paper.policy.network import PaperNetwork
from bimvox.paper.policy.vec_env import PaperVecEnv


class CurvePoint(NamedTuple):
    """One test.

    Attributes:
        steps: Environment steps so far.
        success_rate: Share of the episodes that succeeded, with the tests' share of random actions.
        mean_reward: Of those episodes.
        greedy_rate: Share that succeeds without random actions, from every start; None where that was not tested.
    """

    steps: int
    success_rate: float
    mean_reward: float
    greedy_rate: float | None = None


Tester = Callable[[PaperNetwork, int], bool]
"""Tests a network after so many steps and says whether training may stop."""


def learn(
    spec: PaperSpec,
    config: PaperDqnConfig,
    test: Tester,
    *,
    seed: int,
    budget: int,
    layouts: Sequence[PaperLayout] | None = None,
    initial: PaperNetwork | None = None,
) -> int:
    """Train until a test says that it is enough, or the budget is used up.

    Args:
        spec: The site.
        config: The choices.
        test: Asked every ``config.test_every`` steps, and at the end of the budget.
        seed: Same arguments, same seed: same weights.
        budget: Steps.
        layouts: What episodes are drawn from; None draws them as ``spec`` says.
        initial: Network to begin from.

    Returns:
        The steps taken.
    """
    torch.set_num_threads(1)  # more threads only get in each other's way on layers this small
    batch = BatchedPaperSite(
        spec,
        config.sites,
        observation=flat_observation(config.observation),
        reward=config.reward,
        layouts=layouts,
        seed=seed,
        threads=1,
    )
    dqn = PaperDqn(PaperVecEnv(batch), config, seed=seed, budget=budget, initial=initial)
    dqn.learn(budget, callback=_Tests(test, config.test_every, budget))
    return int(dqn.num_timesteps)


def flat_observation(name: str) -> str:
    """Return the name of the same observation as one vector, as networks take it."""
    return "paper_flat" if name == "paper" else name


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
