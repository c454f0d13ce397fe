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


@pytest.mark.parametrize(
    "code",
    [
        "import gymnasium; env = gymnasium.make('bimvox:bimvox/Lift-v0')",
        "import bimvox; import gymnasium; env = gymnasium.make('bimvox/Lift-v0')",
        "import gymnasium; import bimvox; env = gymnasium.make('bimvox/Lift-v0')",
        "import bimvox; import gymnasium; env = gymnasium.make('bimvox:bimvox/Lift-v0')",
    ],
)
def test_the_package_is_enough_for_gymnasium_to_find_the_ids(code):
    done = subprocess.run(
        [sys.executable, "-c", f"{code}; print(env.spec.id)"], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "bimvox/Lift-v0"


def test_gymnasium_keeps_its_own_loader():
    code = (
        "import bimvox, gymnasium, sys; print(type(gymnasium.__loader__).__name__, type(gymnasium.__spec__.loader)"
        ".__name__, any('bimvox' in type(finder).__module__ for finder in sys.meta_path))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["SourceFileLoader", "SourceFileLoader", "False"]


def test_registering_twice_is_harmless():
    gym.register()
    assert set(gym.PAPER_ENV_IDS) <= set(gymnasium.registry)
    spec = gymnasium.spec("bimvox/PrefabFrame-v0")
    assert gymnasium.envs.registration.EnvSpec.from_json(spec.to_json()).kwargs == {"site": "frame"}
