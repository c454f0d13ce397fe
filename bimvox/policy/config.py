"""The choices behind a training run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, fields, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from bimvox.env.actions import named
from bimvox.env.dynamics import REWARDS, StepLimit
from bimvox.env.pool import TRAINING_MIX, StartMix
from bimvox.errors import PolicyError

C = TypeVar("C", bound="DqnChoices")


@dataclass(frozen=True, slots=True)
class DqnChoices:
    """The choices that every training by deep Q-learning makes (Mnih et al. 2015).

    Steps are environment steps, summed over all environments in parallel.

    Attributes:
        hidden: Widths of the hidden layers.
        reward: Name of the reward.
        discount: Per step. Low for the shaped reward, because it rates each move at once.
        learning_rate: Of Adam.
        batch_size: Transitions per gradient step.
        buffer_size: Transitions remembered.
        learning_starts: Steps before the first gradient step.
        gradient_steps: Gradient steps each time all environments have taken one step.
        target_update: Gradient steps between two copies to the target network.
        double_q: Whether the online network chooses the action that the target network values (double Q-learning, van
            Hasselt et al. 2016).
        averaging: Share of the old weights in their running average, per gradient step; the average is tested and kept.
            0: no average. An average varies less from test to test.
        max_gradient_norm: Gradients are scaled down to this length.
        exploration_first: Share of random actions at the start.
        exploration_last: The same from the end of the exploration phase on.
        exploration_spread: How differently the environments explore: number n of N with the share to the power
            1 + spread n / (N - 1) (Horgan et al. 2018); 0: all alike.
        test_every: Steps between two tests.
        required_success: Success rate at which training stops.
    """

    hidden: tuple[int, ...]
    reward: str
    discount: float
    learning_rate: float
    batch_size: int
    buffer_size: int
    learning_starts: int
    gradient_steps: int
    target_update: int
    double_q: bool
    averaging: float
    max_gradient_norm: float
    exploration_first: float
    exploration_last: float
    exploration_spread: float
    test_every: int
    required_success: float

    @property
    def huber(self) -> float:
        """Error from which on the loss is linear."""
        return 1.0

    @property
    def teacher(self) -> float:
        """Weight of the second loss, by the distance field."""
        return 0.0

    @property
    def priority(self) -> float:
        """Exponent of prioritized replay."""
        return 0.0

    @property
    def importance_first(self) -> float | None:
        """Exponent of the importance weights of prioritized replay at the start; None: the weights are equal."""
        return None

    @property
    def bootstrap_at_limit(self) -> bool:
        """Whether the value goes on when an episode ends only because its steps are used up."""
        return True

    def exploration_phase(self, budget: int) -> int:
        """Return the number of steps of a budget over which the share of random actions falls."""
        raise NotImplementedError

    def learning_rate_at(self, steps: int, done: float) -> float:
        """Return the learning rate after so many steps, a share ``done`` of the budget."""
        raise NotImplementedError

    def random_shares(self, steps: int, budget: int, count: int) -> NDArray[np.float64]:
        """Return (N,) the share of random actions of each environment after so many steps of a budget."""
        done = min(1.0, steps / max(1, self.exploration_phase(budget)))
        share = self.exploration_first + done * (self.exploration_last - self.exploration_first)
        powers = 1.0 + self.exploration_spread * np.arange(count) / max(1, count - 1)
        return np.asarray(share**powers, np.float64)

    def check(self, environments: str, *counts: str) -> None:
        """Refuse impossible choices.

        Args:
            environments: Name of the field with the number of environments in parallel.
            *counts: Names of further fields that must be at least one.

        Raises:
            ValueError: The message begins with the name of the field.
        """
        for name in ("batch_size", "gradient_steps", "target_update", "test_every", environments, *counts):
            if getattr(self, name) < 1:
                raise ValueError(f"{name}: {getattr(self, name)} is less than one")
        if any(width < 1 for width in self.hidden):
            raise ValueError(f"hidden: {self.hidden} holds an empty layer")
        if self.buffer_size < getattr(self, environments):
            raise ValueError(f"buffer_size: {self.buffer_size} is less than one step of all {environments}")
        if not 0.0 <= self.discount < 1.0:
            raise ValueError(f"discount: {self.discount} is not in [0, 1)")

    def sb3_arguments(self) -> dict[str, Any]:
        """Return the arguments of stable-baselines3's DQN."""
        return {
            "learning_rate": self.learning_rate,
            "buffer_size": self.buffer_size,
            "learning_starts": self.learning_starts,
            "batch_size": self.batch_size,
            "gamma": self.discount,
            "train_freq": 1,
            "gradient_steps": self.gradient_steps,
            "max_grad_norm": self.max_gradient_norm,
        }


@dataclass(frozen=True, slots=True)
class DqnConfig(DqnChoices):
    """The choices behind a policy of crane lifts, trained on many lifts at once.

    Attributes:
        lifts: Environments in parallel.
        exploration_steps: Steps over which the share of random actions falls linearly; not a share of the budget, so
            that a larger budget begins with the same run.
        learning_rate_last: Learning rate at the end of the budget; it falls linearly over the last ``cooling`` of it.
        cooling: Share of the budget over which the learning rate falls.
        teacher: Weight of a second loss: how much better each free move is than their mean, against the same by the
            distance field. 0: reward only.
        mix: Where training episodes begin.
        limit: Actions allowed per training episode and per test, from the exact distance.
        test_starts: Yard starts per test, evenly spread over the problems and over the starts of each.
        both_ways: Whether a test rolls out as a plan does, with several guards, from both ends and with detours cut,
            instead of once from the start.
        required_ratio: Largest mean path / shortest path at which training stops.
    """

    hidden: tuple[int, ...] = (256, 128)
    reward: str = "shaped"
    discount: float = 0.9
    learning_rate: float = 1e-3
    batch_size: int = 128
    buffer_size: int = 50_000
    learning_starts: int = 512
    lifts: int = 64
    gradient_steps: int = 4
    target_update: int = 100
    double_q: bool = False
    exploration_first: float = 1.0
    exploration_last: float = 0.1
    exploration_steps: int = 2_000
    exploration_spread: float = 0.0
    learning_rate_last: float = 1e-3
    cooling: float = 0.3
    averaging: float = 0.0
    teacher: float = 0.0
    max_gradient_norm: float = 10.0
    mix: StartMix = TRAINING_MIX
    limit: StepLimit = StepLimit()  # noqa: RUF009  (immutable)
    test_every: int = 2_000
    test_starts: int = 256
    both_ways: bool = False
    required_success: float = 1.0
    required_ratio: float = 1.05

    def __post_init__(self) -> None:
        named("reward", self.reward, REWARDS)
        self.check("lifts", "test_starts")

    @property
    def huber(self) -> float:
        """Error from which on the loss is linear."""
        return 0.1

    def exploration_phase(self, budget: int) -> int:
        """Return the number of steps over which the share of random actions falls."""
        return self.exploration_steps

    def learning_rate_at(self, steps: int, done: float) -> float:
        """Return the learning rate at a share of the budget."""
        cooled = min(1.0, max(0.0, (done - 1.0 + self.cooling) / max(1e-9, self.cooling)))
        return self.learning_rate + cooled * (self.learning_rate_last - self.learning_rate)

    def is_passed_by(self, success_rate: float, length_ratio: float) -> bool:
        """Return whether a test's result is good enough to stop."""
        return success_rate >= self.required_success and length_ratio <= self.required_ratio

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        plain = asdict(self)
        plain["mix"] = self.mix._asdict()
        plain["limit"] = self.limit._asdict()
        return plain


def adapting(config: DqnConfig, hidden: tuple[int, ...]) -> DqnConfig:
    """Return the choices for continuing from a trained network with these hidden layers.

    A lower learning rate, less exploration; tests roll out as a plan does. Without a failure, their number proves a
    success rate of at least 99 % with 95 % confidence.
    """
    return replace(
        config,
        hidden=hidden,
        learning_rate=3e-4,
        learning_rate_last=1e-4,
        batch_size=256,
        gradient_steps=2,
        learning_starts=1_024,
        exploration_first=0.3,
        exploration_last=0.1,
        exploration_spread=3.0,
        averaging=0.99,
        test_every=4_000,
        test_starts=320,
        both_ways=True,
    )


def config_from_dict(plain: dict[str, Any]) -> DqnConfig:
    """Return the configuration of :meth:`DqnConfig.to_dict`; see :func:`choices_from_dict`."""
    return choices_from_dict(
        DqnConfig, plain, mix=lambda values: StartMix(**values), limit=lambda values: StepLimit(**values)
    )


def choices_from_dict(kind: type[C], plain: dict[str, Any], **convert: Callable[[Any], Any]) -> C:
    """Return choices from JSON values.

    ``convert``: how the values of some fields become Python's.

    Raises:
        PolicyError: A key is missing or unknown, or a value is impossible.
    """
    names = {field.name for field in fields(kind)}
    missing, unknown = names - set(plain), set(plain) - names
    if missing or unknown:
        raise PolicyError(
            "the training configuration has other keys than this version's",
            differs={"missing": sorted(missing), "unknown": sorted(unknown)},
        )
    try:
        converted = {name: function(plain[name]) for name, function in convert.items()}
        return kind(**{**plain, "hidden": tuple(plain["hidden"]), **converted})
    except (TypeError, ValueError) as error:
        raise PolicyError(f"the training configuration is impossible: {error}") from error
