from __future__ import annotations

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from bimvox.paper.env.site_env import INFO_KEYS, PaperVectorEnv
from bimvox.paper.env.spec import OBSTRUCTED, PAPER


def test_spaces_and_metadata():
    env = PaperVectorEnv(5, observation="paper")
    assert env.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP
    assert env.observation_space.shape == (5, 15, 15, 6)
    assert env.single_observation_space.shape == (15, 15, 6)
    assert env.action_space == gymnasium.spaces.MultiDiscrete([6] * 5)
    observations, infos = env.reset(seed=1)
    assert env.observation_space.contains(observations)
    assert all(infos[f"_{key}"].all() for key in INFO_KEYS)
    assert infos["component"].tolist() == [1] * 5


def test_ended_episodes_leave_their_last_observation_and_info():
    env = PaperVectorEnv(3, max_steps=2)
    env.reset(seed=0)
    *_, infos = env.step(np.array([4, 4, 4]))
    assert "final_obs" not in infos
    assert infos["bumped"].all()
    observations, rewards, terminations, truncations, infos = env.step(np.array([4, 4, 4]))
    assert truncations.all()
    assert not terminations.any()
    assert rewards.tolist() == [-1.0] * 3
    assert infos["_final_obs"].all()
    assert infos["final_info"]["steps"].tolist() == [2, 2, 2]
    assert infos["final_info"]["bumped"].all()
    assert not infos["final_info"]["is_success"].any()
    assert infos["steps"].tolist() == [0, 0, 0]
    assert not infos["bumped"].any()
    assert all(np.asarray(final).shape == (1350,) for final in infos["final_obs"])
    assert not np.array_equal(infos["final_obs"][0], observations[0])


def test_copies_belong_to_the_user_and_views_do_not():
    kept, shared = PaperVectorEnv(2), PaperVectorEnv(2, copy=False)
    actions = np.array([0, 3])
    for env in (kept, shared):
        env.reset(seed=3)
    first, view = kept.step(actions)[0], shared.step(actions)[0]
    before = first.copy()
    np.testing.assert_array_equal(first, view)
    kept.step(actions)
    shared.step(actions)
    np.testing.assert_array_equal(kept.step(actions)[0], shared.step(actions)[0])
    np.testing.assert_array_equal(first, before)
    assert not np.array_equal(view, before)


def test_seeding():
    first, second = PaperVectorEnv(4, OBSTRUCTED), PaperVectorEnv(4, OBSTRUCTED)
    np.testing.assert_array_equal(first.reset(seed=7)[0], second.reset(seed=7)[0])
    np.testing.assert_array_equal(first.reset()[0], second.reset()[0])
    assert not np.array_equal(first.reset(seed=8)[0], second.reset(seed=7)[0])
    assert not np.array_equal(PaperVectorEnv(4).reset()[0], PaperVectorEnv(4).reset()[0])


def test_gymnasiums_wrappers_accept_it():
    env = gymnasium.wrappers.vector.RecordEpisodeStatistics(PaperVectorEnv(3, max_steps=4))
    env.reset(seed=0)
    for _ in range(4):
        *_, infos = env.step(np.array([4, 4, 4]))
    episode = infos["episode"] if "episode" in infos else infos["final_info"]["episode"]
    assert episode["l"].tolist() == [4, 4, 4]
    assert episode["r"].tolist() == [-4.0] * 3
    env.close()


def test_text_of_every_site():
    env = PaperVectorEnv(2, render_mode="ansi")
    env.reset(seed=0)
    assert [text.startswith("step 0 of 36") for text in env.render()] == [True, True]
    assert PaperVectorEnv(2).render() is None
    with pytest.raises(ValueError, match="render_mode"):
        PaperVectorEnv(2, render_mode="human")
    assert env.batch.spec == PAPER.in_building_order()


def test_a_step_before_the_first_reset_is_refused():
    with pytest.raises(gymnasium.error.ResetNeeded, match="reset"):
        PaperVectorEnv(2).step(np.zeros(2, np.int64))
