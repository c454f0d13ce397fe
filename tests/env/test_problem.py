from __future__ import annotations

import numpy as np
import pytest
from lift_sites import clearance_of

from bimvox.env.problem import is_learnable, lift_problem, plain_clearance, training_problem


def walled() -> np.ndarray:
    occupied = np.zeros((8, 4, 3), np.bool_)
    occupied[5] = True
    return occupied


def test_starts_without_a_path_or_outside_are_left_out():
    problem = training_problem(
        clearance_of(walled()), (0, 0, 0), (4, 3, 2), [(1, 1, 1), (7, 0, 0), (5, 0, 0), (9, 9, 9), (4, 3, 2), (1, 1, 1)]
    )
    assert problem.starts_vox.tolist() == [[0, 0, 0], [1, 1, 1]]
    assert problem.distance_from((0, 0, 0)) == 9
    assert problem.grid_shape == (8, 4, 3)
    assert is_learnable(problem)


def test_an_unsolvable_lift_is_not_learnable():
    assert not is_learnable(training_problem(clearance_of(walled()), (0, 0, 0), (7, 0, 0)))
    assert not is_learnable(training_problem(clearance_of(walled()), (0, 0, 0), (5, 0, 0)))


def test_a_rollout_problem_has_no_teacher():
    problem = lift_problem(clearance_of(walled()), (0, 0, 0), (4, 3, 2))
    assert not is_learnable(problem)
    with pytest.raises(ValueError, match="without its distance field"):
        problem.distance_from((0, 0, 0))


def test_plain_clearance_copies_only_what_it_must():
    space = clearance_of(walled())
    frozen = space.boxes.copy()
    frozen.flags.writeable = False
    plain = plain_clearance(space._replace(boxes=frozen))
    assert plain.table is space.table
    assert plain.boxes.flags.writeable
    np.testing.assert_array_equal(plain.boxes, frozen)
