from __future__ import annotations

import numpy as np
import pytest

from bimvox.env.batched import BatchedLiftEnv
from bimvox.env.default_problem import default_problem
from bimvox.env.dynamics import StepLimit
from bimvox.policy.vec_env import LiftVecEnv


def test_ends_of_episodes_reach_the_learner():
    batch = BatchedLiftEnv([default_problem()], 3, limit=StepLimit(1.0, 1), seed=0)
    env = LiftVecEnv(batch)
    first = env.reset()
    assert env.observation_space.contains(first[0])
    batch.place(0, 0, (7, 7, 2))
    batch.place(1, 0, (7, 7, 2))
    batch.place(2, 0, (2, 2, 2))
    _, _, dones, infos = env.step(np.array([5, 4, 1]))
    assert dones.tolist() == [True, False, False]
    assert infos[0]["is_success"]
    assert not infos[0]["TimeLimit.truncated"]
    assert infos[0]["terminal_observation"].shape == first[0].shape
    assert infos[1] == infos[2] == {}
    observations, rewards, dones, infos = env.step(np.array([0, 4, 1]))
    assert dones[1]
    assert infos[1]["TimeLimit.truncated"]
    assert not infos[1]["is_success"]
    assert (observations.dtype, rewards.dtype, dones.dtype) == (np.float32, np.float32, np.bool_)


def test_what_is_returned_is_the_learners_to_keep():
    env = LiftVecEnv(BatchedLiftEnv([default_problem()], 2, seed=0))
    kept = env.reset()
    copy = kept.copy()
    env.step(np.array([4, 4]))
    np.testing.assert_array_equal(kept, copy)


def test_equal_seeds_give_equal_results():
    lives = []
    for _ in range(2):
        env = LiftVecEnv(BatchedLiftEnv([default_problem()], 4, seed=9))
        env.seed(3)
        lives.append(env.reset())
    np.testing.assert_array_equal(*lives)


def test_lifts_of_a_batch_have_nothing_of_their_own():
    env = LiftVecEnv(BatchedLiftEnv([default_problem()], 2))
    assert env.get_attr("render_mode") == [None, None]
    assert env.env_is_wrapped(object) == [False, False]
    with pytest.raises(NotImplementedError, match="colour"):
        env.set_attr("colour", 1)
    with pytest.raises(NotImplementedError, match="dance"):
        env.env_method("dance")
