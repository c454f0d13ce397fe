from __future__ import annotations

import numpy as np
import pytest
from lift_sites import clearance_of, random_occupancy

from bimvox.env.pool import (
    YARD_ONLY,
    StartMix,
    draw_start,
    pool_of,
    pooled_clearance,
    pooled_distance,
    random_below,
    random_unit,
)
from bimvox.env.problem import lift_problem, training_problem


def test_views_are_the_problems_own():
    first = clearance_of(random_occupancy(1, (9, 8, 6), 0.05), (2, 1, 1))
    second = clearance_of(random_occupancy(2, (5, 7, 9), 0.05), rope=True)._replace(
        cleared_low=np.array([1, 2, 3], np.int32), cleared=np.ones((2, 3, 1), np.bool_)
    )
    third = first._replace(boxes=np.array([[0, 0, 0, 1, 1, 1], [0, 0, 1, 2, 1, 2]], np.int32))
    problems = [training_problem(c, (0, 0, 0), (3, 3, 3)) for c in (first, second, third)]
    pool = pool_of(problems, with_distances=True)
    assert pool.tables.size == first.table.size + second.table.size  # the third shares the table of the first
    for p, problem in enumerate(problems):
        for mine, theirs in zip(pooled_clearance(pool, p), problem.space, strict=True):
            np.testing.assert_array_equal(mine, theirs)
        for cell in np.ndindex(problem.grid_shape):
            assert pooled_distance(pool, p, *cell) == problem.distance_from(cell)


def test_no_problems_or_no_distances_are_refused():
    with pytest.raises(ValueError, match="at least one"):
        pool_of([], with_distances=False)
    with pytest.raises(ValueError, match="distance field"):
        pool_of([lift_problem(clearance_of(random_occupancy(0)), (0, 0, 0), (1, 1, 1))], with_distances=True)


YARD = [(0, 0, 0), (1, 0, 0), (2, 0, 0)]


def problem():
    occupied = random_occupancy(4, (20, 15, 8), 0.2)
    occupied[:4, :4, :4] = occupied[14:, 10:, 5:] = False
    return training_problem(clearance_of(occupied), YARD[0], (15, 12, 6), YARD)


def draws(mix: StartMix, count: int = 300) -> np.ndarray:
    pool = pool_of([problem()], with_distances=True)
    generator = np.array([7], np.uint64)
    return np.array([draw_start(pool, 0, mix, generator) for _ in range(count)])


def test_yard_starts_are_all_used():
    assert {tuple(c) for c in draws(YARD_ONLY).tolist()} == set(YARD)


def test_every_start_can_reach_the_target_and_is_not_there_yet():
    field = problem().distance
    for mix in (StartMix(1.0, 0.0, 0), StartMix(0.0, 1.0, 3), StartMix(0.4, 0.3, 5)):
        cells = draws(mix)
        assert (field[tuple(cells.T)] > 0).all()


def test_near_starts_are_near():
    assert np.abs(draws(StartMix(0.0, 1.0, 3)) - (15, 12, 6)).max() <= 3


def test_generator_is_uniform_and_repeatable():
    first = np.array([3], np.uint64)
    numbers = np.array([random_unit(first) for _ in range(20_000)])
    again = np.array([3], np.uint64)
    assert [random_unit(again) for _ in range(5)] == numbers[:5].tolist()
    assert ((numbers >= 0) & (numbers < 1)).all()
    assert np.histogram(numbers, 10, (0, 1))[0].min() > 1_800
    assert {random_below(first, 3) for _ in range(100)} == {0, 1, 2}
