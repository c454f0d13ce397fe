from __future__ import annotations

import numpy as np
import pytest
from paper_lessons import TINY, network_that_always

from bimvox.paper.env.layout import PaperLayout, random_layouts
from bimvox.paper.env.spec import YardPose
from bimvox.paper.policy.episodes import best_of, replay, run_episodes, success_rate

FORWARD, BACKWARD, LEFT, RIGHT, UP, DOWN = range(6)
CORNER = PaperLayout((YardPose(0, 2, "y"),), ((2, 2, 1),))
WINDOW = {"observation": "window", "reward": "paper"}


def always(action):
    return network_that_always(action, 247)


def test_a_known_path_is_written_down():
    episode = replay(TINY, CORNER, np.array([RIGHT, RIGHT, DOWN]))
    assert episode.succeeded
    assert episode.reward == -1.0  # two steps, and a third that assembles
    assert episode.path_cells == ((0, 2, 2), (1, 2, 2), (2, 2, 2), (2, 2, 1))
    assert episode.moves.tolist() == [RIGHT, RIGHT, DOWN]


def test_a_replay_stops_at_the_first_collision():
    blocked = PaperLayout(CORNER.starts, CORNER.targets, (((1, 2, 1), (2, 3, 3)),))
    episode = replay(TINY, blocked, np.array([RIGHT, RIGHT, DOWN]))
    assert not episode.succeeded
    assert episode.bumped.tolist() == [True]
    assert episode.path_cells == ((0, 2, 2),)


def test_a_blocked_move_is_not_part_of_the_path():
    (episode,) = run_episodes(always(LEFT), TINY, [CORNER], exploration=0.0, seed=0, **WINDOW)
    assert episode.steps == TINY.steps_allowed
    assert episode.bumped.all()
    assert episode.moves.size == 0
    assert episode.path_cells == ((0, 2, 2),)
    assert episode.reward == -8 - 2 * 6  # late after eight steps


def test_the_share_of_random_actions():
    layouts = [CORNER] * 200
    episodes = run_episodes(always(UP), TINY, layouts, exploration=0.3, seed=1, **WINDOW)
    actions = np.concatenate([episode.actions for episode in episodes])
    assert 0.2 < (actions != UP).mean() < 0.3  # a sixth of the random actions are also UP
    again = run_episodes(always(UP), TINY, layouts, exploration=0.3, seed=1, **WINDOW)
    assert all(np.array_equal(a.actions, b.actions) for a, b in zip(episodes, again, strict=True))
    other = run_episodes(always(UP), TINY, layouts, exploration=0.3, seed=2, **WINDOW)
    assert any(not np.array_equal(a.actions, b.actions) for a, b in zip(episodes, other, strict=True))


def test_no_policy_acts_at_random():
    episodes = run_episodes(None, TINY, random_layouts(TINY, 60, 0), exploration=1.0, seed=0, **WINDOW)
    assert set(np.concatenate([episode.actions for episode in episodes]).tolist()) == set(range(6))
    assert 0.0 < success_rate(episodes) < 0.9


def test_the_best_is_the_first_of_the_highest_reward():
    three = replay(TINY, CORNER, np.array([RIGHT, RIGHT, DOWN]))
    five = replay(TINY, CORNER, np.array([UP, RIGHT, RIGHT, DOWN, DOWN]))
    same = replay(TINY, CORNER, np.array([DOWN, RIGHT, RIGHT]))
    assert five.succeeded and same.succeeded
    assert best_of([five, three, same]) is three
    assert success_rate([five, three]) == 1.0


@pytest.mark.parametrize("seed", range(3))
def test_every_episode_begins_where_its_layout_says(seed):
    layouts = random_layouts(TINY, 10, seed)
    episodes = run_episodes(always(UP), TINY, layouts, exploration=0.0, seed=0, **WINDOW)
    for layout, episode in zip(layouts, episodes, strict=True):
        assert episode.path_cells[0] == (layout.starts[0].x, layout.starts[0].y, 2)
