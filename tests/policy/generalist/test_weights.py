from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from benchmarks.train_generalist import save_generalist
from bimvox.env.problem import lift_problem
from bimvox.errors import PolicyError
from bimvox.planning.rollout import roll_out_all
from bimvox.policy.generalist.problems import FAMILIES, random_problem
from bimvox.policy.generalist.weights import FOLDER, generalist_record, load_generalist
from bimvox.policy.network import QNetwork


def test_the_shipped_network_is_small_and_records_its_training():
    size = sum(file.stat().st_size for file in FOLDER.iterdir())
    assert size < 2_000_000
    record = generalist_record()
    assert {"id", "config", "seed", "steps", "lessons", "observation"} <= set(record)
    assert load_generalist() is load_generalist()


def test_it_solves_most_unseen_problems():
    problems = [random_problem((2, 500 + n), list(FAMILIES)[n % 5], (15, 15, 6), (32, 32, 14)) for n in range(20)]
    rollouts = roll_out_all(load_generalist(), [lift_problem(p.space, p.start_vox, p.target_vox) for p in problems])
    assert sum(rollout.arrived for rollout in rollouts) >= 18
    ratio = [
        (len(rollout.path_vox) - 1) / p.distance_from(p.start_vox)
        for p, rollout in zip(problems, rollouts, strict=True)
        if rollout.arrived
    ]
    assert np.mean(ratio) < 1.1


def test_weights_are_stored_in_half_precision(tmp_path):
    network = load_generalist()
    save_generalist(network, {"steps": 1}, tmp_path)
    again = load_generalist(tmp_path)
    for a, b in zip(network.weights, again.weights, strict=True):
        np.testing.assert_array_equal(a, b)
    assert isinstance(again, QNetwork)


def test_damaged_weights_are_refused(tmp_path):
    save_generalist(load_generalist(), {}, tmp_path)
    file = tmp_path / "generalist.safetensors"
    file.write_bytes(file.read_bytes()[:-1] + b"\x7f")
    with pytest.raises(PolicyError, match="not what"):
        load_generalist(tmp_path)
    (tmp_path / "none").mkdir()
    with pytest.raises(PolicyError, match="cannot be read"):
        load_generalist(tmp_path / "none")


def test_it_is_used_without_torch():
    code = (
        "import sys; from bimvox.policy.generalist.weights import load_generalist; load_generalist(); "
        "print(sorted({'torch', 'stable_baselines3'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
