"""The reward of an action: the formula of ``bimvox.env.dynamics``, with serial numbers as in the paper.

Equation (1) of Zhu, Pauwels and de Vries (2021), r0 = -1: each step of component i costs r0 / S_i, twice that from its
step limit on; the step that assembles it earns n S_i and costs nothing: "only when the agent completes the task, it can
get a positive reward" (the authors' script does the same). S_i is the serial number of the component, n their number.
"""

from __future__ import annotations

from typing import NamedTuple

from bimvox.compiled import leaf_kernel
from bimvox.env.dynamics import REWARDS, RewardWeights, reward


class PaperReward(NamedTuple):
    """A way to reward actions, as a tuple for kernels.

    Attributes:
        weights: Coefficients of :func:`bimvox.env.dynamics.reward`.
        by_serial: Whether the step cost is divided by S_i, and an arrival earns n S_i alone.
    """

    weights: RewardWeights
    by_serial: bool


PAPER_REWARDS: dict[str, PaperReward] = {
    "paper": PaperReward(RewardWeights(progress=0.0, step=-1.0, late_step=-1.0, bump=0.0, arrival=1.0), by_serial=True),
    "shaped": PaperReward(REWARDS["shaped"], by_serial=False),
    "sparse": PaperReward(REWARDS["sparse"], by_serial=False),
}
"""``paper``: equation (1). ``shaped``: the exact distance-to-go of the component in transit is the teacher.
``sparse``: every step costs the same, twice as much when late; every arrival earns the same."""


@leaf_kernel
def earned(
    scheme: PaperReward,
    serial: int,
    count: int,
    distance: int,
    next_distance: int,
    bumped: bool,
    arrived: bool,
    late: bool,
) -> float:
    """Return the reward of one action.

    Args:
        scheme: How actions are rewarded.
        serial: S_i of the component in transit, from 1.
        count: n.
        distance: Moves to its target before the action.
        next_distance: Moves to its target after the action.
        bumped: Whether the move was blocked.
        arrived: Whether the component was assembled.
        late: Whether its step limit had been reached before.
    """
    weights = scheme.weights
    if scheme.by_serial:
        if arrived:
            return float(weights.arrival * count * serial)
        weights = RewardWeights(
            weights.progress, weights.step / serial, weights.late_step / serial, weights.bump, weights.arrival
        )
    return reward(weights, distance, next_distance, bumped, arrived, late)
