from __future__ import annotations

import numpy as np
import pytest
from paper_lessons import drawn_network

from bimvox.errors import PolicyError
from bimvox.policy.learner.network import network_from_bytes, network_to_bytes, value_network_from_arrays


def test_dueling_is_the_states_value_plus_centred_advantages():
    rng = np.random.default_rng(0)
    network = drawn_network(rng, 7, dueling=True)
    observations = rng.normal(size=(5, 7)).astype(np.float32)
    values = network(observations)
    advantages, state = network.actions(observations), network.state(observations)
    np.testing.assert_allclose(values.mean(axis=1, keepdims=True), state, atol=1e-6)
    np.testing.assert_allclose(np.diff(values), np.diff(advantages), atol=1e-5)


@pytest.mark.parametrize("dueling", [True, False])
def test_arrays_and_back(dueling):
    rng = np.random.default_rng(1)
    network = drawn_network(rng, 7, dueling=dueling)
    observations = rng.normal(size=(5, 7)).astype(np.float32)
    again = value_network_from_arrays(network.arrays())
    np.testing.assert_array_equal(again(observations), network(observations))
    assert again.inputs == 7


def test_each_row_is_what_it_would_be_alone():
    rng = np.random.default_rng(2)
    network = drawn_network(rng, 7, dueling=True)
    observations = rng.normal(size=(9, 7)).astype(np.float32)
    alone = np.concatenate([network(row[None]) for row in observations])
    np.testing.assert_array_equal(network(observations), alone)


def broken(arrays, name):
    if name == "missing":
        del arrays["actions.layer1.bias"]
    elif name == "stream":
        arrays["other.layer0.weight"] = arrays["actions.layer0.weight"]
    elif name == "type":
        arrays["actions.layer0.weight"] = arrays["actions.layer0.weight"].astype(np.float64)
    elif name == "shape":
        arrays["actions.layer1.weight"] = arrays["actions.layer1.weight"][:3]
    elif name == "outputs":
        arrays["state.layer1.weight"] = arrays["state.layer1.weight"].repeat(2, axis=1)
        arrays["state.layer1.bias"] = arrays["state.layer1.bias"].repeat(2)
    elif name == "inputs":
        arrays["state.layer0.weight"] = arrays["state.layer0.weight"][:5]
    else:
        arrays["actions.layer0.bias"][0] = np.nan
    return arrays


@pytest.mark.parametrize("name", ["missing", "stream", "type", "shape", "outputs", "inputs", "finite"])
def test_arrays_that_are_not_a_network(name):
    arrays = drawn_network(np.random.default_rng(3), 7, dueling=True).arrays()
    with pytest.raises(PolicyError):
        value_network_from_arrays(broken(dict(arrays), name))


def test_the_same_network_gives_the_same_bytes():
    network = drawn_network(np.random.default_rng(0), 12, dueling=True)
    content = network_to_bytes(network)
    assert network_to_bytes(network_from_bytes(content)) == content


def test_predictions_after_loading_are_identical():
    network = drawn_network(np.random.default_rng(0), 12, dueling=True)
    observations = np.random.default_rng(1).normal(size=(50, 12)).astype(np.float32)
    np.testing.assert_array_equal(network_from_bytes(network_to_bytes(network))(observations), network(observations))


def test_damaged_bytes_are_refused():
    with pytest.raises(PolicyError, match="not a safetensors file"):
        network_from_bytes(b"\x80\x04.")
