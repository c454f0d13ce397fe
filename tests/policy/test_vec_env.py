from __future__ import annotations

import numpy as np
import pytest
import torch
from stable_baselines3 import DQN
from stable_baselines3.common.vec_env import VecMonitor

from bimvox.env.batched import BatchedLiftEnv
from bimvox.env.dynamics import StepLimit
from bimvox.env.problem import default_problem
from bimvox.paper.env.batched import BatchedPaperSite
from bimvox.paper.env.layout import PaperLayout
from bimvox.paper.env.presets import PAPER
from bimvox.paper.env.spec import YardPose
from bimvox.policy.vec_env import BatchVecEnv


def lifts(count, seed=0, **choices):
    return BatchVecEnv(BatchedLiftEnv([default_problem()], count, seed=seed, **choices))


def sites(count, seed=0):
    return BatchVecEnv(BatchedPaperSite(PAPER, count, observation="paper", seed=seed))


of_both = pytest.mark.parametrize("made", [lifts, sites])


def test_ends_of_episodes_reach_the_learner():
    env = lifts(3, limit=StepLimit(1.0, 1))
    first = env.reset()
    assert env.observation_space.contains(first[0])
    env.batch.place(0, 0, (7, 7, 2))
    env.batch.place(1, 0, (7, 7, 2))
    env.batch.place(2, 0, (2, 2, 2))
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


def test_an_assembled_site_reaches_the_learner():
    env = sites(2)
    assert env.reset().shape == (2, 15, 15, 6)
    env.batch.place(0, PaperLayout((YardPose(4, 7, "y"),), ((7, 7, 1),)))
    for action in (3, 3, 3):
        _, _, dones, infos = env.step(np.array([action, 4]))
        assert not dones.any()
        assert infos == [{}, {}]
    _, rewards, dones, infos = env.step(np.array([5, 4]))
    assert (dones.tolist(), rewards.tolist(), infos[1]) == ([True, False], [1.0, -1.0], {})
    assert (infos[0]["is_success"], infos[0]["TimeLimit.truncated"]) == (True, False)
    assert infos[0]["terminal_observation"][7, 7].tolist() == [0, 0, 0, 4, 1, 1]


@of_both
def test_the_observation_before_the_last_is_still_valid(made):
    env = made(3)
    last = env.reset()
    for _ in range(4):
        kept = last.copy()
        now, *_ = env.step(np.array([0, 2, 3]))
        np.testing.assert_array_equal(last, kept)
        last = now


@of_both
def test_equal_seeds_give_equal_results(made):
    begun = []
    for _ in range(2):
        env = made(4, seed=9)
        env.seed(3)
        begun.append(env.reset().copy())
    np.testing.assert_array_equal(*begun)


def test_environments_of_a_batch_have_nothing_of_their_own():
    env = lifts(2)
    assert env.get_attr("render_mode") == [None, None]
    assert env.env_is_wrapped(VecMonitor) == [False, False]
    with pytest.raises(NotImplementedError, match="colour"):
        env.set_attr("colour", 1)
    with pytest.raises(NotImplementedError, match="dance"):
        env.env_method("dance")


def test_a_learner_of_stable_baselines_accepts_it():
    torch.set_num_threads(1)  # more threads are slower on layers this small
    env = VecMonitor(sites(4))
    dqn = DQN("MlpPolicy", env, learning_starts=50, buffer_size=500, seed=0, policy_kwargs={"net_arch": [8]})
    dqn.learn(200)
    assert dqn.num_timesteps >= 200
    assert len(dqn.ep_info_buffer) == 4
