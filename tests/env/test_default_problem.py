from __future__ import annotations

import numpy as np

from bimvox.env.problem import TARGET_VOX, default_problem, is_learnable


def test_the_papers_site():
    problem = default_problem()
    assert problem.grid_shape == (15, 15, 6)
    assert problem.target_vox == TARGET_VOX == (7, 7, 1)
    assert is_learnable(problem)
    x, y, z = problem.starts_vox.T
    assert (z == 2).all()  # upright and raised by one voxel
    assert not ((x >= 5) & (x < 10) & (y >= 5) & (y < 10)).any()
    # Nothing is in the way, so this is the Manhattan distance.
    expected = np.abs(problem.starts_vox - np.array(TARGET_VOX)).sum(axis=1)
    assert [problem.distance_from(cell) for cell in problem.starts_vox] == expected.tolist()


def test_every_column_lies_wholly_in_the_yard():
    problem = default_problem(column_length_vox=4)
    starts = {tuple(c) for c in problem.starts_vox[:, :2].tolist()}
    assert (14, 11) in starts  # extends along +y to the corner
    assert (12, 12) not in starts  # no room along x or y
    assert (2, 6) not in starts or (2, 6 + 3) in {(x, y) for x in range(5) for y in range(15)}


def test_an_obstruction_takes_room_and_lengthens_paths():
    free, obstructed = default_problem(), default_problem(obstructions=(((3, 6, 1), (4, 9, 3)),))
    assert len(obstructed.starts_vox) < len(free.starts_vox)
    assert obstructed.distance_from((2, 7, 2)) > free.distance_from((2, 7, 2))
