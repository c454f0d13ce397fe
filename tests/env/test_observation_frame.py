from __future__ import annotations

import itertools

import numpy as np

from bimvox.env.actions import MOVES
from bimvox.env.observation import FRAME_ACTIONS, FRAME_COUNT, frame_of, from_frame, to_frame


def test_the_goal_lies_ahead_and_to_the_positive_side():
    for dx, dy in itertools.product(range(-3, 4), repeat=2):
        u, v = to_frame(frame_of(dx, dy), dx, dy)
        assert u >= v >= 0
        assert {abs(dx), abs(dy)} == {u, v}


def test_there_and_back():
    for frame, x, y in itertools.product(range(FRAME_COUNT), range(-2, 3), range(-2, 3)):
        assert from_frame(frame, *to_frame(frame, x, y)) == (x, y)


def test_actions_are_moves_in_the_frame():
    for frame, action in itertools.product(range(FRAME_COUNT), range(6)):
        x, y, z = MOVES[action].tolist()
        assert tuple(MOVES[FRAME_ACTIONS[frame, action]]) == (*to_frame(frame, x, y), z)
    assert all(len(set(row)) == 6 for row in FRAME_ACTIONS.tolist())
    assert np.array_equal(FRAME_ACTIONS[0], np.arange(6))
