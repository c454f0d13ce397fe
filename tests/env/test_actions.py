"""Every environment refuses an action outside its space instead of reading memory next to the table of moves."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest

from bimvox.env import gym
from bimvox.env.actions import ACTION_COUNT, MOVES, Action, checked_action, checked_actions
from bimvox.env.batched import BatchedLiftEnv
from bimvox.env.problem import default_problem
from bimvox.errors import ActionError
from bimvox.paper.env.batched import BatchedPaperSite
from bimvox.paper.env.spec import PAPER
from bimvox.policy.vec_env import BatchVecEnv


def test_moves_are_the_six_unit_moves_in_the_papers_order():
    named = {action.name: tuple(MOVES[action].tolist()) for action in Action}
    assert named == {
        "FORWARD": (0, 1, 0),
        "BACKWARD": (0, -1, 0),
        "LEFT": (-1, 0, 0),
        "RIGHT": (1, 0, 0),
        "UP": (0, 0, 1),
        "DOWN": (0, 0, -1),
    }
    assert MOVES.shape == (ACTION_COUNT, 3)
    assert MOVES.dtype == np.int32
    assert not MOVES.flags.writeable


OUTSIDE = [7, 6, -1, 2.5, np.float64(2.0), np.nan, "up", None, [1]]
OUTSIDE_OF_TWO = [[0, 7], [-1, 0], [0.0, 2.5], [0], [0, 1, 2], 3, [[0, 1]], ["up", "down"]]


@pytest.mark.parametrize("action", OUTSIDE, ids=repr)
@pytest.mark.parametrize("env_id", [*gym.PAPER_ENV_IDS, gym.LIFT_ENV_ID])
def test_one_environment(env_id, action):
    env = gymnasium.make(env_id, disable_env_checker=True)
    env.reset(seed=0)
    with pytest.raises(ActionError, match="an integer from 0 to 5 is needed") as caught:
        env.step(action)
    assert caught.value.actions is action
    env.step(np.int64(5))


@pytest.mark.parametrize("env_id", gym.PAPER_ENV_IDS)
def test_vector_environments(env_id):
    envs = gymnasium.make_vec(env_id, num_envs=2)
    envs.reset(seed=0)
    for actions in OUTSIDE_OF_TWO:
        with pytest.raises(ActionError, match="2 integers from 0 to 5"):
            envs.step(actions)
    envs.step(np.array([0, 5]))
    envs.close()


@pytest.mark.parametrize("actions", OUTSIDE_OF_TWO, ids=repr)
def test_batches_and_their_adapters(actions):
    lifts, sites = BatchedLiftEnv([default_problem()], 2), BatchedPaperSite(PAPER, 2)
    for env in (lifts, sites, BatchVecEnv(lifts), BatchVecEnv(sites)):
        env.reset()
        with pytest.raises(ActionError, match="2 integers from 0 to 5"):
            env.step(actions)
        env.step(np.array([0, 5]))


def test_an_action_is_returned_as_an_integer():
    for action in (3, np.int64(3), np.uint8(3), np.array(3)):
        assert checked_action(action) == 3
    assert checked_actions([0, 5], 2).dtype == np.int64
