"""One training run with tests at intervals; both layers consist of such runs.

A transition has eight images: the rotations and mirrorings of its site in plan. The rules are the same in every
direction in plan and in a mirror. A rotated or mirrored transition is therefore a possible transition on the rotated or
mirrored site, with the same reward. With gradient steps on such images (data augmentation), one environment step
teaches as much as eight.

The images are exact: the windows are square in plan and centred on the component on every level, whatever its shape.
The way to the goal and the last action are transformed with them.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import torch

from bimvox.env.actions import ACTION_COUNT, MOVES
from bimvox.env.observation import WAY_SIZE
from bimvox.paper.env.batched import BatchedPaperSite
from bimvox.paper.env.layout import PaperLayout
from bimvox.paper.env.observation import OBSERVATION_SIZE, SCALES, WINDOW, WINDOW_SIZE
from bimvox.paper.env.spec import PaperSpec
from bimvox.paper.policy.config import PaperDqnConfig
from bimvox.paper.policy.network import PaperPolicy, ValueNetwork
from bimvox.policy.dqn import BatchDqn, Trained
from bimvox.policy.replay import Transitions
from bimvox.policy.vec_env import BatchVecEnv, TestsAtIntervals

IMAGES = 8


class Images:
    """Replaces each of some transitions by a drawn image; image 0 is the original itself.

    Attributes:
        entry: (8, size) int64; entry n of image g is entry ``entry[g, n]`` of the original,
        sign: (8, size) float32, times this.
        action: (8, 6) int64 the image of each action.
    """

    def __init__(self) -> None:
        entry = np.zeros((IMAGES, OBSERVATION_SIZE), np.int64)
        sign = np.ones((IMAGES, OBSERVATION_SIZE), np.float32)
        action = np.zeros((IMAGES, ACTION_COUNT), np.int64)
        levels = np.arange(WINDOW_SIZE * len(SCALES)).reshape(len(SCALES), *WINDOW)
        goal = np.arange(WAY_SIZE).reshape(-1, 3) + levels.size
        for g, (swap, mirror_x, mirror_y) in enumerate(itertools.product((False, True), repeat=3)):
            window, way, moves = levels, goal, MOVES
            turns = np.ones(3, np.float32)
            if swap:
                window, way, moves = window.swapaxes(1, 2), way[:, [1, 0, 2]], moves[:, [1, 0, 2]]
            for axis, mirrored in enumerate((mirror_x, mirror_y)):
                if mirrored:
                    window = np.flip(window, axis + 1)
                    turns[axis] = -1.0
            image = [MOVES.tolist().index((move * turns.astype(np.int32)).tolist()) for move in moves]
            action[g] = image
            entry[g, : levels.size] = window.ravel()
            entry[g, levels.size : levels.size + WAY_SIZE] = way.ravel()
            sign[g, levels.size : levels.size + WAY_SIZE] = np.tile(turns, WAY_SIZE // 3)
            entry[g, levels.size + WAY_SIZE :] = np.argsort(image) + levels.size + WAY_SIZE
        self.entry, self.sign, self.action = (torch.from_numpy(table) for table in (entry, sign, action))

    def __call__(self, batch: Transitions, random: torch.Generator) -> Transitions:
        """Return one image of each transition, drawn evenly."""
        return self.of(batch, torch.randint(IMAGES, (len(batch.rows),), generator=random))

    def of(self, batch: Transitions, which: torch.Tensor) -> Transitions:
        """Return the images of some transitions; ``which`` is (N,) 0 .. 7."""
        entry, sign = self.entry[which], self.sign[which]
        return batch._replace(
            views=sign * batch.views.gather(1, entry),
            following=sign * batch.following.gather(1, entry),
            actions=self.action[which].gather(1, batch.actions),
        )


_Tester = Callable[[ValueNetwork, int], bool]
"""Tests a network after so many steps, and returns whether training may stop."""


def learn(
    spec: PaperSpec,
    config: PaperDqnConfig,
    test: _Tester,
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
