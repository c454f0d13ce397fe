"""Every choice behind a training run."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields, replace
from typing import Any

from bimvox.env.limits import StepLimit
from bimvox.env.reward import REWARDS
from bimvox.env.starts import TRAINING_MIX, StartMix
from bimvox.errors import PolicyError


@dataclass(frozen=True, slots=True)
class DqnConfig:
    """Deep Q-learning (Mnih et al. 2015) on many lifts at once.

    Steps are environment steps, summed over all lifts in parallel.

    Attributes:
        hidden: Widths of the hidden layers.
        reward: A key of ``bimvox.env.reward.REWARDS``.
        discount: Per step. Low, because the shaped reward rates each move at once.
        learning_rate: Of Adam.
        batch_size: Transitions per gradient step.
        buffer_size: Transitions remembered.
        learning_starts: Steps before the first gradient step.
        lifts: Environments in parallel.
        gradient_steps: Gradient steps per ``lifts`` environment steps.
        target_update: Gradient steps between two copies to the target network.
        double_q: Whether the online network chooses the action that the target network values (double Q-learning, van
            Hasselt et al. 2016). Off by default: with the exact shaped reward it changed nothing in the steps needed.
        exploration_first: Share of random actions at the start.
        exploration_last: The same from ``exploration_steps`` on.
        exploration_steps: Steps over which the share falls linearly; not a share of the budget, so that a larger
            budget begins with the same run.
        exploration_spread: How differently the lifts explore: lift n of N with the share to the power
            1 + spread n / (N - 1) (Horgan et al. 2018); 0: all alike.
        learning_rate_last: Learning rate at the end of the budget; it falls linearly over the last ``cooling`` of it.
        cooling: Share of the budget over which the learning rate falls.
        averaging: Share of the old weights in their running average, per gradient step; the average is tested and kept.
            0: no average.
        teacher: Weight of a second loss: all six values against those of the distance field. 0: reward only.
        max_gradient_norm: Gradients are scaled down to this length.
        mix: Where training episodes begin.
        limit: Actions allowed per training episode and per test, from the exact distance.
        test_every: Steps between two tests.
        test_starts: Yard starts per test, evenly spread over the problems and over the starts of each.
        both_ways: Whether a test rolls out as a plan does, with several guards, from both ends and with detours cut,
            instead of once from the start.
        required_success: Success rate at which training stops.
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
        if self.reward not in REWARDS:
            raise ValueError(f"reward {self.reward!r}: known are {', '.join(REWARDS)}")
        if min(self.lifts, self.batch_size, self.gradient_steps, self.test_every, self.test_starts, *self.hidden) < 1:
            raise ValueError("lifts, batch_size, gradient_steps, test_every, test_starts and hidden must be positive")
        if self.buffer_size < self.lifts:
            raise ValueError(f"buffer_size {self.buffer_size} holds not even one step of {self.lifts} lifts")
        if not 0.0 <= self.discount < 1.0:
            raise ValueError(f"discount {self.discount}: it must be in [0, 1)")

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
    """Return the configuration of :meth:`DqnConfig.to_dict`.

    Raises:
        PolicyError: A key is missing or unknown, or a value is impossible.
    """
    names = {field.name for field in fields(DqnConfig)}
    if set(plain) != names:
        raise PolicyError(
            "the training configuration has other keys than this version's",
            differs={"missing": sorted(names - set(plain)), "unknown": sorted(set(plain) - names)},
        )
    try:
        return DqnConfig(
            **{
                **plain,
                "hidden": tuple(plain["hidden"]),
                "mix": StartMix(**plain["mix"]),
                "limit": StepLimit(**plain["limit"]),
            }
        )
    except (TypeError, ValueError) as error:
        raise PolicyError(f"the training configuration is impossible: {error}") from error
