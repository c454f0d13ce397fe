"""What training gives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from bimvox.policy.config import DqnConfig
from bimvox.policy.network import QNetwork


class CurvePoint(NamedTuple):
    """One test during training.

    Attributes:
        steps: Environment steps so far.
        success_rate: Share of the tested starts from which the target was reached.
        length_ratio: Mean of path / shortest path over the successful ones; 0 where there is none.
    """

    steps: int
    success_rate: float
    length_ratio: float


@dataclass(frozen=True, slots=True, eq=False)
class TrainedPolicy:
    """A policy and how it came about.

    Attributes:
        network: The best network tested.
        curve: Every test, the last one included.
        steps: Environment steps taken in all.
        success_rate: Of ``network``, in its test.
        length_ratio: Of ``network``, in its test.
        tested: How many starts that test had.
        config: The choices.
        seed: The seed.
        parent: Id of the policy that training began from, if any.
        budget: Environment steps that it might have taken; None where something else ended it or it was cut off in
            between, so that the same choices might not give it again.
    """

    network: QNetwork
    curve: tuple[CurvePoint, ...]
    steps: int
    success_rate: float
    length_ratio: float
    tested: int
    config: DqnConfig
    seed: int
    parent: str | None = None
    budget: int | None = None
