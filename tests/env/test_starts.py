from __future__ import annotations

import numpy as np
from lift_sites import clearance_of, random_occupancy

from bimvox.env.pool import YARD_ONLY, StartMix, draw_start, pool_of, random_below, random_unit
from bimvox.env.problem import training_problem

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
