"""The comparison of the shipped network with its baselines: its intervals, and what the guard adds."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.generalist import BARE, measure
from benchmarks.generalist_seeds import difference, interquartile_mean, interval
from benchmarks.rates import rate
from bimvox.env.guard import is_lost
from bimvox.planning.rollout import GREEDY
from bimvox.policy.generalist.suite import spiral


def test_a_rate_has_its_exact_interval():
    assert rate(10, 10) == "100.0% (69.2-100.0)"  # 0.025 to the power 1 / 10
    assert rate(0, 0) == "-"


def test_an_interquartile_mean_leaves_out_the_outer_quarters():
    assert interquartile_mean(np.array([0.0, 0.5, 0.5]), np.array([0.7, 1.0])) == pytest.approx(1.7 / 3)
    assert interval(np.full((3, 5), 0.5)) == "50% (50-50)"
    assert difference(np.full((2, 5), 0.75), np.full((2, 5), 0.5)) == "+25 (+25 to +25)"


def test_out_of_a_spiral_greedy_values_need_the_guard():
    rows = [measure({"greedy": lambda number: GREEDY}, spiral(number), number) for number in range(12)]
    assert all(is_lost(BARE, 0, 100) for _ in rows[:1])
    found = {way: sum(row.tried["greedy", way].moves is not None for row in rows) for way in ("bare", "one way")}
    assert found["bare"] < found["one way"] <= len(rows)
    for row in rows:
        made = row.tried["greedy", "one way"]
        assert made.moves is None or row.shortest <= made.moves <= made.made
