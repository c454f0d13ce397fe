from __future__ import annotations

import numpy as np
import pytest

from benchmarks.live_deciders import MonteCarlo, Oracle, imagined
from bimvox.live.deciders import Decider, Rules, stop_and_wait
from bimvox.live.env import example_job
from bimvox.live.episode import WAIT, Episode, Stage
from bimvox.live.traffic import DENSITIES, GOAL_X, Habits, X

DECIDERS = (
    stop_and_wait,
    Rules(chooses_lift=False),
    Rules(),
    Rules(horizon_s=20.0),
    MonteCarlo(samples=2),
    Oracle(waits=3),
)


def run(decide: Decider, seed: int, traffic: str = "heavy") -> Episode:
    episode = Episode(example_job(), DENSITIES[traffic], seed)
    while episode.stage is not Stage.OVER:
        episode.decide(decide(episode))
    return episode


@pytest.mark.parametrize("number", range(len(DECIDERS)))
def test_every_decider_finishes_safely_and_again_the_same(number):
    first, second = (run(DECIDERS[number], 3) for _ in range(2))
    assert not first.is_cut
    assert sorted(first.done) == list(range(12))
    assert first.violations == second.violations == 0
    assert (first.ticks, first.done) == (second.ticks, second.done)


def test_lifts_keep_what_must_come_before():
    job = example_job()
    done = run(Rules(), 8).done
    for place, lift in enumerate(done):
        assert job.lifts[lift].earlier <= set(done[:place])


@pytest.mark.slow
def test_who_knows_the_future_loses_less():
    lost_s = {decide: np.mean([run(decide, seed).lost_s for seed in range(10)]) for decide in (stop_and_wait, Oracle())}
    assert lost_s[Oracle()] < 0.8 * lost_s[stop_and_wait]


def test_an_imagined_future_uses_only_what_is_seen():
    """Where somebody walks to, and how long he stays, is not copied from the truth."""
    episode = Episode(example_job(), DENSITIES["heavy"], 5)
    for _ in range(20):
        episode.decide(WAIT)
    true = episode.crowd
    one, same, other = (imagined(episode, Habits(), sample) for sample in (0, 0, 1))
    np.testing.assert_array_equal(one.state, same.state)
    np.testing.assert_array_equal(one.state[:, X], true.seen_m[:, 0])
    assert (one.state[:, 5] != other.state[:, 5]).any()
    changed = Episode(example_job(), DENSITIES["heavy"], 5)
    for _ in range(20):
        changed.decide(WAIT)
    changed.crowd.state[:, GOAL_X] += 99.0
    changed.crowd.state[:, 5] *= 2.0
    for column in (X, 5, 10):
        np.testing.assert_array_equal(imagined(changed, Habits(), 0).state[:, column], one.state[:, column])


def test_a_decision_that_is_no_candidate_is_refused():
    episode = Episode(example_job(), DENSITIES["light"], 0)
    with pytest.raises(ValueError, match=r"decision 11: the candidates are \(0"):
        episode.decide(11)
