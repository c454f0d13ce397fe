import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded

import bimvox  # noqa: F401  (registers)
from bimvox.env.dynamics import StepLimit
from bimvox.env.lift_env import LiftEnv
from bimvox.env.lift_vector_env import LiftVectorEnv
from bimvox.errors import ActionError


def test_make_vec_gives_the_environment_of_many_lifts():
    envs = gymnasium.make_vec("bimvox/Lift-v0", num_envs=3)
    assert isinstance(envs.unwrapped, LiftVectorEnv)
    observations, infos = envs.reset(seed=5)
    assert observations.shape == (3, 2597)
    assert envs.observation_space.contains(observations)
    assert infos["cell_vox"].shape == (3, 3)
    again, _ = gymnasium.make_vec("bimvox/Lift-v0", num_envs=3).reset(seed=5)
    np.testing.assert_array_equal(observations, again)
    envs.close()


def test_every_lift_does_what_the_single_environment_does():
    limit, draw = StepLimit(1.5, 5), np.random.default_rng(0)
    envs, ones = LiftVectorEnv(4, limit=limit, threads=2), [LiftEnv(limit=limit) for _ in range(4)]
    _, infos = envs.reset(seed=1)
    for one, cell in zip(ones, infos["cell_vox"], strict=True):
        one.reset(options={"problem": 0, "start": cell})
    episodes = 0
    for _ in range(300):
        actions = draw.integers(6, size=4)
        observations, rewards, terminated, truncated, infos = envs.step(actions)
        for n, one in enumerate(ones):
            seen, reward, ends, late, info = one.step(actions[n])
            assert (rewards[n], terminated[n], truncated[n]) == (pytest.approx(reward), ends, late)
            if not (ends or late):
                np.testing.assert_array_equal(observations[n], seen)
                assert tuple(infos["cell_vox"][n]) == info["cell_vox"]
                continue
            episodes += 1
            np.testing.assert_array_equal(infos["final_obs"][n], seen)
            assert infos["_final_obs"][n]
            assert infos["final_info"]["is_success"][n] == info["is_success"]
            first, _ = one.reset(options={"problem": 0, "start": infos["cell_vox"][n]})
            np.testing.assert_array_equal(observations[n], first)
    assert episodes > 4
    envs.close()


def test_arrays_are_copies_unless_they_are_not_wanted():
    kept, own = LiftVectorEnv(2), LiftVectorEnv(2, copy=False)
    for envs in (kept, own):
        envs.reset(seed=0)
    actions = np.zeros(2, np.int64)
    first = [envs.step(actions)[0] for envs in (kept, own)]
    before = first[0].copy()
    for _ in range(2):
        for envs in (kept, own):
            envs.step(actions + 4)
    np.testing.assert_array_equal(first[0], before)
    assert not np.array_equal(first[1], before)


def test_what_it_cannot_do_is_refused():
    envs = LiftVectorEnv(2)
    with pytest.raises(ResetNeeded):
        envs.step(np.zeros(2, np.int64))
    with pytest.raises(ValueError, match="option"):
        envs.reset(options={"start": (0, 0, 0)})
    envs.reset()
    with pytest.raises(ActionError):
        envs.step(np.full(2, 6))
    with pytest.raises(ValueError, match="render"):
        LiftVectorEnv(2, render_mode="rgb_array")
