from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from paper_lessons import QUICK, SLOW, TINY

from bimvox.errors import PolicyError
from bimvox.paper.env.batched import BatchedPaperSite
from bimvox.paper.policy.config import AUTHORS_MODE, PAPER_MODE
from bimvox.paper.policy.learning import dqn_of_sites, learn, network_of
from bimvox.paper.policy.network import network_from_bytes, network_to_bytes

SMALL = {"hidden": (16, 16), "learning_starts": 100}


def dqn(config, **changes):
    config = replace(config, **changes)
    batch = BatchedPaperSite(TINY, config.sites, observation=config.flat_observation, reward=config.reward, threads=1)
    return dqn_of_sites(batch, config, 3)


def learned(config, steps, **more):
    networks = []
    learn(TINY, config, lambda network, _: bool(networks.append(network)), seed=3, budget=steps, **more)
    return networks[-1]


@pytest.mark.parametrize("config", [replace(PAPER_MODE, **SMALL), replace(AUTHORS_MODE, **SMALL), QUICK])
def test_what_is_kept_and_stored_is_what_was_learned(config):
    learner = dqn(config)
    learner.learn(300)
    observations = np.random.default_rng(0).random((5, *learner.observation_space.shape), np.float32)
    with torch.no_grad():
        expected = learner.q_net(torch.from_numpy(observations)).numpy()
    network = network_of(learner)
    np.testing.assert_allclose(network(observations), expected, atol=1e-5)
    again = network_from_bytes(network_to_bytes(network))
    np.testing.assert_array_equal(again(observations), network(observations))


def test_what_is_no_network_is_refused():
    with pytest.raises(PolicyError, match="not a safetensors file"):
        network_from_bytes(b"nothing")


def test_two_streams_without_a_layer_in_common_that_begin_after_glorot():
    tensors = network_of(dqn(SLOW)).tensors
    assert {name: tuple(tensor.shape) for name, tensor in tensors.items() if name.endswith("weight")} == {
        "q_net.0.weight": (16, 150),
        "q_net.2.weight": (16, 16),
        "q_net.4.weight": (6, 16),
        "value_net.0.weight": (16, 150),
        "value_net.2.weight": (16, 16),
        "value_net.4.weight": (1, 16),
    }
    limit = np.sqrt(6 / (150 + 16))
    for stream in ("q_net", "value_net"):
        assert (tensors[f"{stream}.0.bias"] == 0).all()
        assert 0.9 * limit < tensors[f"{stream}.0.weight"].abs().max() <= limit


def test_training_begins_with_the_loaded_network():
    config = replace(SLOW, learning_starts=1_000)
    first = learned(config, 40)
    assert network_to_bytes(learned(config, 40, initial=first)) == network_to_bytes(first)
    other = replace(config, hidden=(8, 8))
    with pytest.raises(RuntimeError, match="size mismatch"):
        learned(other, 40, initial=first)


@pytest.mark.parametrize("goes_on", [True, False])
def test_whether_the_value_continues_at_the_step_limit(goes_on):
    learner = dqn(SLOW, bootstrap_at_limit=goes_on, learning_starts=10_000)
    learner.learn(60)
    assert learner.replay_buffer.sample(500).ended.any() == (not goes_on)


@pytest.mark.parametrize(
    "config",
    [QUICK, replace(QUICK, priority=0.6, importance_first=0.4, symmetry=True, exploration_spread=4.0, averaging=0.9)],
    ids=["plain", "everything"],
)
def test_the_same_seed_gives_the_same_weights(config):
    assert network_to_bytes(learned(config, 300)) == network_to_bytes(learned(config, 300))


def test_an_average_is_kept_next_to_the_network_in_training():
    learner = dqn(QUICK, averaging=0.99)
    learner.learn(400)
    kept, live = network_of(learner).tensors, learner.q_net.state_dict()
    name = "q_net.0.weight"
    assert not torch.equal(live[name], kept[name])
    np.testing.assert_allclose(live[name], kept[name], atol=0.2)


def test_nothing_is_left_in_the_temporary_files(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    dqn(QUICK).learn(200)
    assert list(tmp_path.iterdir()) == []
