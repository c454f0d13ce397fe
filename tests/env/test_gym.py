from __future__ import annotations

import subprocess
import sys

import gymnasium
import pytest

from bimvox.env import gym

HEAVY = ("numba", "torch", "stable_baselines3", "bimvox.paper.env.spec", "bimvox.rendering")


@pytest.mark.parametrize("env_id", [*gym.PAPER_ENV_IDS, gym.LIFT_ENV_ID])
def test_importing_the_module_registers_and_loads_nothing_heavy(env_id):
    code = (
        f"import gymnasium, sys; import bimvox.env.gym; assert not set({HEAVY!r}) & set(sys.modules); "
        f"print(gymnasium.spec('{env_id}').id)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == env_id


def test_made_by_module_and_id():
    env = gymnasium.make("bimvox.env.gym:bimvox/PrefabFrame-v0")
    assert env.unwrapped.site_spec.shape == (15, 15, 8)


def test_registering_twice_is_harmless():
    gym.register()
    assert set(gym.PAPER_ENV_IDS) <= set(gymnasium.registry)
    spec = gymnasium.spec("bimvox/PrefabFrame-v0")
    assert gymnasium.envs.registration.EnvSpec.from_json(spec.to_json()).kwargs == {"site": "frame"}
