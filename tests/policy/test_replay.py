from __future__ import annotations

import gymnasium
import numpy as np
import torch

from bimvox.paper.policy.config import PAPER_MODE
from bimvox.policy.config import DqnConfig
from bimvox.policy.replay import ViewReplay

SPACES = (gymnasium.spaces.Box(-1.0, 1.0, (3,), np.float32), gymnasium.spaces.Discrete(6))
PRIORITIZED = PAPER_MODE.__class__(priority=1.0)


def memory(config, size=8, n_envs=2):
    return ViewReplay(size, *SPACES, n_envs=n_envs, config=config, seed=0)


def add(replay, number):
    views = torch.full((2, 3), number / 127)
    zeros = torch.zeros(2)
    replay.add(replay.packed(views), replay.packed(views), zeros, zeros + number, zeros, torch.zeros(0, 6))


def test_the_oldest_transitions_are_overwritten():
    replay = memory(DqnConfig())
    for number in range(6):
        add(replay, number)
    batch = replay.sample(200)
    assert set(batch.rewards.ravel().tolist()) == {2.0, 3.0, 4.0, 5.0}
    np.testing.assert_allclose(batch.views[:, 0] * 127, batch.rewards[:, 0], rtol=1e-6)


def test_transitions_that_were_farther_off_are_drawn_more_often():
    replay = memory(PRIORITIZED)
    for number in range(4):
        add(replay, number)
    rows = torch.arange(8)
    errors = torch.zeros(8, 1)
    errors[7] = 0.21  # and 0.01 is added to each
    replay.note_errors(rows, errors)
    drawn = replay.sample(10_000)
    assert abs((drawn.rows == 7).double().mean() - 0.22 / 0.29) < 0.02
    weights = replay.importance(rows, 1.0)[:, 0]
    np.testing.assert_allclose(weights, [1.0] * 7 + [1 / 22], rtol=1e-5)


def test_what_is_new_has_the_greatest_priority():
    replay = memory(PRIORITIZED)
    add(replay, 0)
    replay.note_errors(torch.arange(2), torch.tensor([[0.0], [0.09]]))
    add(replay, 1)
    counts = np.bincount(replay.sample(20_000).rows, minlength=4) / 20_000
    np.testing.assert_allclose(counts, np.array([1, 10, 10, 10]) / 31, atol=0.02)
