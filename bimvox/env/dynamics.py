"""The state of a lift in transit, how a move changes it, what it earns, and how many actions a lift may take."""

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


class RewardWeights(NamedTuple):
    """Coefficients of :func:`reward`, as a tuple for kernels.

    Attributes:
        progress: Per move by which the distance-to-go shrinks; negative if it grows.
        step: Of every action.
        late_step: Added to ``step`` once the step limit is reached.
        bump: Added when the move was blocked.
        arrival: Added at the target.
    """

    progress: float
    step: float
    late_step: float
    bump: float
    arrival: float

    @property
    def needs_distance(self) -> bool:
        """Whether the distance field of the site is needed."""
        return self.progress != 0.0


REWARDS: dict[str, RewardWeights] = {
    "shaped": RewardWeights(progress=0.2, step=-0.05, late_step=0.0, bump=-0.1, arrival=1.0),
    "sparse": RewardWeights(progress=0.0, step=-0.1, late_step=-0.1, bump=0.0, arrival=1.0),
}
"""``shaped``: the exact distance-to-go of the training site is the teacher. It is 0.2 (d - d') rather than the
potential form 0.2 (d - g d') of Ng, Harada and Russell 1999: a detour and its way back cost the same, so with the step
cost every cycle loses.
``sparse``: the shape of the paper's reward for one component: every step costs the same, blocked or not, and twice as
much past the limit; only arriving has a positive reward."""


@leaf_kernel
def reward(weights: RewardWeights, distance: int, next_distance: int, bumped: bool, arrived: bool, late: bool) -> float:
    """Return the reward of one action.

    Args:
        weights: Coefficients.
        distance: Distance-to-go before the action, moves.
        next_distance: The same after it; both may be 0 if ``weights`` does not need the distance.
        bumped: Whether the move was blocked.
        arrived: Whether the target was reached.
        late: Whether the step limit had been reached before.
    """
    value = weights.progress * (distance - next_distance) + weights.step
    if bumped:
        value += weights.bump
    if arrived:
        value += weights.arrival
    if late:
        value += weights.late_step
    return float(value)
