"""Every choice behind learning on the paper's site, and the two named sets of choices."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
from typing import Any

from bimvox.errors import PolicyError
from bimvox.paper.env.observation import OBSERVATIONS
from bimvox.paper.env.reward import PAPER_REWARDS


@dataclass(frozen=True, slots=True)
class PaperDqnConfig:
    """Deep Q-learning in two layers. Steps are environment steps, summed over all sites in parallel.

    Attributes:
        observation: A key of ``OBSERVATIONS``.
        reward: A key of ``PAPER_REWARDS``.
        hidden: Widths of the hidden layers, in each stream if ``dueling``.
        dueling: Whether a separate stream values the state (Wang et al. 2016).
        double_q: Whether the online network chooses the action that the target network values (van Hasselt et al.
            2016).
        glorot: Whether weights begin as in the original stable-baselines (uniform after Glorot and Bengio 2010, biases
            zero); otherwise torch's.
        discount: Per step.
        learning_rate: Of Adam.
        learning_rate_last: Value to which it falls linearly. None keeps it.
        learning_rate_steps: Number of steps over which it falls. None takes the budget.
        batch_size: Transitions per gradient step.
        buffer_size: Transitions remembered.
        learning_starts: Steps before the first gradient step.
        sites: Sites in parallel.
        gradient_steps: Gradient steps per ``sites`` steps.
        target_update: Gradient steps between two copies to the target network.
        max_gradient_norm: Gradients of one variable are scaled down to this length, as the original did.
        priority: Exponent of prioritized replay (Schaul et al. 2016), without importance weights: a transition is drawn
            in proportion to its last error to this power. 0 draws evenly.
        symmetry: Whether every remembered transition is rotated and mirrored in plan at random before a gradient step
            (``bimvox.paper.policy.symmetry``); for the egocentric observation only.
        averaging: Share by which the network that is tested and kept moves towards the one in training per gradient
            step (Polyak averaging); 1 tests and keeps the one in training itself. An average varies less from test
            to test.
        bootstrap_at_limit: Whether the target continues beyond the step limit (a truncation), or ends there, as in the
            original, which knew only "done".
        exploration_first: Share of random actions at the start.
        exploration_again: The same at the start of retraining a loaded network.
        exploration_last: The same from the end of the exploration phase on.
        exploration_spread: Whether half of the sites act by the policy alone, and the others take up to four times as
            many random actions each: the first find where the policy fails, the others see what it never reaches.
        exploration_share: Length of that phase as a share of the budget.
        exploration_steps: Its length in steps. None takes ``exploration_share``.
        budget: Steps of the initialization layer.
        retrain_budget: Steps of one retraining.
        test_every: Steps between two tests.
        test_exploration: Share of random actions in tests.
        test_episodes: Episodes of a test in the initialization layer.
        required_success: Success rate at which the initialization layer stops.
        greedy_too: Whether that rate is also required without random actions, from every distinct start (or from
            ``greedy_layouts`` drawn layouts, if the site draws more than a start).
        greedy_layouts: Number of drawn layouts in that test.
        trials: Episodes of the trial on a layout.
        retrain_episodes: Episodes of a test while retraining.
        retrain_successes: How many of them must succeed.
        test_loaded_first: Whether a loaded network whose path is blocked is first tested on the changed site, and kept
            if it is good enough.
    """

    observation: str = "paper"
    reward: str = "paper"
    hidden: tuple[int, ...] = (64, 64)
    dueling: bool = True
    double_q: bool = True
    glorot: bool = True
    discount: float = 0.99
    learning_rate: float = 5e-4
    learning_rate_last: float | None = None
    learning_rate_steps: int | None = None
    batch_size: int = 32
    buffer_size: int = 50_000
    learning_starts: int = 1_000
    sites: int = 1
    gradient_steps: int = 1
    target_update: int = 500
    max_gradient_norm: float = 10.0
    priority: float = 0.0
    symmetry: bool = False
    averaging: float = 1.0
    bootstrap_at_limit: bool = True
    exploration_first: float = 1.0
    exploration_again: float = 1.0
    exploration_last: float = 0.02
    exploration_spread: bool = False
    exploration_share: float = 0.1
    exploration_steps: int | None = None
    budget: int = 100_000
    retrain_budget: int = 50_000
    test_every: int = 2_000
    test_exploration: float = 0.02
    test_episodes: int = 100
    required_success: float = 1.0
    greedy_too: bool = False
    greedy_layouts: int = 200
    trials: int = 10
    retrain_episodes: int = 10
    retrain_successes: int = 8
    test_loaded_first: bool = False

    def __post_init__(self) -> None:
        if self.observation not in OBSERVATIONS:
            raise ValueError(f"observation: {self.observation!r} is unknown; there are {', '.join(OBSERVATIONS)}")
        if self.reward not in PAPER_REWARDS:
            raise ValueError(f"reward: {self.reward!r} is unknown; there are {', '.join(PAPER_REWARDS)}")
        if self.symmetry and self.observation != "egocentric":
            raise ValueError(f"symmetry: the observation {self.observation!r} has no images; egocentric has")
        for name in (
            "batch_size",
            "sites",
            "gradient_steps",
            "target_update",
            "budget",
            "retrain_budget",
            "test_every",
            "test_episodes",
            "greedy_layouts",
            "trials",
            "retrain_episodes",
        ):
            if getattr(self, name) < 1:
                raise ValueError(f"{name}: {getattr(self, name)} is less than one")
        if not self.hidden or min(self.hidden) < 1:
            raise ValueError(f"hidden: {self.hidden} holds no layer, or an empty one")
        if self.buffer_size < self.sites:
            raise ValueError(f"buffer_size: {self.buffer_size} holds not even one step of {self.sites} sites")
        if not 0.0 <= self.discount < 1.0:
            raise ValueError(f"discount: {self.discount} is not in [0, 1)")
        if self.priority < 0.0:
            raise ValueError(f"priority: {self.priority} is less than zero")
        if not 0.0 < self.averaging <= 1.0:
            raise ValueError(f"averaging: {self.averaging} is not in (0, 1]")
        if self.retrain_successes > self.retrain_episodes:
            raise ValueError(f"retrain_successes: {self.retrain_successes} of {self.retrain_episodes} episodes")

    def exploration_phase(self, budget: int) -> int:
        """Return the number of steps of a budget over which the share of random actions falls."""
        if self.exploration_steps is not None:
            return self.exploration_steps
        return int(self.exploration_share * budget)

    def learning_rate_at(self, steps: int, budget: int) -> float:
        """Return the learning rate after so many steps of a budget."""
        if self.learning_rate_last is None:
            return self.learning_rate
        over = budget if self.learning_rate_steps is None else self.learning_rate_steps
        return self.learning_rate + min(1.0, steps / max(1, over)) * (self.learning_rate_last - self.learning_rate)

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON, without the fields of ``ADDED_LATER`` that have their default."""
        plain = asdict(self)
        plain["hidden"] = list(self.hidden)
        for name in ADDED_LATER:
            if plain[name] == _DEFAULTS[name]:
                del plain[name]
        return plain


ADDED_LATER = ("exploration_spread", "symmetry", "priority")
"""Choices that earlier versions did not have. Files leave them out at their default, so that networks and experiments
of those versions stay valid."""

_DEFAULTS = {field.name: field.default for field in fields(PaperDqnConfig)}

PAPER_MODE = PaperDqnConfig()
"""The paper's observation and reward, and the defaults of the original stable-baselines' DQN, on one site."""

OUR_MODE = PaperDqnConfig(
    observation="egocentric",
    reward="shaped",
    hidden=(128, 64),
    dueling=False,
    double_q=False,
    glorot=False,
    discount=0.5,
    learning_rate=1e-3,
    batch_size=128,
    learning_starts=256,
    sites=16,
    gradient_steps=16,
    target_update=100,
    exploration_again=0.2,
    exploration_last=0.1,
    exploration_steps=1_000,
    budget=20_000,
    retrain_budget=20_000,
    test_every=250,
    greedy_too=True,
    test_loaded_first=True,
)
"""Our egocentric observation, taught by the exact distance-to-go of the training site, which the policy never sees;
many sites in parallel."""

FRAME_CHANGES: dict[str, Any] = {
    "symmetry": True,
    "priority": 0.6,
    "exploration_spread": True,
    "discount": 0.7,
    "averaging": 0.001,
    "learning_rate": 5e-4,
    "learning_rate_last": 2e-5,
    "learning_rate_steps": 10_000,
    "batch_size": 64,
    "gradient_steps": 32,
    "test_every": 1_000,
}
"""What the frame of four columns and four beams changes in ``OUR_MODE``. An episode of eight components fails at one
wrong choice in a hundred, at rarely visited places. So half of the sites act by the policy alone and get there;
transitions with large errors are drawn more often, as eight images; and an average at a falling learning rate is
tested, because it varies less from test to test."""

MODES: dict[str, PaperDqnConfig] = {"paper": PAPER_MODE, "ours": OUR_MODE}


def paper_config_from_dict(plain: dict[str, Any]) -> PaperDqnConfig:
    """Return the configuration of :meth:`PaperDqnConfig.to_dict`.

    Raises:
        PolicyError: A key is missing or unknown, or a value is impossible.
    """
    names = {field.name for field in fields(PaperDqnConfig)}
    if not names - set(ADDED_LATER) <= set(plain) <= names:
        raise PolicyError(
            "the training configuration has other keys than this version's",
            differs={"missing": sorted(names - set(plain) - set(ADDED_LATER)), "unknown": sorted(set(plain) - names)},
        )
    try:
        return PaperDqnConfig(**{**plain, "hidden": tuple(plain["hidden"])})
    except (TypeError, ValueError) as error:
        raise PolicyError(f"the training configuration is impossible: {error}") from error
