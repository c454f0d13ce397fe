"""The training recipe of the generalist: deep Q-learning on thousands of random sites at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.callbacks import BaseCallback

from bimvox.env.batched import BatchedLiftEnv
from bimvox.env.dynamics import StepLimit
from bimvox.env.pool import StartMix
from bimvox.env.problem import LiftProblem
from bimvox.planning.rollout import Values
from bimvox.policy.config import DqnConfig
from bimvox.policy.dqn import dqn_of_lifts, load_network, network_of
from bimvox.policy.generalist.problems import FAMILIES
from bimvox.policy.network import QNetwork
from bimvox.policy.train import TEST_LIMIT, Evaluation, evaluate

_SEED = 0
LESSON_COUNT = 16_000
BUILDING_LIFTS = 800
CHECK_COUNT = 500
STEPS = 40_000_000
SMALL_LESSON_COUNT, SMALL_STEPS = 5_000, 1_200_000
"""For two cores without an accelerator; the shipped policy was trained with these."""

RECIPE = DqnConfig(
    hidden=(256, 256, 128),
    learning_rate=7e-4,
    learning_rate_last=1e-5,
    cooling=0.5,
    batch_size=8192,
    buffer_size=2_000_000,
    learning_starts=40_000,
    lifts=4096,
    gradient_steps=8,
    target_update=250,
    exploration_steps=400_000,
    exploration_last=0.4,
    exploration_spread=6.0,
    averaging=0.999,
    teacher=1.0,
    mix=StartMix(0.25, 0.15, 10),
    limit=StepLimit(3.0, 40),
    test_every=1_500_000,
)
"""For a machine with an accelerator; no run on one is recorded yet. For two cores without one, see
:func:`small_recipe`."""

_REWEIGH_EVERY = 100


def small_recipe() -> DqnConfig:
    """Return the recipe for two cores: fewer lifts in parallel and smaller batches."""
    return replace(
        RECIPE,
        lifts=256,
        batch_size=1024,
        gradient_steps=2,
        buffer_size=300_000,
        learning_starts=5_000,
        target_update=200,
        averaging=0.998,
        exploration_steps=30_000,
        learning_rate=1e-3,
        learning_rate_last=2e-5,
        test_every=100_000,
    )


def continuing(config: DqnConfig) -> DqnConfig:
    """Return a recipe for continuing from trained weights: a lower learning rate and less exploration."""
    return replace(
        config,
        learning_rate=0.4 * config.learning_rate,
        learning_starts=4 * config.learning_starts,
        exploration_first=config.exploration_last,
    )


@dataclass(frozen=True, slots=True)
class Check:
    """One test during the generalist's training.

    Attributes:
        steps: Environment steps so far.
        success_rate: Share of the check problems that were solved.
        length_ratio: Mean path / shortest path over the solved ones.
        by_family: Success rate of each family, in the order of ``FAMILIES``.
    """

    steps: int
    success_rate: float
    length_ratio: float
    by_family: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Run:
    """How a training runs.

    Attributes:
        seed: The same lessons, config, seed and device give the same weights, unless ``seconds`` is set.
        steps: Budget in environment steps.
        seconds: Time limit; the learning rate falls towards whichever end comes first. None for no limit.
        device: As torch names it.
        threads: For stepping the lifts.
        half: Whether to multiply in bfloat16.
    """

    seed: int = _SEED
    steps: int = STEPS
    seconds: float | None = None
    device: str = "cpu"
    threads: int = 1
    half: bool = False


def train_generalist(
    problems: Sequence[LiftProblem],
    checks: Sequence[LiftProblem],
    config: DqnConfig,
    run: Run,
    *,
    families: int = len(FAMILIES),
    initial: QNetwork | None = None,
    report: Callable[[Check, QNetwork], None] | None = None,
) -> QNetwork:
    """Train the generalist and return its last network (averaged).

    Args:
        problems: The lessons.
        checks: Problems of the tests during training, families in turn; never learned from.
        config: The choices.
        run: Seed, budget and machine.
        families: Number of families that take turns in ``checks``.
        initial: Network to start from.
        report: Called with every check.
    """
    batch = BatchedLiftEnv(
        problems,
        config.lifts,
        reward_name=config.reward,
        mix=config.mix,
        limit=config.limit,
        seed=run.seed,
        threads=run.threads,
        teacher_discount=config.discount if config.teacher else 0.0,
    )
    torch.set_num_threads(run.threads)
    torch.set_float32_matmul_precision("high")
    dqn = dqn_of_lifts(batch, config, run.seed, device=run.device, seconds=run.seconds, half=run.half)
    if initial is not None:
        load_network(dqn, initial)

    def check(steps_done: int) -> None:
        network = network_of(dqn)
        found = _evaluate_in_parallel(network, checks, run.threads)
        by_family = tuple(float(found.arrived[n::families].mean()) for n in range(families))
        if report is not None:
            report(Check(steps_done, found.success_rate, found.length_ratio, by_family), network)

    if initial is not None:
        check(0)
    checks_done = _Checks(batch, check, config.test_every, run.seconds)
    dqn.learn(run.steps, callback=checks_done)
    if checks_done.last != dqn.num_timesteps:
        check(dqn.num_timesteps)
    return network_of(dqn)


def _evaluate_in_parallel(values: Values, problems: Sequence[LiftProblem], threads: int = 1) -> Evaluation:
    """Return the roll-outs of a policy on each problem from its first start, on several threads."""
    single = [
        LiftProblem(p.space, p.start_vox, p.target_vox, np.array([p.start_vox], np.int32), p.distance) for p in problems
    ]
    parts = np.array_split(np.arange(len(single)), min(len(single), max(1, 4 * threads)))

    def work(part: NDArray[np.int64]) -> Evaluation:
        return evaluate(values, [single[n] for n in part], starts=len(part), limit=TEST_LIMIT)

    with ThreadPoolExecutor(threads) as executor:
        found = list(executor.map(work, parts))
    return Evaluation(
        np.arange(len(single)),
        np.concatenate([e.arrived for e in found]),
        np.concatenate([e.moves for e in found]),
        np.concatenate([e.shortest for e in found]),
    )


class _Checks(BaseCallback):
    """Runs the tests, draws lessons more often that fail more often, and stops at the time limit."""

    def __init__(self, batch: BatchedLiftEnv, check: Callable[[int], None], every: int, seconds: float | None) -> None:
        super().__init__()
        self._batch, self._check, self._every, self._seconds = batch, check, every, seconds
        self._next = every
        self._tries = np.ones(batch.problems)
        self._failures = np.zeros(batch.problems)
        self._calls = 0
        self.last = 0

    def _on_step(self) -> bool:
        step = self.training_env.last_step  # type: ignore[attr-defined]
        ended = step.ended
        self._tries += np.bincount(self._batch.ended_problem[ended], minlength=self._tries.size)
        failed = ended & ~step.terminated
        self._failures += np.bincount(self._batch.ended_problem[failed], minlength=self._tries.size)
        self._calls += 1
        if self._calls % _REWEIGH_EVERY == 0:
            self._batch.weigh_problems(1.0 + 4.0 * self._failures / self._tries)
            self._tries = 0.9 * self._tries + 0.1
            self._failures *= 0.9
        if self.num_timesteps >= self._next:
            self._next += self._every
            self._check(self.num_timesteps)
            self.last = self.num_timesteps
        return self._seconds is None or self.model.seconds_used < self._seconds  # type: ignore[attr-defined]
