from __future__ import annotations

import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env
from stable_baselines3.common.env_checker import check_env as check_env_sb3

from benchmarks.live_deciders import Oracle
from bimvox.env.gym import LIVE_ENV_ID
from bimvox.live import env as live_env
from bimvox.live.deciders import Rules
from bimvox.live.env import LiveSiteEnv, example_job
from bimvox.live.episode import CHOICES, Episode, Stage
from bimvox.live.traffic import DENSITIES, Density


def run(env: LiveSiteEnv, actions: np.random.Generator | None, traffic: int) -> tuple[float, dict]:
    _, info = env.reset(options={"traffic": traffic})
    total, over = 0.0, False
    while not over:
        allowed = np.flatnonzero(info["action_mask"][:CHOICES])
        action = np.int64(allowed[0] if actions is None else actions.choice(allowed))
        _, reward, ends, cut, info = env.step(action)
        total, over = total + float(reward), ends or cut
    return total, info


def test_gymnasium_and_sb3_find_nothing_to_warn_about():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(gymnasium.make(LIVE_ENV_ID).unwrapped)
        check_env(gymnasium.make(LIVE_ENV_ID, render_mode="ansi").unwrapped)
        check_env(gymnasium.make(LIVE_ENV_ID, render_mode="rgb_array").unwrapped)
        check_env_sb3(LiveSiteEnv())


def test_rewards_add_up_to_the_time_lost_and_nobody_is_hurt():
    env = LiveSiteEnv(traffic="heavy")
    total, info = run(env, np.random.default_rng(3), 5)
    assert info["violations"] == 0
    assert total * -100.0 == pytest.approx(info["lost_s"] * len(env.episode.job.lifts), abs=1e-6)


def test_equal_traffic_and_actions_give_equal_episodes():
    outcomes = [run(LiveSiteEnv(), None, 11) for _ in range(2)]
    assert outcomes[0][0] == outcomes[1][0]
    assert outcomes[0][0] != run(LiveSiteEnv(), None, 12)[0]
    views = [LiveSiteEnv().reset(seed=4)[0] for _ in range(2)]
    np.testing.assert_array_equal(*views)


def test_without_traffic_no_time_is_lost():
    total, info = run(LiveSiteEnv(traffic=Density(0, 0)), None, 0)
    assert abs(info["lost_s"]) < 3.0
    assert abs(total) < 0.4


def test_an_action_that_is_no_candidate_waits():
    env = LiveSiteEnv(render_mode="ansi")
    _, info = env.reset(seed=1)
    count = int(info["action_mask"][:CHOICES].sum())
    assert 0 < count < CHOICES
    _, reward, *_ = env.step(np.int64(count))
    assert reward == pytest.approx(-0.1)
    assert env.render().startswith("lift at 10 s, 0 lifts done\n")
    env.step(np.int64(0))
    assert env.render().splitlines()[1] == "0: way 1 of column 1"
    np.testing.assert_array_equal(env.action_masks(), [True] * 2 + [False] * 6 + [True])


def test_bad_arguments_are_named():
    with pytest.raises(ValueError, match="traffic 'rush': only light, medium, heavy"):
        LiveSiteEnv(traffic="rush")
    with pytest.raises(ValueError, match="render_mode 'film'"):
        LiveSiteEnv(render_mode="film")
    with pytest.raises(ResetNeeded):
        LiveSiteEnv().step(np.int64(0))
    env = LiveSiteEnv()
    env.reset(seed=0)
    with pytest.raises(ValueError, match="an integer from 0 to 8"):
        env.step(np.int64(9))


def test_a_picture_shows_the_others_at_their_size_and_the_hook():
    env = LiveSiteEnv(traffic=Density(2, 1), render_mode="rgb_array")
    _, info = env.reset(seed=3)
    before = env.render()
    assert before.dtype == np.uint8
    assert max(before.shape[:2]) == live_env.LONGER_EDGE_PX
    count = {name: (before == getattr(live_env, name)).all(axis=-1).sum() for name in ("CREW_COLOUR", "LORRY_COLOUR")}
    assert 0 < count["CREW_COLOUR"] < count["LORRY_COLOUR"]
    assert not (before == live_env.HOOK).all(axis=-1).any()
    env.step(np.int64(np.flatnonzero(info["action_mask"])[0]))
    after = env.render()
    assert (after == live_env.HOOK).all(axis=-1).any()
    assert not np.array_equal(before, after)


@pytest.mark.slow
def test_only_who_knows_the_future_reaches_the_reward_threshold():
    threshold = gymnasium.spec(LIVE_ENV_ID).reward_threshold
    means = {}
    for name, decide in (("rule", Rules()), ("oracle", Oracle())):
        lost = []
        for seed in range(20):
            episode = Episode(example_job(), DENSITIES["medium"], seed)
            while episode.stage is not Stage.OVER:
                episode.decide(decide(episode))
            lost.append(episode.lost_s * len(episode.job.lifts) / -100.0)
        means[name] = np.mean(lost)
    assert means["rule"] < threshold < means["oracle"]
