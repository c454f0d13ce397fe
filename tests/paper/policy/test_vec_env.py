from __future__ import annotations

import numpy as np
import pytest
import torch
from stable_baselines3 import DQN
from stable_baselines3.common.vec_env import VecMonitor

from bimvox.paper.env.batched import BatchedPaperSite
from bimvox.paper.env.component import YardPose
from bimvox.paper.env.layout import PaperLayout
from bimvox.paper.env.presets import PAPER
from bimvox.paper.policy.vec_env import PaperVecEnv


def test_steps_in_the_form_of_stable_baselines():
    env = PaperVecEnv(BatchedPaperSite(PAPER, 2, observation="paper"))
    assert env.reset().shape == (2, 15, 15, 6)
    env.batch.place(0, PaperLayout((YardPose(4, 7, "y"),), ((7, 7, 1),)))
    for action in (3, 3, 3):
        _, _, dones, infos = env.step(np.array([action, 4]))
        assert not dones.any()
        assert infos == [{}, {}]
    _, rewards, dones, infos = env.step(np.array([5, 4]))
    assert dones.tolist() == [True, False]
    assert rewards.tolist() == [1.0, -1.0]
    assert infos[1] == {}
    assert (infos[0]["is_success"], infos[0]["TimeLimit.truncated"], infos[0]["assembled"]) == (True, False, 1)
    assert infos[0]["terminal_observation"][7, 7].tolist() == [0, 0, 0, 4, 1, 1]
    env.close()


@pytest.mark.parametrize("copy", [True, False])
def test_the_observation_before_the_last_is_still_valid(copy):
    env = PaperVecEnv(BatchedPaperSite(PAPER, 3, seed=1, turns=2), copy=copy)
    last = env.reset()
    for _ in range(4):
        kept = last.copy()
        now, *_ = env.step(np.array([0, 2, 3]))
        np.testing.assert_array_equal(last, kept)
        last = now


def test_seeding_through_stable_baselines():
    def life():
        env = PaperVecEnv(BatchedPaperSite(PAPER, 4, seed=9))
        env.seed(3)
        return env.reset()

    np.testing.assert_array_equal(life(), life())


def test_attributes_are_shared_and_methods_refused():
    env = PaperVecEnv(BatchedPaperSite(PAPER, 2))
    assert env.get_attr("num_envs") == [2, 2]
    assert env.env_is_wrapped(VecMonitor) == [False, False]
    with pytest.raises(NotImplementedError, match="of their own to set"):
        env.set_attr("num_envs", 3)
    with pytest.raises(NotImplementedError, match="of their own to call"):
        env.env_method("reset")


def test_a_learner_accepts_it():
    torch.set_num_threads(1)  # more threads are slower on layers this small
    env = VecMonitor(PaperVecEnv(BatchedPaperSite(PAPER, 4, observation="paper", seed=0, turns=2), copy=False))
    dqn = DQN("MlpPolicy", env, learning_starts=50, buffer_size=500, seed=0, policy_kwargs={"net_arch": [8]})
    dqn.learn(200)
    assert dqn.num_timesteps >= 200
    assert len(dqn.ep_info_buffer) == 4


def test_without_copies_two_arrays_are_needed():
    with pytest.raises(ValueError, match="make it with turns=2"):
        PaperVecEnv(BatchedPaperSite(PAPER, 2), copy=False)
