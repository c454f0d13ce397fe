"""The reward of an action: one formula, and named sets of coefficients."""

from __future__ import annotations

from typing import NamedTuple

from bimvox.compiled import leaf_kernel


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
