from __future__ import annotations

import json

import numpy as np
import pytest
from paper_lessons import QUICK, drawn_network

from bimvox.errors import PolicyError
from bimvox.paper.policy.initialization import BasicPolicy
from bimvox.paper.policy.learning import CurvePoint
from bimvox.paper.policy.store import load_basic_policy, network_from_bytes, network_to_bytes, save_basic_policy


@pytest.fixture
def saved(tmp_path):
    network = drawn_network(np.random.default_rng(0), 12, dueling=True)
    curve = (CurvePoint(100, 0.5, -3.0, None), CurvePoint(200, 1.0, -1.0, 0.9))
    policy = BasicPolicy(network, True, curve, 200, QUICK, 7)
    save_basic_policy(policy, tmp_path / "basic")
    return policy, tmp_path / "basic"


def test_predictions_after_loading_are_identical(saved):
    policy, path = saved
    loaded = load_basic_policy(path)
    observations = np.random.default_rng(1).normal(size=(50, 12)).astype(np.float32)
    np.testing.assert_array_equal(loaded.network(observations), policy.network(observations))
    assert (loaded.reached, loaded.curve, loaded.steps, loaded.config, loaded.seed) == (
        policy.reached,
        policy.curve,
        policy.steps,
        policy.config,
        policy.seed,
    )


def test_the_same_network_gives_the_same_bytes():
    network = drawn_network(np.random.default_rng(0), 12, dueling=True)
    content = network_to_bytes(network)
    assert network_to_bytes(network_from_bytes(content)) == content


def test_damaged_files_are_refused(saved):
    _, path = saved
    weights = path.with_suffix(".safetensors")
    whole = weights.read_bytes()
    weights.write_bytes(whole[:-1] + bytes([whole[-1] ^ 1]))
    with pytest.raises(PolicyError, match="not those"):
        load_basic_policy(path)
    weights.unlink()
    with pytest.raises(PolicyError, match="cannot be read"):
        load_basic_policy(path)
    with pytest.raises(PolicyError, match="not a safetensors file"):
        network_from_bytes(b"\x80\x04.")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"format_version": 99}, "format version"),
        ({"config": {}}, "other keys"),
        ({"seed": None}, "impossible"),
        ({"curve": [[1]]}, "impossible"),
    ],
)
def test_descriptions_of_other_versions_are_refused(saved, change, message):
    _, path = saved
    file = path.with_suffix(".json")
    file.write_text(json.dumps({**json.loads(file.read_text()), **change}))
    with pytest.raises(PolicyError, match=message):
        load_basic_policy(path)


@pytest.mark.parametrize("text", ["[]", "{", "nothing"])
def test_descriptions_that_are_none(saved, text):
    _, path = saved
    path.with_suffix(".json").write_text(text)
    with pytest.raises(PolicyError, match="JSON"):
        load_basic_policy(path)
