from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lift_sites import clearance_of, random_occupancy

from bimvox.env.actions import MOVES
from bimvox.env.dynamics import NO_ACTION, REWARDS, has_arrived, initial_state, reward, transition

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


def cells_are_free(occupied: np.ndarray, cell: np.ndarray, size: tuple[int, int, int]) -> bool:
    """Return the same decision from the raw cells."""
    low, high = cell, cell + size
    if (low < 0).any() or (high > occupied.shape).any():
        return False
    return not occupied[low[0] : high[0], low[1] : high[1], low[2] : high[2]].any()


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    size=st.tuples(st.integers(1, 3), st.integers(1, 3), st.integers(1, 3)),
    actions=st.lists(st.integers(0, 5), min_size=1, max_size=30),
)
def test_a_lift_moves_by_one_cell_or_bumps_and_stays(seed, size, actions):
    occupied = random_occupancy(seed, share=0.1)
    occupied[:4, :4, :4] = False
    space = clearance_of(occupied, size)
    state = initial_state(0, 0, 0)
    for count, action in enumerate(actions, start=1):
        before = np.array(state[:3])
        wanted = before + MOVES[action]
        state, bumped = transition(space, state, action)
        free = cells_are_free(occupied, wanted, size)
        assert bumped == (not free)
        assert tuple(state[:3]) == tuple(wanted if free else before)
        assert (state.last_action, state.steps) == (action, count)


def test_an_episode_begins_without_an_action():
    assert initial_state(3, 4, 5) == (3, 4, 5, NO_ACTION, 0)


@pytest.mark.parametrize(("cell", "there"), [((1, 2, 3), True), ((1, 2, 4), False), ((0, 2, 3), False)])
def test_arrival_is_being_at_the_target(cell, there):
    assert has_arrived(initial_state(*cell), np.array([1, 2, 3], np.int32)) is there
