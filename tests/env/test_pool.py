from __future__ import annotations

import numpy as np
import pytest
from lift_sites import clearance_of, random_occupancy

from bimvox.env.pool import pool_of, pooled_clearance, pooled_distance
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
