from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from paper_lessons import SLOW, TINY, drawn_network

from bimvox.paper.env.layout import PaperLayout
from bimvox.paper.env.spec import YardPose
from bimvox.paper.policy import initialization
from bimvox.paper.policy.episodes import replay
from bimvox.paper.policy.initialization import adapt, apply_layout, collision_of

FORWARD, BACKWARD, LEFT, RIGHT, UP, DOWN = range(6)
LAYOUT = PaperLayout((YardPose(0, 2, "y"),), ((2, 2, 1),))
STRAIGHT = replay(TINY, LAYOUT, np.array([RIGHT, RIGHT, DOWN]))
LONGER = replay(TINY, LAYOUT, np.array([UP, RIGHT, RIGHT, DOWN, DOWN]))
FAILED = replace(replay(TINY, LAYOUT, np.array([UP, UP])), reward=-20.0)
ELSEWHERE = replace(LAYOUT, obstructions=(((3, 0, 1), (4, 1, 3)),))
IN_THE_WAY = replace(LAYOUT, obstructions=(((1, 2, 1), (2, 3, 5)),))
BASIC = drawn_network(0)


@pytest.fixture
def fakes(monkeypatch):
    """Replace training by tests only, with given test episodes, one tuple per test."""

    class Fakes:
        episodes: tuple[tuple, ...] = ()
        trained_on = None
        began_from = None
        ran_on = None
        tests = 0

    fake = Fakes()

    def learn(spec, config, test, *, seed, budget, layouts, initial):
        fake.trained_on, fake.began_from = layouts, initial
        for steps in range(config.test_every, budget + 1, config.test_every):
            if test(drawn_network(steps), steps):
                return steps
        return budget

    def run(network, spec, layouts, *, exploration, **_):
        assert exploration == 0.02
        result = fake.episodes[min(fake.tests, len(fake.episodes) - 1)]
        fake.tests += 1
        assert len(layouts) == len(result)
        fake.ran_on = layouts
        return result

    monkeypatch.setattr(initialization, "learn", learn)
    monkeypatch.setattr(initialization, "run_episodes", run)
    return fake


def outcomes(successes):
    return (LONGER,) * successes + (FAILED,) * (10 - successes)


def test_of_ten_trials_the_one_of_the_highest_reward_is_kept(fakes):
    fakes.episodes = ((FAILED, LONGER, STRAIGHT, LONGER, *(FAILED,) * 6),)
    applied = apply_layout(BASIC, TINY, SLOW, IN_THE_WAY, seed=0)
    assert applied.episode is STRAIGHT
    assert applied.success_rate == pytest.approx(0.3)
    assert fakes.ran_on == [LAYOUT] * 10  # the trial ignores obstructions


def test_an_unblocked_path_is_kept_and_nothing_is_trained(fakes):
    adapted = adapt(BASIC, STRAIGHT, TINY, SLOW, ELSEWHERE, seed=0)
    assert adapted.episode is STRAIGHT
    assert adapted.network is BASIC
    assert (adapted.retrained, adapted.steps, adapted.collision) == (False, 0, None)
    assert fakes.trained_on is None
    assert fakes.tests == 0


def test_the_simulation_stops_at_the_collision():
    assert collision_of(TINY, IN_THE_WAY, STRAIGHT) == 0
    assert collision_of(TINY, IN_THE_WAY, LONGER) == 1
    assert collision_of(TINY, ELSEWHERE, STRAIGHT) is None


def test_a_blocked_move_of_the_plan_itself_is_not_a_collision():
    planned = replace(
        STRAIGHT,
        actions=np.array([LEFT, *STRAIGHT.actions]),
        bumped=np.array([True, *STRAIGHT.bumped]),
    )
    assert collision_of(TINY, ELSEWHERE, planned) is None


def test_a_blocked_path_is_learned_again_until_eight_of_ten_succeed(fakes):
    seven_and_better = (STRAIGHT, *outcomes(7)[1:])
    fakes.episodes = (outcomes(0), seven_and_better, (LONGER, STRAIGHT, *outcomes(8)[2:]))
    adapted = adapt(BASIC, STRAIGHT, TINY, replace(SLOW, retrain_budget=2_000), IN_THE_WAY, seed=0)
    assert fakes.trained_on == [IN_THE_WAY]
    assert fakes.began_from is BASIC
    assert (adapted.retrained, adapted.succeeded, adapted.collision) == (True, True, 0)
    assert [point.steps for point in adapted.curve] == [0, 200, 400]
    assert [point.success_rate for point in adapted.curve] == pytest.approx([0.0, 0.7, 0.8])
    assert adapted.succeeded
    assert adapted.steps == 400
    assert adapted.episode is STRAIGHT  # the highest reward among those that succeeded
    assert adapted.network is not BASIC  # the new policy of the site


def test_a_failed_episode_is_never_the_plan(fakes):
    fakes.episodes = (outcomes(0), (*outcomes(8)[:8], replace(FAILED, reward=99.0), FAILED))
    assert adapt(BASIC, STRAIGHT, TINY, SLOW, IN_THE_WAY, seed=0).episode is LONGER


def test_the_papers_mode_trains_even_where_the_loaded_network_would_do(fakes):
    fakes.episodes = (outcomes(10),)
    assert adapt(BASIC, STRAIGHT, TINY, SLOW, IN_THE_WAY, seed=0).steps == 200
    ours = replace(SLOW, test_loaded_first=True)
    adapted = adapt(BASIC, STRAIGHT, TINY, ours, IN_THE_WAY, seed=0)
    assert (adapted.steps, adapted.retrained, adapted.succeeded) == (0, False, True)
    assert adapted.network is BASIC


def test_not_learned_within_the_budget_is_a_result(fakes):
    fakes.episodes = (outcomes(3),)
    adapted = adapt(BASIC, STRAIGHT, TINY, replace(SLOW, retrain_budget=600), IN_THE_WAY, seed=0)
    assert not adapted.succeeded
    assert adapted.episode is None
    assert not adapted.succeeded
    assert adapted.steps == 600
    assert adapted.success_rate == pytest.approx(0.3)


def test_a_plan_that_never_arrived_is_learned_even_if_unblocked(fakes):
    fakes.episodes = (outcomes(0), outcomes(9))
    adapted = adapt(BASIC, FAILED, TINY, SLOW, ELSEWHERE, seed=0)
    assert adapted.retrained and adapted.succeeded
    assert adapted.collision is None
