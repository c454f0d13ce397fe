from __future__ import annotations

import itertools

import networkx as nx
import numpy as np
import pytest
from lift_sites import clearance_of, random_occupancy

from bimvox.env.problem import (
    TARGET_VOX,
    UNREACHABLE,
    default_problem,
    distance_field,
    is_learnable,
    lift_problem,
    plain_clearance,
    training_problem,
)
from bimvox.site.collision import placement_is_free


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("size", [(1, 1, 1), (2, 1, 2)])
def test_field_is_the_shortest_distance_in_the_graph_of_free_placements(seed, size):
    occupied = random_occupancy(seed, share=0.25)
    space = clearance_of(occupied, size)
    free = {c for c in itertools.product(*(range(n) for n in occupied.shape)) if placement_is_free(space, *c)}
    graph = nx.Graph()
    graph.add_nodes_from(free)
    for cell in free:
        for axis in range(3):
            other = tuple(v + (a == axis) for a, v in enumerate(cell))
            if other in free:
                graph.add_edge(cell, other)
    target = sorted(free)[len(free) // 2]
    lengths = nx.single_source_shortest_path_length(graph, target)
    expected = np.full(occupied.shape, UNREACHABLE)
    for cell, length in lengths.items():
        expected[cell] = length
    np.testing.assert_array_equal(distance_field(space, np.array(target, np.int32)), expected)


def test_nothing_is_reachable_when_the_target_is_not_free():
    occupied = random_occupancy(0)
    target = np.argwhere(occupied)[0].astype(np.int32)
    assert (distance_field(clearance_of(occupied), target) == UNREACHABLE).all()


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
