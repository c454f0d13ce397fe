from __future__ import annotations

import itertools
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bimvox.env.observation import FRAME_ACTIONS, FRAME_COUNT, INPUT_SIZE, VIEW_SIZE
from bimvox.errors import PolicyError
from bimvox.policy.network import GROUP, NO_SUMS, QNetwork, network_from_arrays, sparse_layer, sums_of_groups


def random_network(seed: int = 0, hidden: tuple[int, ...] = (16, 8)) -> QNetwork:
    random = np.random.default_rng(seed)
    sizes = (INPUT_SIZE, *hidden, 6)
    return QNetwork(
        tuple(
            random.standard_normal((a, b)).astype(np.float32) / np.float32(a) ** 0.5
            for a, b in itertools.pairwise(sizes)
        ),
        tuple(random.standard_normal(b).astype(np.float32) for b in sizes[1:]),
    )


def sparse_observations(count: int) -> np.ndarray:
    random = np.random.default_rng(1)
    rows = random.uniform(-1, 1, (count, VIEW_SIZE)).astype(np.float32)
    rows *= random.random(rows.shape) < 0.3
    rows[:, -1] = random.integers(FRAME_COUNT, size=count) / (FRAME_COUNT - 1)
    return rows


def mostly_blocked(count: int) -> np.ndarray:
    """Return inputs like those of real lifts: most are 1, some 0, some between."""
    random = np.random.default_rng(2)
    rows = sparse_observations(count)
    inputs = rows[:, :INPUT_SIZE]
    inputs[random.random(inputs.shape) < 0.6] = 1.0
    inputs[0], inputs[1] = 1.0, 0.0
    return rows


@pytest.mark.parametrize("observations_of", [sparse_observations, mostly_blocked])
def test_equal_to_torch(observations_of):
    torch = pytest.importorskip("torch")
    network = random_network(hidden=(64, 32))
    layers = []
    for weight, bias in zip(network.weights, network.biases, strict=True):
        layer = torch.nn.Linear(*weight.shape)
        layer.weight.data = torch.from_numpy(weight.T.copy())
        layer.bias.data = torch.from_numpy(bias.copy())
        layers += [layer, torch.nn.ReLU()]
    observations = observations_of(50)
    with torch.no_grad():
        in_frame = torch.nn.Sequential(*layers[:-1])(torch.from_numpy(observations[:, :INPUT_SIZE])).numpy()
    frames = np.rint(observations[:, -1] * (FRAME_COUNT - 1)).astype(int)
    expected = np.take_along_axis(in_frame, FRAME_ACTIONS[frames], axis=1)
    np.testing.assert_allclose(network(observations), expected, atol=1e-5)


@pytest.mark.parametrize("observations_of", [sparse_observations, mostly_blocked])
def test_a_row_does_not_depend_on_the_others(observations_of):
    network, observations = random_network(), observations_of(35)
    together = network(observations)
    for n in range(35):
        np.testing.assert_array_equal(network(observations[n : n + 1])[0], together[n])


def test_arrays_make_the_same_network():
    network = random_network()
    again = network_from_arrays(network.arrays())
    assert again.layer_sizes == network.layer_sizes == (INPUT_SIZE, 16, 8, 6)
    np.testing.assert_array_equal(again(sparse_observations(3)), network(sparse_observations(3)))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda a: a.pop("layer1.bias"), "named"),
        (lambda a: a.clear(), "named"),
        (lambda a: a.update({"layer0.weight": a["layer0.weight"][:-1]}), "an observation has 2,597 numbers"),
        (lambda a: a.update({"layer1.weight": a["layer1.weight"][:-1]}), "it takes"),
        (lambda a: a.update({"layer1.weight": a["layer1.weight"].astype(np.float64)}), "not float32"),
        (lambda a: a["layer2.bias"].__setitem__(0, np.nan), "not finite"),
        (
            lambda a: a.update({"layer2.weight": a["layer2.weight"][:, :5], "layer2.bias": a["layer2.bias"][:5]}),
            "5 val",
        ),
    ],
)
def test_arrays_that_are_not_a_network_are_refused(change, message):
    arrays = random_network().arrays()
    change(arrays)
    with pytest.raises(PolicyError, match=message):
        network_from_arrays(arrays)


def test_using_a_policy_does_not_import_torch():
    code = (
        "import bimvox.policy, bimvox.policy.network, bimvox.policy.store, bimvox.policy.train, "
        "bimvox.planning.rollout, sys; "
        "print(sorted({'torch', 'stable_baselines3'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_observations_of_another_size_are_refused():
    with pytest.raises(ValueError, match="not \\(N, "):
        random_network()(np.zeros((2, VIEW_SIZE - 1), np.float32))


@given(
    st.integers(1, 3 * GROUP + 5),
    st.integers(1, 20),
    st.integers(1, 40),
    st.sampled_from([(0.9, 0.0), (0.0, 0.9), (0.4, 0.4), (0.0, 0.0), (1.0, 0.0)]),
    st.booleans(),
    st.integers(0, 2**32 - 1),
)
def test_it_is_the_product(inputs, outputs, rows, shares, rectify, seed):
    random = np.random.default_rng(seed)
    weight = random.standard_normal((inputs, outputs)).astype(np.float32)
    bias = random.standard_normal(outputs).astype(np.float32)
    values = random.uniform(-1, 1, (rows, inputs + 2)).astype(np.float32)
    drawn = random.random(values.shape)
    values[drawn < shares[0]] = 1.0
    values[drawn > 1.0 - shares[1]] = 0.0
    wanted = values[:, :inputs].astype(np.float64) @ weight + bias
    if rectify:
        wanted = np.maximum(wanted, 0.0)
    for sums in (sums_of_groups(weight), NO_SUMS):
        found = sparse_layer(values, weight, bias, sums, rectify)
        np.testing.assert_allclose(found, wanted, atol=2e-4)
        alone = np.concatenate([sparse_layer(values[n : n + 1], weight, bias, sums, rectify) for n in range(rows)])
        np.testing.assert_array_equal(alone, found)
