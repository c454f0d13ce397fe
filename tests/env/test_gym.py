from __future__ import annotations

import subprocess
import sys

import gymnasium
import numpy as np
import pytest

from bimvox.env import gym
from bimvox.env.actions import MOVES

EVERY_ID = (*gym.PAPER_ENV_IDS, gym.LIFT_ENV_ID, gym.LIVE_ENV_ID)
HEAVY = ("numba", "torch", "stable_baselines3", "bimvox.paper.env.spec", "bimvox.rendering")


def test_importing_the_module_registers_and_loads_nothing_heavy():
    code = (
        f"import gymnasium, sys; import bimvox.env.gym; assert not set({HEAVY!r}) & set(sys.modules); "
        f"print(*(gymnasium.spec(one).id for one in {EVERY_ID!r}))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert tuple(done.stdout.split()) == EVERY_ID


def test_made_by_module_and_id():
    env = gymnasium.make("bimvox.env.gym:bimvox/PrefabFrame-v0")
    assert env.unwrapped.site_spec.shape == (15, 15, 8)


@pytest.mark.parametrize(
    "code",
    [
        # First gymnasium, then its own import of the package: the test of first observations, below.
        "import bimvox; import gymnasium; spec = gymnasium.spec('bimvox/Lift-v0')",
        "import gymnasium; import bimvox; spec = gymnasium.spec('bimvox/Lift-v0')",
        pytest.param(
            "import bimvox; import gymnasium; spec = gymnasium.make('bimvox:bimvox/Lift-v0').spec",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_the_package_is_enough_for_gymnasium_to_find_the_ids(code):
    done = subprocess.run([sys.executable, "-c", f"{code}; print(spec.id)"], capture_output=True, text=True, check=True)
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


@pytest.mark.parametrize("env_id", [*gym.PAPER_ENV_IDS, gym.LIFT_ENV_ID])
def test_the_shortest_paths_solve_an_environment_and_five_percent_more_moves_do_it_just(env_id):
    env = gymnasium.make(env_id)
    threshold = env.spec.reward_threshold
    returns = []
    for seed in range(60):
        _, info = env.reset(seed=seed)
        total, done = 0.0, False
        while not done:
            _, reward, terminated, truncated, info = env.step(_nearer(env.unwrapped, info["cell_vox"]))
            total, done = total + float(reward), terminated or truncated
        assert info["is_success"]
        returns.append(total)
    error = np.std(returns) / np.sqrt(len(returns))
    assert np.mean(returns) + 3 * error > threshold
    assert np.mean(returns) - 3 * error < threshold + 0.06 * abs(threshold)


def _nearer(env, cell):
    """Return a move along the exact distance."""
    distances = env.distance_field() if hasattr(env, "distance_field") else env.problem.distance
    here = np.array(cell)
    for action, offset in enumerate(MOVES):
        there = here + offset
        inside = (there >= 0).all() and (there < distances.shape).all()
        if inside and 0 <= distances[tuple(there)] < distances[tuple(here)]:
            return action
    raise AssertionError(f"no move from {cell} is nearer to the target")


@pytest.mark.parametrize("env_id", [*gym.PAPER_ENV_IDS, gym.LIFT_ENV_ID])
def test_every_environment_draws_itself_as_pixels(env_id):
    env = gymnasium.make(env_id, render_mode="rgb_array")
    env.reset(seed=0)
    pixels = env.render()
    assert pixels.dtype == np.uint8
    assert pixels.shape[2] == 3
    assert pixels.std() > 0


@pytest.mark.parametrize("env_id", EVERY_ID)
def test_an_option_that_no_reset_knows_is_refused(env_id):
    with pytest.raises(ValueError, match="options: 'nothing' unknown"):
        gymnasium.make(env_id).reset(options={"nothing": 1})


@pytest.mark.parametrize("env_id", gym.PAPER_ENV_IDS)
def test_many_sites_at_once_take_no_options(env_id):
    with pytest.raises(ValueError, match="options: 'layout' unknown; there are none"):
        gymnasium.make_vec(env_id, num_envs=2).reset(options={"layout": None})


FIRST = f"""
import time, gymnasium
for one in {EVERY_ID!r}:
    gymnasium.make("bimvox:" + one).reset(seed=0)
print(time.process_time())
"""


@pytest.mark.slow
def test_the_first_observations_of_a_fresh_process_come_soon():
    for _ in range(2):  # the first run may compile
        ran = subprocess.run([sys.executable, "-c", FIRST], capture_output=True, text=True, check=True)
        if float(ran.stdout) < 6.0:  # all of them in the time that one may take
            return
    raise AssertionError(f"{ran.stdout} s of processor time")
