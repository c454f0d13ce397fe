from __future__ import annotations

import numpy as np

from bimvox.env.actions import ACTION_COUNT, MOVES, Action


def test_moves_are_the_six_unit_moves_in_the_papers_order():
    named = {action.name: tuple(MOVES[action].tolist()) for action in Action}
    assert named == {
        "FORWARD": (0, 1, 0),
        "BACKWARD": (0, -1, 0),
        "LEFT": (-1, 0, 0),
        "RIGHT": (1, 0, 0),
        "UP": (0, 0, 1),
        "DOWN": (0, 0, -1),
    }
    assert MOVES.shape == (ACTION_COUNT, 3)
    assert MOVES.dtype == np.int32
    assert not MOVES.flags.writeable
