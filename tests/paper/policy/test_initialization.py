from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from paper_lessons import QUICK, SLOW, TINY, drawn_network

from bimvox.paper.env.layout import yard_layouts
from bimvox.paper.env.spec import PAPER
from bimvox.paper.policy import initialization
from bimvox.paper.policy.baselines import teacher_moves
from bimvox.paper.policy.config import OUR_MODE
from bimvox.paper.policy.episodes import replay, run_episodes
from bimvox.paper.policy.initialization import greedy_layouts, greedy_success, initialize
from bimvox.paper.policy.network import network_to_bytes


@pytest.fixture
def fakes(monkeypatch):
    """Replace training by tests only, with given outcomes."""

    class Fakes:
        rates: tuple[float, ...] = ()
        greedy = 1.0
        episodes = 0

    fake = Fakes()
    networks = [drawn_network(n) for n in range(9)]
    fake.networks = networks

    def learn(spec, config, test, *, seed, budget):
        for n, steps in enumerate(range(config.test_every, budget + 1, config.test_every)):
            if test(networks[n], steps):
                return steps
        return budget

    def run(network, spec, layouts, *, exploration, **_):
        number = next(n for n, known in enumerate(networks) if known is network)
        rate = fake.greedy if exploration == 0.0 else fake.rates[number]
        if exploration > 0.0:
            fake.episodes = len(layouts)
            assert exploration == 0.02
        failed = replay(TINY, yard_layouts(TINY)[0], np.array([2]))
        good = round(rate * len(layouts))
        return (replace(failed, succeeded=True),) * good + (failed,) * (len(layouts) - good)

    monkeypatch.setattr(initialization, "learn", learn)
    monkeypatch.setattr(initialization, "run_episodes", run)
    return fake


def test_it_stops_at_the_first_test_in_which_every_episode_succeeds(fakes):
    fakes.rates = (0.3, 0.99, 1.0, 1.0)
    basic = initialize(TINY, replace(SLOW, test_episodes=100, budget=1_000), seed=0)
    assert fakes.episodes == 100
    assert [point.success_rate for point in basic.curve] == [0.3, 0.99, 1.0]
    assert basic.reached
    assert basic.curve[-1].steps == basic.steps == 600
    assert basic.network is fakes.networks[2]


def test_not_learned_within_the_budget_is_a_result(fakes):
    fakes.rates = (0.3, 0.9, 0.5, 0.0)
    basic = initialize(TINY, replace(SLOW, budget=800), seed=0)
    assert not basic.reached
    assert basic.steps == 800
    assert basic.network is fakes.networks[1]  # the best tested network


def test_our_mode_requires_every_start_without_random_actions_too(fakes):
    fakes.rates, fakes.greedy = (1.0, 1.0), 0.9
    assert not initialize(TINY, replace(SLOW, greedy_too=True, budget=400), seed=0).reached
    assert initialize(TINY, replace(SLOW, budget=400), seed=0).reached


def test_every_network_is_saved_before_it_is_tested(fakes):
    fakes.rates = (0.3, 1.0)
    saved = []
    basic = initialize(TINY, SLOW, seed=0, checkpoint=lambda network, steps: saved.append(steps))
    assert saved == [point.steps for point in basic.curve] == [200, 400]


def test_greedy_tests_take_every_distinct_start_where_nothing_else_is_drawn():
    assert greedy_layouts(PAPER, OUR_MODE) == yard_layouts(PAPER)
    drawn = greedy_layouts(replace(PAPER, random_targets=True), replace(OUR_MODE, greedy_layouts=30))
    assert len(drawn) == 30
    assert len({layout.targets for layout in drawn}) > 5


@pytest.fixture(scope="module")
def lessons():
    return [initialize(TINY, replace(QUICK, budget=3_000), seed=seed) for seed in range(5)]


def test_a_tiny_site_is_learned_to_its_optimum(lessons):
    starts = yard_layouts(TINY)
    shortest = teacher_moves(TINY, starts)
    for basic in lessons[:2]:
        episodes = run_episodes(
            basic.network, TINY, starts, observation="egocentric", reward="shaped", exploration=0.0, seed=0
        )
        assert all(episode.succeeded for episode in episodes)
        assert sum(episode.steps for episode in episodes) <= 1.1 * shortest.sum()


def test_a_fixed_small_budget_is_enough_for_every_seed(lessons):
    assert all(basic.reached for basic in lessons)
    assert max(basic.steps for basic in lessons) <= 2_000


def test_training_twice_with_one_seed_is_identical(lessons):
    again = initialize(TINY, replace(QUICK, budget=3_000), seed=0)
    assert again.curve == lessons[0].curve
    assert network_to_bytes(again.network) == network_to_bytes(lessons[0].network)
    assert network_to_bytes(again.network) != network_to_bytes(lessons[1].network)


@pytest.mark.slow
def test_the_papers_mode_learns_the_tiny_site():
    config = replace(SLOW, hidden=(32, 32), learning_rate=2e-3, test_every=500, budget=12_000, target_update=100)
    basic = initialize(TINY, config, seed=0)
    assert basic.curve[-1].success_rate >= 0.9
    assert greedy_success(basic.network, TINY, config, yard_layouts(TINY)) >= 0.9


@pytest.mark.slow
def test_the_papers_site_within_the_papers_first_test():
    basic = initialize(PAPER, replace(OUR_MODE, budget=2_000), seed=0)
    assert basic.reached
    assert basic.curve[-1].greedy_rate == 1.0
