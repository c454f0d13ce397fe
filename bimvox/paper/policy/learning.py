"""One training run with tests at intervals; both layers consist of such runs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import torch

from bimvox.paper.env.batched import BatchedPaperSite
from bimvox.paper.env.layout import PaperLayout
from bimvox.paper.env.spec import PaperSpec
from bimvox.paper.policy.config import PaperDqnConfig
from bimvox.paper.policy.network import PaperPolicy, ValueNetwork
from bimvox.paper.policy.symmetry import Images
from bimvox.policy.dqn import BatchDqn, Trained
from bimvox.policy.vec_env import BatchVecEnv, TestsAtIntervals

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
    ``initial`` if it is given, with ``config.exploration_again`` random actions. Episodes are drawn from ``layouts`` if
    they are given, otherwise as ``spec`` says. The same arguments give the same weights.
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
    dqn = dqn_of_sites(batch, config, seed)
    if initial is not None:
        dqn.config = replace(config, exploration_first=config.exploration_again)
        dqn.begin_with(initial.tensors)
    tests = TestsAtIntervals(lambda steps: test(network_of(dqn), steps), config.test_every, budget)
    dqn.learn(budget, callback=tests)
    return int(dqn.num_timesteps)


def dqn_of_sites(batch: BatchedPaperSite, config: PaperDqnConfig, seed: int) -> BatchDqn:
    """Return a DQN over a batch of sites. The paper's map holds whole numbers, remembered as they are."""
    network = {"dueling": config.dueling, "glorot": config.glorot, "layer_norm": config.layer_norm}
    trained = Trained(
        PaperPolicy,
        {"network": network, "optimizer_kwargs": {"fused": True}},
        1 if config.observation == "paper" else 127,
        Images() if config.symmetry else None,
    )
    return BatchDqn(BatchVecEnv(batch), config, seed, trained)


def network_of(dqn: BatchDqn) -> ValueNetwork:
    """Return a copy of the network to test and to keep."""
    names = [name for name, _ in dqn.q_net.named_parameters()]
    return ValueNetwork(
        {name: tensor.detach().clone() for name, tensor in zip(names, dqn.tested_parameters(), strict=True)}
    )
