"""Which policy a caller wishes, as it passes from the command line to the planner."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class PolicyWish:
    """Which policy proposes paths, and how one is trained; what is not said, the site file says.

    Attributes:
        policy: Id of a stored policy, ``none``, ``nearest`` or ``default``; see :func:`bimvox.plan`.
        seed: Seed of the training.
        steps: Training budget in environment steps; it trains too.
        train: Whether a policy is trained for the site if there is none.
        retrain: If the policy fails lifts, it is trained further on the current site, for at most this many steps.
    """

    policy: str | None = None
    seed: int | None = None
    steps: int | None = None
    train: bool = False
    retrain: int = 0
