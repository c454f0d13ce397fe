from __future__ import annotations

import copy
from itertools import pairwise

import numpy as np
import pytest
import torch
from torch import nn
from torch.nn import functional

from bimvox.errors import PolicyError
from bimvox.policy.learner.arrays import Memory
from bimvox.policy.learner.learner import CompiledLearner, copy_of, move_towards
from bimvox.policy.learner.network import (
    ValueNetwork,
    network_from_bytes,
    network_to_bytes,
    value_network_from_arrays,
)
from bimvox.policy.perceptron import Perceptron

INPUTS, ACTIONS, ROWS, BATCH = 30, 6, 200, 16


def network(rng, dueling, hidden=(12, 8), normalised=False):
    def stream(outputs):
        sizes = (INPUTS, *hidden, outputs)
        widths = hidden if normalised else ()
        return Perceptron(
            tuple(rng.normal(0, 0.4, (i, o)).astype(np.float32) for i, o in pairwise(sizes)),
            tuple(rng.normal(0, 0.1, o).astype(np.float32) for o in sizes[1:]),
            tuple(rng.normal(1, 0.2, o).astype(np.float32) for o in widths),
            tuple(rng.normal(0, 0.1, o).astype(np.float32) for o in widths),
        )

    return ValueNetwork(stream(ACTIONS), stream(1) if dueling else None)


def memory(rng):
    def sparse():
        return (rng.normal(0, 2, (ROWS, INPUTS)) * (rng.random((ROWS, INPUTS)) < 0.2)).astype(np.float32)

    ended = (rng.random(ROWS) < 0.3).astype(np.float32)
    return Memory(
        sparse(),
        sparse(),
        rng.integers(ACTIONS, size=ROWS),
        rng.normal(0, 2, ROWS).astype(np.float32),
        ended,
        ended * (rng.random(ROWS) < 0.5).astype(np.float32),
    )


class Torch:
    """Return the same result by torch."""

    def __init__(self, network, rate, discount, double_q, longest):
        self.streams = [self._module(stream) for stream in (network.actions, network.state) if stream is not None]
        self.targets = [self._module(stream) for stream in (network.actions, network.state) if stream is not None]
        self.parameters = [p for stream in self.streams for p in stream.parameters()]
        self.adam = torch.optim.Adam(self.parameters, lr=rate)
        self.discount, self.double_q, self.longest = discount, double_q, longest

    @staticmethod
    def _module(stream):
        layers = []
        for n, (weight, bias) in enumerate(zip(stream.weights, stream.biases, strict=True)):
            layer = nn.Linear(*weight.shape)
            with torch.no_grad():
                layer.weight.copy_(torch.from_numpy(weight.T.copy()))
                layer.bias.copy_(torch.from_numpy(bias.copy()))
            layers.append(layer)
            if n < len(stream.scales):
                norm = nn.LayerNorm(weight.shape[1])
                with torch.no_grad():
                    norm.weight.copy_(torch.from_numpy(stream.scales[n].copy()))
                    norm.bias.copy_(torch.from_numpy(stream.shifts[n].copy()))
                layers.append(norm)
            layers.append(nn.ReLU())
        return nn.Sequential(*layers[:-1])

    @staticmethod
    def values(streams, inputs):
        values = streams[0](inputs)
        if len(streams) > 1:
            values = streams[1](inputs) + values - values.mean(dim=1, keepdim=True)
        return values

    def step(self, memory, rows, importance=None):
        observations, following, actions, rewards, ended, truncated = (torch.from_numpy(a[rows]) for a in memory)
        with torch.no_grad():
            values = self.values(self.targets, following)
            chosen = (self.values(self.streams, following) if self.double_q else values).argmax(dim=1, keepdim=True)
            best = values.gather(1, chosen)[:, 0]
            wanted = rewards + (1 - ended * (1 - truncated)) * self.discount * best
        mine = self.values(self.streams, observations).gather(1, actions[:, None])[:, 0]
        weights = torch.ones(len(rows)) if importance is None else torch.from_numpy(importance)
        loss = (weights * functional.smooth_l1_loss(mine, wanted, reduction="none")).mean()
        self.adam.zero_grad()
        loss.backward()
        for parameter in self.parameters:
            nn.utils.clip_grad_norm_([parameter], self.longest)
        self.adam.step()


@pytest.mark.slow
@pytest.mark.parametrize("dueling", [True, False])
@pytest.mark.parametrize("double_q", [True, False])
@pytest.mark.parametrize("longest", [10.0, 0.05])
def test_steps_are_those_of_torch(dueling, double_q, longest):
    rng = np.random.default_rng(3)
    start, transitions = network(rng, dueling), memory(rng)
    ours = CompiledLearner(
        start, batch_size=BATCH, learning_rate=0.01, discount=0.9, double_q=double_q, longest=longest
    )
    its = Torch(start, 0.01, 0.9, double_q, longest)
    for _ in range(20):
        rows = rng.integers(ROWS, size=BATCH)
        ours.step(transitions, rows)
        its.step(transitions, rows)
    inputs = transitions.observations
    expected = its.values(its.streams, torch.from_numpy(inputs)).detach().numpy()
    np.testing.assert_allclose(ours.network()(inputs), expected, atol=2e-3)
    assert np.abs(ours.network()(inputs) - start(inputs)).max() > 0.1


@pytest.mark.slow
@pytest.mark.parametrize("longest", [10.0, 0.05])
def test_steps_with_normalised_layers_and_importance_are_those_of_torch(longest):
    rng = np.random.default_rng(5)
    start, transitions = network(rng, dueling=True, normalised=True), memory(rng)
    ours = CompiledLearner(start, batch_size=BATCH, learning_rate=0.01, discount=0.9, double_q=True, longest=longest)
    its = Torch(start, 0.01, 0.9, True, longest)
    for step in range(40):
        rows = rng.integers(ROWS, size=BATCH)
        importance = rng.random(BATCH).astype(np.float32)
        ours.step(transitions, rows, importance)
        its.step(transitions, rows, importance)
        if step == 20:
            ours.copy_to_target()
            its.targets = [copy.deepcopy(stream) for stream in its.streams]
    inputs = transitions.observations
    expected = its.values(its.streams, torch.from_numpy(inputs)).detach().numpy()
    np.testing.assert_allclose(ours.network()(inputs), expected, atol=2e-3)
    for now, before in zip(ours.live.actions.scales, start.actions.scales, strict=True):
        assert np.abs(now - before).max() > 0.01


def test_a_network_with_normalised_layers_is_stored_and_read():
    start = network(np.random.default_rng(0), dueling=True, normalised=True)
    again = network_from_bytes(network_to_bytes(start))
    inputs = np.random.default_rng(1).normal(size=(5, INPUTS)).astype(np.float32)
    np.testing.assert_array_equal(again(inputs), start(inputs))


@pytest.mark.parametrize(
    "damage",
    [
        lambda arrays: arrays.pop("state.layer1.shift"),
        lambda arrays: arrays.update({"actions.layer0.scale": np.ones(3, np.float32)}),
        lambda arrays: arrays.update({"actions.layer0.scale": np.full(12, np.nan, np.float32)}),
        lambda arrays: arrays.update({"actions.layer2.scale": np.ones(6, np.float32)}),
    ],
)
def test_normalised_layers_that_do_not_fit_are_refused(damage):
    arrays = network(np.random.default_rng(0), dueling=True, normalised=True).arrays()
    damage(arrays)
    with pytest.raises(PolicyError, match=r"the normalised layers .* do not fit hidden layers"):
        value_network_from_arrays(arrays)


def test_the_target_network_stays_until_it_is_copied():
    rng = np.random.default_rng(0)
    start, transitions = network(rng, dueling=True), memory(rng)
    results = []
    for copies in (False, True):
        learner = CompiledLearner(
            start, batch_size=BATCH, learning_rate=0.05, discount=0.9, double_q=False, longest=10.0
        )
        rows = np.arange(BATCH)
        learner.step(transitions, rows)
        if copies:
            learner.copy_to_target()
        learner.step(transitions, rows)
        results.append(learner.network())
    assert not np.array_equal(results[0].actions.weights[0], results[1].actions.weights[0])


def test_inputs_that_were_never_seen_keep_their_weights():
    rng = np.random.default_rng(1)
    start, transitions = network(rng, dueling=True), memory(rng)
    transitions.observations[:, 5] = 0.0
    learner = CompiledLearner(start, batch_size=BATCH, learning_rate=0.05, discount=0.9, double_q=True, longest=10.0)
    for _ in range(5):
        learner.step(transitions, rng.integers(ROWS, size=BATCH))
    for now, before in ((learner.live.actions, start.actions), (learner.live.state, start.state)):
        np.testing.assert_array_equal(now.weights[0][5], before.weights[0][5])
        assert not np.array_equal(now.weights[0][6], before.weights[0][6])


def test_the_average_moves_its_share():
    rng = np.random.default_rng(2)
    first, second = network(rng, dueling=True), network(rng, dueling=True)
    average = copy_of(first)
    move_towards(average, second, 0.25)
    expected = 0.75 * first.actions.weights[1] + 0.25 * second.actions.weights[1]
    np.testing.assert_allclose(average.actions.weights[1], expected, atol=1e-6)
    move_towards(average, second, 1.0)
    np.testing.assert_allclose(average.state.biases[0], second.state.biases[0], atol=1e-6)
