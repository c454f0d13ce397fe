"""The paper's task is nearly planar: its column hangs at one of two heights, and passes over no obstruction."""

import numpy as np

from bimvox.env.problem import default_problem
from bimvox.paper.env.spec import HUNG_LAYER, PAPER, RandomObstructions

START = (12, 7, HUNG_LAYER)


def test_the_column_of_the_paper_hangs_at_two_heights():
    assert PAPER.shape[2] == 6
    assert [part.length_vox for part in PAPER.components] == [4]
    problem = default_problem()
    free = [z for z in range(PAPER.shape[2]) if problem.distance_from((*START[:2], z)) >= 0]
    assert free == [1, HUNG_LAYER]


def test_a_wall_as_high_as_an_obstruction_is_never_passed_over():
    high_m = RandomObstructions().height_vox
    wall = ((10, 0, 1), (11, PAPER.shape[1], 1 + high_m))
    assert default_problem().distance_from(START) > 0
    assert default_problem(obstructions=(wall,)).distance_from(START) == -1
    gap = ((10, 0, 1), (11, PAPER.shape[1] - 1, 1 + high_m))
    around = default_problem(obstructions=(gap,)).distance_from(START)
    assert around > default_problem().distance_from(START)
    assert around == 2 * (PAPER.shape[1] - 1 - START[1]) + np.abs(np.subtract(START, (7, 7, 1))).sum()
