"""A site so small that learning on it takes a second, with a known optimum."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from bimvox.paper.env.component import column
from bimvox.paper.env.spec import PaperSpec
from bimvox.paper.policy.config import OUR_MODE, PAPER_MODE
from bimvox.policy.learner.network import ValueNetwork
from bimvox.policy.perceptron import Perceptron

TINY = PaperSpec((5, 5, 5), (2, 2, 3, 3), (column(2, (2, 2, 1)),), step_limit=8, max_steps=14)
"""One column of two cells that goes to the middle of 5 x 5 x 5."""

QUICK = replace(OUR_MODE, hidden=(32, 32), batch_size=32, sites=8, gradient_steps=8, learning_starts=64, test_every=100)
"""A small configuration of our mode."""

SLOW = replace(PAPER_MODE, hidden=(16, 16), learning_starts=100, test_every=200, budget=2_000, test_episodes=20)
"""A small configuration of the paper's mode."""


def network_that_always(action: int, inputs: int, hidden: tuple[int, ...] = ()) -> ValueNetwork:
    """Return a network that prefers the same action for every observation."""
    sizes = (inputs, *hidden, 6)
    biases = tuple(np.zeros(size, np.float32) for size in sizes[1:])
    biases[-1][action] = 1.0
    return ValueNetwork(Perceptron(tuple(np.zeros(shape, np.float32) for shape in pairwise(sizes)), biases))


def drawn_network(rng: np.random.Generator, inputs: int, *, dueling: bool, hidden: int = 8) -> ValueNetwork:
    """Return a network of random weights."""

    def stream(outputs: int) -> Perceptron:
        return Perceptron(
            (
                rng.normal(0, 0.4, (inputs, hidden)).astype(np.float32),
                rng.normal(0, 0.4, (hidden, outputs)).astype(np.float32),
            ),
            (rng.normal(0, 0.1, hidden).astype(np.float32), rng.normal(0, 0.1, outputs).astype(np.float32)),
        )

    return ValueNetwork(stream(6), stream(1) if dueling else None)
