from __future__ import annotations

from dataclasses import replace

import gymnasium
import numpy as np
import pytest

from bimvox.paper.env.layout import PaperLayout
from bimvox.paper.env.observation import OBSERVATIONS, WINDOW_CELLS
from bimvox.paper.env.site_env import PaperSiteEnv
from bimvox.paper.env.spec import FOUR_COLUMNS_FOUR_BEAMS, OBSTRUCTED, PAPER, YardPose, column

CORNER = PaperLayout((YardPose(0, 0, "y"),), ((7, 7, 1),))


@pytest.mark.parametrize("observation", sorted(OBSERVATIONS))
def test_observations_stay_in_their_space(observation):
    env = PaperSiteEnv(FOUR_COLUMNS_FOUR_BEAMS, observation=observation, step_limit=2, max_steps=60)
    env.action_space.seed(0)
    seen, _ = env.reset(seed=0)
    for _ in range(60):
        assert env.observation_space.contains(seen)
        seen, *_ = env.step(env.action_space.sample())


def test_shapes_and_bounds_of_the_papers_map():
    env = PaperSiteEnv(FOUR_COLUMNS_FOUR_BEAMS, observation="paper")
    assert env.observation_space.shape == (15, 15, 6)
    assert env.observation_space.dtype == np.float32
    assert env.observation_space.high[0, 0].tolist() == [7, 1, 7, 7, 1, 8]
    assert not env.observation_space.low.any()
    flat = PaperSiteEnv(FOUR_COLUMNS_FOUR_BEAMS)
    np.testing.assert_array_equal(env.reset(seed=1)[0].reshape(-1), flat.reset(seed=1)[0])


def test_the_window_by_hand():
    env = PaperSiteEnv(PAPER, observation="window", obstructions=(((2, 0, 1), (3, 3, 3)),))
    seen, _ = env.reset(options={"layout": replace(CORNER, obstructions=(((2, 0, 1), (3, 3, 3)),))})
    blocked = seen[:WINDOW_CELLS].reshape(11, 11)
    assert blocked[:5].all()
    assert blocked[:, :5].all()  # outside the site
    assert blocked[7, 5:8].all()  # the obstruction at x = 2
    assert blocked[5:, 5:].sum() == 3
    assert not seen[WINDOW_CELLS : 2 * WINDOW_CELLS].any()  # the target is seven cells away
    assert seen[2 * WINDOW_CELLS :].tolist() == pytest.approx([1, 0, 7 / 15, 7 / 15, -1 / 6])
    for action in (0, 0, 0, 0, 3, 3):
        seen, *_ = env.step(np.int64(action))
    goal = seen[WINDOW_CELLS : 2 * WINDOW_CELLS].reshape(11, 11)
    assert np.argwhere(goal).tolist() == [[5 + 5, 5 + 3]]


def test_equal_seeds_give_equal_episodes():
    first, second = PaperSiteEnv(OBSTRUCTED), PaperSiteEnv(OBSTRUCTED)
    actions = np.random.default_rng(1).integers(6, size=120)
    for seed in (0, 1, None):
        a, b = first.reset(seed=seed), second.reset(seed=seed)
        np.testing.assert_array_equal(a[0], b[0])
        assert a[1] == b[1]
        assert first.layout == second.layout
        for action in actions[:30]:
            x, y = first.step(action), second.step(action)
            np.testing.assert_array_equal(x[0], y[0])
            assert x[1:] == y[1:]
    layouts = set()
    for _ in range(5):
        first.reset()
        layouts.add(first.layout)
    assert len(layouts) == 5


def test_an_episode_is_truncated_when_its_steps_are_used_up():
    env = PaperSiteEnv(PAPER)
    env.reset(options={"layout": CORNER})
    for step in range(1, 37):
        _, _, terminated, truncated, info = env.step(np.int64(4))
        assert not terminated
        assert truncated == (step == 36)
        assert not info["is_success"]


def test_the_distance_field_leads_to_the_target():
    env = PaperSiteEnv(PAPER)
    env.reset(options={"layout": CORNER})
    field = env.distance_field()
    assert field.shape == PAPER.shape
    assert field[0, 0, 2] == 15
    assert field[7, 7, 1] == 0
    assert field[7, 7, 3] == -1


def test_everything_about_the_site_can_be_changed():
    env = PaperSiteEnv(
        shape=(20, 12, 9),
        construction_area=(8, 4, 12, 8),
        components=(column(6, (9, 5, 1)), column(2, (10, 6, 1))),
        step_limit=7,
        max_steps=11,
    )
    _, info = env.reset(seed=0)
    assert env.observation_space.shape == (20 * 12 * 6,)
    assert info["states"] == ("in_transit", "unbuilt")
    with pytest.raises(ValueError, match="site: 'nothing' is unknown; there are paper"):
        PaperSiteEnv("nothing")
    with pytest.raises(ValueError, match="observation"):
        PaperSiteEnv(observation="nothing")
    with pytest.raises(ValueError, match="reward"):
        PaperSiteEnv(reward="nothing")
    with pytest.raises(ValueError, match="render_mode"):
        PaperSiteEnv(render_mode="gif")


def test_drawn_as_text():
    env = PaperSiteEnv(OBSTRUCTED, render_mode="ansi")
    layout = PaperLayout((YardPose(0, 3, "x"),), ((7, 7, 1),), (((12, 2, 1), (13, 5, 3)),))
    env.reset(options={"layout": layout})
    env.step(np.int64(0))
    from bimvox.paper.env.picture import ansi_picture

    first, *rows = ansi_picture(env.picture(), coloured=False).splitlines()
    assert first == "step 1 of 36: column 1 of 1 at (0, 4, 2), target (7, 7, 1)"
    assert len(rows) == 15
    assert rows[14 - 3] == "oooo........#.."
    assert rows[14 - 4] == "T...........#.."
    assert rows[14 - 7] == ".....::x::....."
    coloured = env.render()
    assert "\x1b[48;2;0;100;190m" in coloured  # in transit: blue
    assert PaperSiteEnv().render() is None
    assert isinstance(env, gymnasium.Env)


def test_a_step_before_the_first_reset_is_refused():
    with pytest.raises(gymnasium.error.ResetNeeded, match="reset"):
        PaperSiteEnv().step(np.int64(0))
