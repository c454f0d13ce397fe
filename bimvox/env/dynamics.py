"""How a component moves: one voxel at a time, never into a placement that is not free."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import leaf_kernel
from bimvox.env.actions import MOVES
from bimvox.env.state import LiftState
from bimvox.site.collision import CollisionSpace, placement_is_free


@leaf_kernel
def transition(space: CollisionSpace, state: LiftState, action: int) -> tuple[LiftState, bool]:
    """Take one action.

    Args:
        space: What decides whether a placement is free.
        state: Where the component is.
        action: An ``Action``.

    Returns:
        The next state, and whether the move was blocked: a blocked move costs its step and moves nothing.
    """
    x = int(state.x + MOVES[action, 0])
    y = int(state.y + MOVES[action, 1])
    z = int(state.z + MOVES[action, 2])
    if placement_is_free(space, x, y, z):
        return LiftState(x, y, z, int(action), int(state.steps + 1)), False
    return LiftState(int(state.x), int(state.y), int(state.z), int(action), int(state.steps + 1)), True


@leaf_kernel
def has_arrived(state: LiftState, target: NDArray[np.int32]) -> bool:
    """Return whether the component is at its target: the only terminal state."""
    return bool(state.x == target[0] and state.y == target[1] and state.z == target[2])
