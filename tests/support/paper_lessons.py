"""A site so small that learning on it takes a second, with a known optimum."""

from __future__ import annotations

from dataclasses import replace

import torch

from bimvox.paper.env.spec import PaperSpec, column
from bimvox.paper.policy.config import OUR_MODE, PAPER_MODE
from bimvox.paper.policy.network import ValueNetwork

TINY = PaperSpec((5, 5, 5), (2, 2, 3, 3), (column(2, (2, 2, 1)),), step_limit=8, max_steps=14)
"""One column of two cells that goes to the middle of 5 x 5 x 5."""

QUICK = replace(OUR_MODE, hidden=(32, 32), batch_size=32, sites=8, gradient_steps=8, learning_starts=64, test_every=100)
"""A small configuration of our mode."""

SLOW = replace(PAPER_MODE, hidden=(16, 16), learning_starts=100, test_every=200, budget=2_000, test_episodes=20)
"""A small configuration of the paper's mode."""


def network_that_always(action: int, inputs: int) -> ValueNetwork:
    """Return a network that prefers the same action for every observation."""
    bias = torch.zeros(6)
    bias[action] = 1.0
    return ValueNetwork({"q_net.0.weight": torch.zeros(6, inputs), "q_net.0.bias": bias})


def drawn_network(seed: int) -> ValueNetwork:
    """Return a network of random weights for four inputs."""
    draw = torch.Generator().manual_seed(seed)
    return ValueNetwork({"q_net.0.weight": torch.randn(6, 4, generator=draw), "q_net.0.bias": torch.zeros(6)})
