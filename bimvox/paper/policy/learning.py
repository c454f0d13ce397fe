"""One run of training, tested at intervals; both layers are made of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import torch
from stable_baselines3.common.callbacks import BaseCallback

from bimvox.paper.env.batched import BatchedPrefabSite
from bimvox.paper.env.layout import PrefabLayout
from bimvox.paper.env.spec import PrefabSpec
from bimvox.paper.policy.config import PrefabDqnConfig
from bimvox.paper.policy.dqn import PrefabDqn
from bimvox.paper.policy.network import PrefabNetwork
from bimvox.paper.policy.vec_env import PrefabVecEnv


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


Tester = Callable[[PrefabNetwork, int], bool]
"""Tests a network after so many steps and says whether training may stop."""


def learn(
    spec: PrefabSpec,
    config: PrefabDqnConfig,
    test: Tester,
    *,
    seed: int,
    budget: int,
    layouts: Sequence[PrefabLayout] | None = None,
    initial: PrefabNetwork | None = None,
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
    batch = BatchedPrefabSite(
        spec,
        config.sites,
        observation=flat_observation(config.observation),
        reward=config.reward,
        layouts=layouts,
        seed=seed,
        threads=1,
    )
    dqn = PrefabDqn(PrefabVecEnv(batch), config, seed=seed, budget=budget, initial=initial)
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
