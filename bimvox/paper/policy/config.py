"""The choices behind learning on the paper's site, and the two modes."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Any

from bimvox.env.actions import named
from bimvox.paper.env.dynamics import PAPER_REWARDS
from bimvox.paper.env.observation import OBSERVATIONS
from bimvox.policy.config import DqnChoices, choices_from_dict


@dataclass(frozen=True, slots=True)
class PaperDqnConfig(DqnChoices):
    """The choices behind deep Q-learning in two layers.

    Attributes:
        observation: A key of ``OBSERVATIONS``.
        dueling: Whether a separate stream values the state (Wang et al. 2016).
        glorot: Whether weights begin as in the original stable-baselines (uniform after Glorot and Bengio 2010, biases
            zero); otherwise torch's.
        learning_rate_last: Value to which it falls linearly. None keeps it.
        learning_rate_steps: Number of steps over which it falls. None takes the budget.
        sites: Sites in parallel.
        layer_norm: Whether hidden layers are normalised before the rectifier (Ba et al. 2016); only if it is dueling.
        priority: Exponent of prioritized replay (Schaul et al. 2016): a transition is drawn in proportion to its last
            error to this power. 0 draws evenly.
        importance_first: Exponent of its importance weights at the start; it rises to 1 over the budget. None: the
            weights are equal.
        symmetry: Whether every remembered transition is rotated and mirrored in plan at random before a gradient step
            (``bimvox.paper.policy.initialization``); for the egocentric observation only.
        bootstrap_at_limit: Whether the target continues beyond the step limit (a truncation), or ends there, as in the
            original, which knew only "done".
        exploration_again: Share of random actions at the start of retraining a loaded network.
        exploration_share: Length of that phase as a share of the budget.
        exploration_steps: Its length in steps. None takes ``exploration_share``.
        budget: Steps of the initialization layer.
        retrain_budget: Steps of one retraining.
        test_exploration: Share of random actions in tests.
        test_episodes: Episodes of a test in the initialization layer.
        greedy_too: Whether the required success rate also holds without random actions, from every distinct start (or
            from ``greedy_layouts`` drawn layouts, if the site draws more than a start).
        greedy_layouts: Number of drawn layouts in that test.
        trials: Episodes of the trial on a layout.
        retrain_episodes: Episodes of a test while retraining.
        retrain_successes: How many of them must succeed.
        test_loaded_first: Whether a loaded network whose path is blocked is first tested on the changed site, and kept
            if it is good enough.
    """

    reward: str = "paper"
    hidden: tuple[int, ...] = (64, 64)
    observation: str = "paper"
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
    layer_norm: bool = False
    priority: float = 0.0
    importance_first: float | None = None
    symmetry: bool = False
    averaging: float = 0.0
    bootstrap_at_limit: bool = True
    exploration_first: float = 1.0
    exploration_again: float = 1.0
    exploration_last: float = 0.02
    exploration_spread: float = 0.0
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
        named("observation", self.observation, OBSERVATIONS)
        named("reward", self.reward, PAPER_REWARDS)
        if self.symmetry and self.observation != "egocentric":
            raise ValueError(f"symmetry: the observation {self.observation!r} has no images; egocentric has")
        if self.layer_norm and not self.dueling:
            raise ValueError("layer_norm: only a dueling network has it")
        if self.importance_first is not None and not 0.0 <= self.importance_first <= 1.0:
            raise ValueError(f"importance_first: {self.importance_first} is not in [0, 1]")
        if not self.hidden:
            raise ValueError("hidden: at least one layer is needed")
        counts = ("budget", "retrain_budget", "test_episodes", "greedy_layouts", "trials", "retrain_episodes")
        self.check("sites", *counts)
        if self.priority < 0.0:
            raise ValueError(f"priority: {self.priority} is less than zero")
        if not 0.0 <= self.averaging < 1.0:
            raise ValueError(f"averaging: {self.averaging} is not in [0, 1)")
        if self.retrain_successes > self.retrain_episodes:
            raise ValueError(f"retrain_successes: {self.retrain_successes} of {self.retrain_episodes} episodes")

    @property
    def flat_observation(self) -> str:
        """Name of the observation as a vector, as networks need it."""
        return "paper_flat" if self.observation == "paper" else self.observation

    def exploration_phase(self, budget: int) -> int:
        """Return the number of steps of a budget over which the share of random actions falls."""
        if self.exploration_steps is not None:
            return self.exploration_steps
        return int(self.exploration_share * budget)

    def learning_rate_at(self, steps: int, done: float) -> float:
        """Return the learning rate after so many steps, a share ``done`` of the budget."""
        if self.learning_rate_last is None:
            return self.learning_rate
        done = done if self.learning_rate_steps is None else steps / self.learning_rate_steps
        return self.learning_rate + min(1.0, done) * (self.learning_rate_last - self.learning_rate)

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return {**asdict(self), "hidden": list(self.hidden)}


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
    "exploration_last": 0.4,
    "exploration_spread": 6.0,
    "discount": 0.7,
    "averaging": 0.999,
    "learning_rate": 5e-4,
    "learning_rate_last": 2e-5,
    "learning_rate_steps": 10_000,
    "batch_size": 64,
    "gradient_steps": 32,
    "test_every": 1_000,
}
"""Changes of ``OUR_MODE`` for the frame of four columns and four beams. An episode of eight components fails at one
wrong choice in a hundred, at rarely visited places. So half of the sites act nearly by the policy alone and get there;
transitions with large errors are drawn more often, as eight images; and an average at a falling learning rate is
tested, because it varies less from test to test."""

AUTHORS_MODE = replace(
    PAPER_MODE,
    layer_norm=True,
    priority=0.6,
    importance_first=0.4,
    batch_size=64,
    bootstrap_at_limit=False,
    budget=500_000,
    retrain_budget=500_000,
)
"""The learner of the authors' published script (github.com/AiyuZhu/ConstructionSim-for-RL, 8a08b9d,
``construction_RL/ai_interface.py``): ``DQN(LnMlpPolicy, prioritized_replay=True, double_q=True, batch_size=64)`` of the
original stable-baselines for 500,000 steps, so random actions become fewer over 50,000 steps. The script retrains for
5,000,000 steps, which would explore ten times as long; here retraining has the same budget."""

MODES: dict[str, PaperDqnConfig] = {"paper": PAPER_MODE, "ours": OUR_MODE, "authors": AUTHORS_MODE}


def paper_config_from_dict(plain: dict[str, Any]) -> PaperDqnConfig:
    """Return the configuration of :meth:`PaperDqnConfig.to_dict`; see ``choices_from_dict``."""
    return choices_from_dict(PaperDqnConfig, plain)
