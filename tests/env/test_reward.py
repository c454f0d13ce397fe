from __future__ import annotations

import pytest

from bimvox.env.dynamics import REWARDS, reward

SHAPED, SPARSE = REWARDS["shaped"], REWARDS["sparse"]


@pytest.mark.parametrize(
    ("distances", "bumped", "arrived", "expected"),
    [
        ((5, 4), False, False, 0.15),
        ((4, 5), False, False, -0.25),
        ((5, 5), True, False, -0.15),
        ((1, 0), False, True, 1.15),
    ],
)
def test_shaped_reward_pays_progress(distances, bumped, arrived, expected):
    assert reward(SHAPED, *distances, bumped, arrived, False) == pytest.approx(expected)


def test_no_cycle_earns_reward():
    there_and_back = reward(SHAPED, 5, 4, False, False, False) + reward(SHAPED, 4, 5, False, False, False)
    assert there_and_back < 0


def test_sparse_reward_doubles_the_cost_past_the_limit_and_ignores_distance():
    assert reward(SPARSE, 9, 3, True, False, False) == pytest.approx(-0.1)
    assert reward(SPARSE, 9, 3, False, False, True) == pytest.approx(-0.2)
    assert reward(SPARSE, 9, 0, False, True, False) == pytest.approx(0.9)


def test_only_the_shaped_reward_needs_the_teacher():
    assert SHAPED.needs_distance
    assert not SPARSE.needs_distance
