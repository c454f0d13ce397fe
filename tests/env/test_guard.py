from __future__ import annotations

import numpy as np
from lift_sites import clearance_of

from bimvox.env.dynamics import NO_ACTION
from bimvox.env.guard import CALM, GUARDS, LEFT, LOW, RIGHT, Guard, guarded_action, is_lost, visits_around

VALUES = np.array([0.1, 0.2, 0.3, 0.9, 0.4, 0.5], np.float32)


AHEAD = np.array([4, 2, 2], np.int32)
"""A target in the direction of +x."""


def chosen(space, path, steps, values, *, guard: Guard = CALM, lost: bool = False) -> int:
    return guarded_action(space, AHEAD, path, steps, values, guard, lost)


def cells(*path) -> np.ndarray:
    return np.array(path, np.int32)


def test_the_best_free_move_and_never_a_blocked_one():
    occupied = np.zeros((5, 5, 5), np.bool_)
    assert chosen(clearance_of(occupied), cells((2, 2, 2)), 0, VALUES) == 3
    occupied[3, 2, 2] = True
    assert chosen(clearance_of(occupied), cells((2, 2, 2)), 0, VALUES) == 5


def test_unvisited_cells_come_first():
    free = clearance_of(np.zeros((5, 5, 5), np.bool_))
    path = cells((3, 2, 2), (2, 2, 2))
    assert chosen(free, path, 1, VALUES) == 5
    assert chosen(free, path[:1].repeat(2, axis=0), 1, VALUES) == 3


def test_nowhere_to_go():
    occupied = np.ones((3, 3, 3), np.bool_)
    occupied[1, 1, 1] = False
    assert chosen(clearance_of(occupied), cells((1, 1, 1)), 0, VALUES) == NO_ACTION


def test_memory_is_a_ring():
    ring = cells((9, 0, 0), (7, 0, 0), (8, 0, 0))  # steps 3, 1 and 2 of a path; step 0 is forgotten
    assert visits_around(ring, 3, 8, 0, 0) == (0, 0, 1, 1, 0, 0)
    assert visits_around(ring, 3, 9, 0, 1) == (0, 0, 0, 0, 0, 1)
    assert visits_around(ring, 3, 5, 0, 0) == (0,) * 6  # step 0 is forgotten
    assert visits_around(ring, 0, 8, 0, 0) == (0, 0, 0, 1, 0, 0)  # the other cells were not visited


def test_a_lost_lift_is_pushed_out_of_the_crowd():
    free = clearance_of(np.zeros((9, 9, 9), np.bool_))
    walked = [(4 + n % 2, 4, 2 + n // 2) for n in range(6)] + [(4, 4, 5), (4, 4, 5)]
    values = np.array([0, 0, 0, 0, 0, 0.01], np.float32)
    path = cells(*walked[:-1])
    kept = chosen(free, path, len(path) - 1, values)
    pushed = chosen(free, path, len(path) - 1, values, lost=True)
    assert kept == 0  # the first move to a cell never visited; down and right were visited
    assert pushed == 4  # away from all of them


def test_the_calm_guard_calls_a_lift_lost_later_than_the_leaning_ones():
    assert is_lost(CALM, 2 * 10 + 41, 10)
    assert not is_lost(CALM, 2 * 10 + 40, 10)
    for guard in GUARDS[1:]:
        assert is_lost(guard, 10 + 21, 10)
        assert not is_lost(guard, 10 + 20, 10)


def test_a_leaning_guard_takes_its_side_if_the_policy_rates_both_alike():
    free = clearance_of(np.zeros((5, 5, 5), np.bool_))
    here = cells((2, 2, 2))
    equal = np.array([0.5, 0.4, 0.0, 0.0, 0.4, 0.45], np.float32)
    assert chosen(free, here, 0, equal) == 0
    assert chosen(free, here, 0, equal, guard=LEFT) == 0  # +y is to the left of +x
    assert chosen(free, here, 0, equal, guard=RIGHT) == 1
    assert chosen(free, here, 0, equal, guard=LOW) == 5
    assert chosen(free, here, 0, VALUES, guard=RIGHT) == 3  # no effect if the values differ clearly


def test_left_is_left_of_the_direction_to_the_target():
    free = clearance_of(np.zeros((5, 5, 5), np.bool_))
    same = np.zeros(6, np.float32)
    for target, left, right in (((4, 2, 2), 0, 1), ((0, 2, 2), 1, 0), ((2, 4, 2), 2, 3), ((2, 0, 2), 3, 2)):
        there = np.array(target, np.int32)
        assert guarded_action(free, there, cells((2, 2, 2)), 0, same, LEFT, False) == left
        assert guarded_action(free, there, cells((2, 2, 2)), 0, same, RIGHT, False) == right
