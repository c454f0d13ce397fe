from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from paper_lessons import QUICK
from paper_lessons import TINY as TINY_PAPER

from benchmarks.train_generalist import Check, Run, train_generalist
from bimvox.env.batched import BatchedLiftEnv
from bimvox.env.problem import default_problem
from bimvox.errors import PolicyError
from bimvox.paper.policy.initialization import learn
from bimvox.paper.policy.network import network_to_bytes
from bimvox.policy.config import DqnConfig
from bimvox.policy.dqn import device_named, dqn_of_lifts, network_of
from bimvox.policy.network import QNetwork
from bimvox.policy.sb3_file import read_sb3_zip, write_sb3_zip
from bimvox.policy.train import train

TINY = DqnConfig(hidden=(16,), lifts=8, batch_size=16, learning_starts=32, gradient_steps=1, test_every=64)
TAUGHT = DqnConfig(averaging=0.99, teacher=1.0, learning_rate_last=1e-4, test_every=4_096)
IN_THE_WAY = (((3, 6, 1), (4, 9, 3)), ((10, 11, 1), (13, 12, 3)))

on_every_device = pytest.mark.parametrize(
    "device",
    [
        "cpu",
        pytest.param("cuda", marks=pytest.mark.skipif(not torch.cuda.is_available(), reason="needs an NVIDIA GPU")),
    ],
)


def taught(device: str, *, half: bool, seed: int = 0, steps: int = 1_024) -> tuple[QNetwork, Check]:
    """Return a network that learned the paper's site, and its success from a quarter of the starts."""
    checks: list[Check] = []
    problem = default_problem(obstructions=IN_THE_WAY)
    network = train_generalist(
        [problem],
        [replace(problem, start_vox=tuple(start.tolist())) for start in problem.starts_vox[::4]],
        TAUGHT,
        Run(seed, steps, device=device, half=half),
        families=1,
        report=lambda check, _: checks.append(check),
    )
    return network, checks[-1]


def assert_same(first: QNetwork, second: QNetwork) -> None:
    for name, array in first.arrays().items():
        np.testing.assert_array_equal(second.arrays()[name], array)


@pytest.fixture(params=[False, True], ids=["hidden", "pretended"])
def gpu_there(request, monkeypatch):
    """Whether torch reports a GPU; if it does so falsely, a single tensor on it is an error."""
    return lambda: monkeypatch.setattr(torch.cuda, "is_available", lambda: request.param)


@pytest.mark.slow
def test_a_gpu_in_the_machine_changes_no_policy_of_a_site(gpu_there):
    before = train([default_problem()], TINY, seed=1, steps=128).network
    gpu_there()
    assert_same(train([default_problem()], TINY, seed=1, steps=128).network, before)


def test_a_gpu_in_the_machine_changes_neither_of_the_papers_layers(gpu_there):
    def weights() -> bytes:
        found = []
        learn(TINY_PAPER, QUICK, lambda network, _: bool(found.append(network)), seed=0, budget=QUICK.test_every)
        return network_to_bytes(found[-1])

    before = weights()
    gpu_there()
    assert weights() == before


def test_a_gpu_in_the_machine_changes_no_exported_file(gpu_there, tmp_path):
    network = network_of(dqn_of_lifts(BatchedLiftEnv([default_problem()], 8), TINY, 0))
    gpu_there()
    write_sb3_zip(network, tmp_path / "policy.zip")
    assert_same(read_sb3_zip((tmp_path / "policy.zip").read_bytes()), network)


@pytest.mark.slow
@on_every_device
@pytest.mark.parametrize("half", [False, True])
def test_same_seed_same_device_same_weights(device, half):
    first, _ = taught(device, half=half)
    assert_same(taught(device, half=half)[0], first)
    assert not np.array_equal(taught(device, half=half, seed=1)[0].weights[0], first.weights[0])


@pytest.mark.slow
@on_every_device
def test_it_learns_in_half_precision(device):
    _, check = taught(device, half=True, steps=TAUGHT.test_every)
    assert check.success_rate == 1.0
    assert check.length_ratio <= 1.05


@on_every_device
def test_network_and_memory_lie_where_they_were_put(device):
    dqn = dqn_of_lifts(BatchedLiftEnv([default_problem()], 8), TINY, 0, device=device)
    dqn.learn(64)
    batch = dqn.replay_buffer.sample(4)
    assert {tensor.device.type for tensor in (*dqn.tested_parameters(), *batch)} == {device}


@pytest.mark.parametrize("name", ["cuda:99", "auto", "meta", "a fast one"])
def test_a_missing_device_is_refused_and_not_replaced(name):
    with pytest.raises(PolicyError, match=name) as caught:
        dqn_of_lifts(BatchedLiftEnv([default_problem()], 8), TINY, 0, device=name)
    assert caught.value.differs == {"device": name}
    assert "cpu" in caught.value.hint


def test_the_processor_is_always_available():
    assert device_named("cpu") == torch.device("cpu")
