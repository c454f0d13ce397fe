from __future__ import annotations

import gymnasium
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
from bimvox.paper.env.spec import PAPER, YardPose
from bimvox.paper.policy.config import PAPER_MODE
from bimvox.policy.config import DqnConfig
from bimvox.policy.replay import ViewReplay
from bimvox.policy.vec_env import BatchVecEnv

SPACES = (gymnasium.spaces.Box(-1.0, 1.0, (3,), np.float32), gymnasium.spaces.Discrete(6))
PRIORITIZED = PAPER_MODE.__class__(priority=1.0)


def memory(config, size=8, n_envs=2):
    return ViewReplay(size, *SPACES, n_envs=n_envs, config=config, seed=0)


def add(replay, number):
    views = torch.full((2, 3), number / 127)
    zeros = torch.zeros(2)
    replay.add(replay.packed(views), replay.packed(views), zeros, zeros + number, zeros, torch.zeros(0, 6))


def test_the_oldest_transitions_are_overwritten():
    replay = memory(DqnConfig())
    for number in range(6):
        add(replay, number)
    batch = replay.sample(200)
    assert set(batch.rewards.ravel().tolist()) == {2.0, 3.0, 4.0, 5.0}
    np.testing.assert_allclose(batch.views[:, 0] * 127, batch.rewards[:, 0], rtol=1e-6)


def test_transitions_that_were_farther_off_are_drawn_more_often():
    replay = memory(PRIORITIZED)
    for number in range(4):
        add(replay, number)
    rows = torch.arange(8)
    errors = torch.zeros(8, 1)
    errors[7] = 0.21  # and 0.01 is added to each
    replay.note_errors(rows, errors)
    drawn = replay.sample(10_000)
    assert abs((drawn.rows == 7).double().mean() - 0.22 / 0.29) < 0.02
    weights = replay.importance(rows, 1.0)[:, 0]
    np.testing.assert_allclose(weights, [1.0] * 7 + [1 / 22], rtol=1e-5)


def test_what_is_new_has_the_greatest_priority():
    replay = memory(PRIORITIZED)
    add(replay, 0)
    replay.note_errors(torch.arange(2), torch.tensor([[0.0], [0.09]]))
    add(replay, 1)
    counts = np.bincount(replay.sample(20_000).rows, minlength=4) / 20_000
    np.testing.assert_allclose(counts, np.array([1, 10, 10, 10]) / 31, atol=0.02)


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
