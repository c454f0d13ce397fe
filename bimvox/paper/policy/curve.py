"""The tests of a training run: how the success rate grows with the steps."""

from __future__ import annotations

from typing import NamedTuple


class CurvePoint(NamedTuple):
    """One test.

    Attributes:
        steps: Environment steps so far.
        success_rate: Share of the episodes that succeeded, with the tests' share of random actions.
        mean_reward: Of those episodes.
        greedy_rate: Share that succeeds without random actions, from every start. None if not tested.
    """

    steps: int
    success_rate: float
    mean_reward: float
    greedy_rate: float | None = None


Curve = tuple[CurvePoint, ...]
