"""The state of a lift in transit, how a move changes it, and how many actions it may take."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import leaf_kernel
from bimvox.env.actions import MOVES
from bimvox.site.collision import CollisionSpace, placement_is_free

NO_ACTION = -1
"""``last_action`` before the first move."""


class LiftState(NamedTuple):
    """Where the component is and how it got there, as a tuple for kernels.

    Attributes:
        x: Reference cell.
        y: Reference cell.
        z: Reference cell.
        last_action: The action taken last, ``NO_ACTION`` before the first.
        steps: Actions taken since the start, blocked ones included.
    """

    x: int
    y: int
    z: int
    last_action: int
    steps: int


class StepLimit(NamedTuple):
    """``factor`` times the fewest possible moves, plus ``slack``, as a tuple for kernels."""

    factor: float = 2.0
    slack: int = 20


@leaf_kernel
def initial_state(x: int, y: int, z: int) -> LiftState:
    """Return the state of a component that hangs at reference cell (x, y, z), ready for transit."""
    return LiftState(int(x), int(y), int(z), NO_ACTION, 0)


@leaf_kernel
def steps_allowed(limit: StepLimit, moves: int) -> int:
    """Return the number of actions allowed for a lift of at least ``moves`` moves."""
    return int(limit.factor * moves) + int(limit.slack)


@leaf_kernel
def transition(space: CollisionSpace, state: LiftState, action: int) -> tuple[LiftState, bool]:
    """Move a component by one cell; return the next state and whether the move was blocked.

    A blocked move takes a step and moves nothing.
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
