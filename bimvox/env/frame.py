"""The policy's own frame: the site mirrored and turned so that the goal lies ahead and to one side.

A site and its seven mirror images and quarter turns need the same decision. So the observation is written in a frame
whose first axis is the horizontal axis along which the goal is farther, with the goal on its positive side; the action
values are transformed back. One network learns all eight cases at once, and acts the same on a mirrored site.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import leaf_kernel
from bimvox.env.actions import ACTION_COUNT, MOVES

FRAME_COUNT = 8


@leaf_kernel
def frame_of(dx: int, dy: int) -> int:
    """Return the frame for a goal at (dx, dy): 1 if x is negative, + 2 if y is, + 4 if the axes change places."""
    return (1 if dx < 0 else 0) + (2 if dy < 0 else 0) + (4 if abs(dy) > abs(dx) else 0)


def _frame_actions() -> NDArray[np.int64]:
    """Return (FRAME_COUNT, ACTION_COUNT): which of the frame's actions each action of the site is."""
    moves = [tuple(move) for move in MOVES.tolist()]
    table = np.zeros((FRAME_COUNT, ACTION_COUNT), np.int64)
    for frame in range(FRAME_COUNT):
        for action, (x, y, z) in enumerate(moves):
            seen_x, seen_y = x * (-1 if frame & 1 else 1), y * (-1 if frame & 2 else 1)
            if frame & 4:
                seen_x, seen_y = seen_y, seen_x
            table[frame, action] = moves.index((seen_x, seen_y, z))
    return table


FRAME_ACTIONS: NDArray[np.int64] = _frame_actions()
"""(FRAME_COUNT, ACTION_COUNT) int64: which of the frame's actions each action of the site is."""
FRAME_ACTIONS.flags.writeable = False


@leaf_kernel
def to_frame(frame: int, x: int, y: int) -> tuple[int, int]:
    """Return a horizontal offset on the site as it is in the frame."""
    u = -x if frame & 1 else x
    v = -y if frame & 2 else y
    return (v, u) if frame & 4 else (u, v)


@leaf_kernel
def from_frame(frame: int, u: int, v: int) -> tuple[int, int]:
    """Return a horizontal offset in the frame as it is on the site."""
    x, y = (v, u) if frame & 4 else (u, v)
    return (-x if frame & 1 else x), (-y if frame & 2 else y)
