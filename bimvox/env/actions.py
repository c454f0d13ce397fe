"""The six unit moves: the one definition of what an action does."""

from __future__ import annotations

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray


class Action(IntEnum):
    """One voxel along one axis of the site."""

    FORWARD = 0
    """+y."""
    BACKWARD = 1
    """-y."""
    LEFT = 2
    """-x."""
    RIGHT = 3
    """+x."""
    UP = 4
    """+z."""
    DOWN = 5
    """-z."""


ACTION_COUNT = 6

MOVES: NDArray[np.int32] = np.array(
    [[0, 1, 0], [0, -1, 0], [-1, 0, 0], [1, 0, 0], [0, 0, 1], [0, 0, -1]], dtype=np.int32
)
"""(6, 3) cells by which each ``Action`` moves the reference cell."""
MOVES.flags.writeable = False
