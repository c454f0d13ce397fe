"""The result of training, and where training starts."""

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
        length_ratio: Mean of path / shortest path over the successful ones; 0 if there are none.
    """

    steps: int
    success_rate: float
    length_ratio: float


@dataclass(frozen=True, slots=True, eq=False)
class TrainedPolicy:
    """A policy and how it was trained.

    Attributes:
        network: The best network tested.
        curve: Every test, the last one included.
        steps: Environment steps taken in all.
        success_rate: Of ``network``, in its test.
        length_ratio: Of ``network``, in its test.
        tested: Number of starts of that test.
        config: The choices.
        seed: The seed.
        parent: Id of the policy that training started from, if any.
        budget: Environment steps allowed. None if a time limit ended the training or it was resumed, so that the same
            choices may not reproduce it.
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


@dataclass(frozen=True, slots=True, eq=False)
class TrainingStart:
    """Where a training starts; from scratch without arguments.

    Attributes:
        network: Network to start from. It is tested first, and returned as it is if it is good enough.
        parent: Its id, for the record.
        resumed: A checkpoint of an interrupted training with the same problems, config, seed and parent. Its steps
            count as used, and its curve is continued.
    """

    network: QNetwork | None = None
    parent: str | None = None
    resumed: TrainedPolicy | None = None


FROM_SCRATCH = TrainingStart()
