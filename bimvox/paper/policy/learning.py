"""One training run with tests at intervals; both layers consist of such runs."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import torch

from bimvox.paper.env.batched import BatchedPaperSite
from bimvox.paper.env.layout import PaperLayout
from bimvox.paper.env.spec import PaperSpec
from bimvox.paper.policy.config import PaperDqnConfig
from bimvox.paper.policy.dqn import PaperDqn
from bimvox.paper.policy.vec_env import PaperVecEnv
from bimvox.policy.learner.network import ValueNetwork
from bimvox.policy.train_callback import TestsAtIntervals

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
    """Train until a test returns True or the budget is used up, and return the steps taken.

    A test runs every ``config.test_every`` steps and at the end of the budget. Training starts from the network
    ``initial`` if it is given. Episodes are drawn from ``layouts`` if they are given, otherwise as ``spec`` says. The
    same arguments give the same weights.
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
    tests = TestsAtIntervals(lambda steps: test(dqn.network, steps), config.test_every, budget)
    dqn.learn(budget, callback=tests)
    return int(dqn.num_timesteps)
