from __future__ import annotations

import numpy as np
from lift_sites import clearance_of

from bimvox.env.guard import CALM, RESTLESS, guarded_action, is_lost, visits_of
from bimvox.env.state import NO_ACTION

VALUES = np.array([0.1, 0.2, 0.3, 0.9, 0.4, 0.5], np.float32)


def cells(*path) -> np.ndarray:
    return np.array(path, np.int32)


def test_the_best_free_move_and_never_a_blocked_one():
    occupied = np.zeros((5, 5, 5), np.bool_)
    assert guarded_action(clearance_of(occupied), cells((2, 2, 2)), 0, VALUES, 0, 0.0) == 3
    occupied[3, 2, 2] = True
    assert guarded_action(clearance_of(occupied), cells((2, 2, 2)), 0, VALUES, 0, 0.0) == 5


def test_unvisited_cells_come_first():
    free = clearance_of(np.zeros((5, 5, 5), np.bool_))
    path = cells((3, 2, 2), (2, 2, 2))
    assert guarded_action(free, path, 1, VALUES, 0, 0.0) == 5
    assert guarded_action(free, path[:1].repeat(2, axis=0), 1, VALUES, 0, 0.0) == 3


def test_nowhere_to_go():
    occupied = np.ones((3, 3, 3), np.bool_)
    occupied[1, 1, 1] = False
    assert guarded_action(clearance_of(occupied), cells((1, 1, 1)), 0, VALUES, 0, 0.0) == NO_ACTION


def test_memory_is_a_ring():
    ring = cells((9, 0, 0), (7, 0, 0), (8, 0, 0))  # steps 3, 1 and 2 of a path; step 0 is forgotten
    assert visits_of(ring, 3, 9, 0, 0) == 1
    assert visits_of(ring, 3, 6, 0, 0) == 0
    assert visits_of(ring, 0, 7, 0, 0) == 0  # nothing is there yet


def test_a_lost_lift_is_pushed_out_of_the_crowd():
    free = clearance_of(np.zeros((9, 9, 9), np.bool_))
    walked = [(4 + n % 2, 4, 2 + n // 2) for n in range(6)] + [(4, 4, 5), (4, 4, 5)]
    values = np.array([0, 0, 0, 0, 0, 0.01], np.float32)
    path = cells(*walked[:-1])
    kept = guarded_action(free, path, len(path) - 1, values, 0, 0.0)
    pushed = guarded_action(free, path, len(path) - 1, values, CALM.reach_vox, CALM.cost)
    assert kept == 0  # the first of those never visited; down and right are
    assert pushed == 4  # away from all of them


def test_the_calm_guard_calls_a_lift_lost_later_than_the_restless_one():
    assert is_lost(CALM, 2 * 10 + 41, 10)
    assert not is_lost(CALM, 2 * 10 + 40, 10)
    assert is_lost(RESTLESS, 10 + 11, 10)
    assert not is_lost(RESTLESS, 10 + 10, 10)
