"""Training a site's policy: deep Q-learning until its greedy roll-outs, with the planner's loop guard, succeed.

A network to start from is tested before torch is imported; if it is good enough, torch is not needed.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from bimvox.env.dynamics import StepLimit
from bimvox.env.problem import LiftProblem, is_learnable
from bimvox.errors import PlanningError
from bimvox.extras import require
from bimvox.planning.rollout import LIFTS_AT_ONCE, ROLLOUT_LIMIT, Values, roll_out_all, roll_out_starts
from bimvox.policy.config import DqnConfig
from bimvox.policy.manifest import FROM_SCRATCH, CurvePoint, TrainedPolicy, TrainingStart
from bimvox.policy.network import QNetwork

TEST_LIMIT = StepLimit(8.0, 200)
"""Limit of each try in a test; tighter than a plan's, because lifts that fail take most of a test's time."""


_GOOD_ENOUGH = 1.05
"""A test tries no further guard once a path is at most this many times the shortest: it measures arrival."""


@dataclass(frozen=True, slots=True, eq=False)
class Evaluation:
    """The outcome of a test.

    Attributes:
        problem: (L,) int64 problem of each roll-out.
        arrived: (L,) bool.
        moves: (L,) int64 moves of the path (loops cut).
        shortest: (L,) int64 fewest moves possible.
    """

    problem: NDArray[np.int64]
    arrived: NDArray[np.bool_]
    moves: NDArray[np.int64]
    shortest: NDArray[np.int64]

    @property
    def success_rate(self) -> float:
        """Share of the roll-outs that reached the target."""
        return float(self.arrived.mean())

    @property
    def length_ratio(self) -> float:
        """Mean path / shortest path over those roll-outs; 0 if there are none."""
        if not self.arrived.any():
            return 0.0
        return float((self.moves[self.arrived] / self.shortest[self.arrived]).mean())


def success_at_least(successes: int, tests: int, confidence: float = 0.95) -> float:
    """Return the lower bound of a success rate after so many tests (Clopper and Pearson 1934, one-sided).

    Without a failure it is (1 - confidence) to the power 1 / tests: 256 tests give 98.8 %.

    Args:
        successes: Of the tests.
        tests: How many.
        confidence: Probability that the true rate is not below the bound.
    """
    from scipy.special import betaincinv

    if successes == 0:
        return 0.0
    return float(betaincinv(successes, tests - successes + 1, 1.0 - confidence))


def evaluate(
    values: Values,
    problems: Sequence[LiftProblem],
    *,
    starts: int,
    limit: StepLimit = ROLLOUT_LIMIT,
    both_ways: bool = False,
) -> Evaluation:
    """Return roll-outs of a policy from yard starts, evenly spread over the problems and the starts of each.

    Args:
        values: The policy.
        problems: Learnable problems.
        starts: At most so many in total, but at least one per problem.
        limit: Moves allowed: for one roll-out from the exact distance, otherwise from the Manhattan distance.
        both_ways: Whether to roll out as a plan does: with several guards, also from the target if none arrives, and
            with detours cut.
    """
    problem_of: list[int] = []
    chosen_starts: list[NDArray[np.int32]] = []
    each = max(1, starts // len(problems))
    for p, problem in enumerate(problems):
        count = min(each, len(problem.starts_vox))
        chosen = np.linspace(0, len(problem.starts_vox) - 1, count).round().astype(np.int64)
        chosen_starts += list(problem.starts_vox[chosen])
        problem_of += [p] * count
    index = np.array(problem_of, np.int64)
    cells = np.array(chosen_starts, np.int32)
    shortest = np.array([problems[p].distance_from(cell) for p, cell in zip(problem_of, chosen_starts, strict=True)])
    arrived = np.zeros(len(index), np.bool_)
    moves = np.zeros(len(index), np.int64)
    for first in range(0, len(problems), LIFTS_AT_ONCE):
        rows = np.flatnonzero((index >= first) & (index < first + LIFTS_AT_ONCE))
        part = problems[first : first + LIFTS_AT_ONCE]
        if both_ways:
            lifts = [replace(problems[index[row]], start_vox=tuple(cells[row].tolist())) for row in rows]
            enough = np.floor(_GOOD_ENOUGH * shortest[rows]).astype(int).tolist()
            rollouts = roll_out_all(values, lifts, limit=limit, least_moves=enough)
        else:
            rollouts = roll_out_starts(
                values, part, index[rows] - first, cells[rows], limit=limit, least_moves=shortest[rows]
            )
        for row, rollout in zip(rows, rollouts, strict=True):
            arrived[row] = rollout.arrived
            moves[row] = len(rollout.path_vox) - 1
    return Evaluation(index, arrived, moves, shortest.astype(np.int64))


_HARD_PROBLEMS_FIRST = 4.0
"""How much more often a problem is drawn that failed from every start in the last test than one that succeeded."""


def train(
    problems: Sequence[LiftProblem],
    config: DqnConfig,
    *,
    seed: int,
    steps: int,
    start: TrainingStart = FROM_SCRATCH,
    seconds: float | None = None,
    progress: Callable[[CurvePoint], None] | None = None,
    checkpoint: Callable[[TrainedPolicy], None] | None = None,
) -> TrainedPolicy:
    """Train one policy for all of a site's lifts.

    The best network tested is kept. Training stops when it is as good as ``config`` requires, or when the budget is
    used up.

    Args:
        problems: The lifts, made by ``training_problem``. Unsolvable ones are left out.
        config: The choices.
        seed: The same problems, config, seed and start give the same weights.
        steps: Budget in environment steps, summed over the lifts in parallel.
        start: Where training starts.
        seconds: Time limit, checked at every test; the result then depends on the machine. None for no limit.
        progress: Called with every test.
        checkpoint: Called with the best policy so far after every test; pass it as ``start.resumed`` to resume. A
            resumed run differs from an uninterrupted one, because the replay memory is not kept.

    Raises:
        PlanningError: None of the problems can be solved.
    """
    learnable = [problem for problem in problems if is_learnable(problem)]
    if not learnable:
        raise PlanningError(
            f"none of {len(problems)} lifts has a path from the yard to its place, so there is nothing to learn",
            hint="bimvox plan reports what blocks each lift",
        )
    resumed = start.resumed
    budget = steps if seconds is None and resumed is None else None
    record = _Record(learnable, config, seed, start.parent, budget, progress, checkpoint)
    first = resumed.network if resumed is not None else start.network
    if resumed is not None:
        record.resume(resumed)
    elif start.network is not None and record.test(start.network, 0, counts=not start.anyway) and not start.anyway:
        return record.policy
    done = resumed.steps if resumed is not None else 0
    if done >= steps:
        return record.policy
    require("train", "training")
    import torch

    from bimvox.env.batched import BatchedLiftEnv
    from bimvox.policy.dqn import dqn_of_lifts, load_network, network_of
    from bimvox.policy.vec_env import TestsAtIntervals

    torch.set_num_threads(1)  # more threads slow down layers this small
    batch = BatchedLiftEnv(
        learnable, config.lifts, reward_name=config.reward, mix=config.mix, limit=config.limit, seed=seed
    )
    dqn = dqn_of_lifts(batch, config, seed, is_framed=first is None or first.is_framed)
    if first is not None:
        load_network(dqn, first)
    dqn.num_timesteps = done
    ends = None if seconds is None else time.monotonic() + seconds

    def test(steps_done: int) -> bool:
        if record.test(network_of(dqn), steps_done) or (ends is not None and time.monotonic() >= ends):
            return True
        batch.weigh_problems(record.weights())
        return False

    tests = TestsAtIntervals(test, config.test_every, steps, done)
    dqn.learn(steps - done, callback=tests, reset_num_timesteps=False)
    return record.policy


@dataclass(slots=True, eq=False)
class _Record:
    """The tests so far and the best policy among them; the fields are arguments of :func:`train`."""

    problems: Sequence[LiftProblem]
    config: DqnConfig
    seed: int
    parent: str | None
    budget: int | None
    progress: Callable[[CurvePoint], None] | None
    checkpoint: Callable[[TrainedPolicy], None] | None
    evaluation: Evaluation | None = None
    curve: list[CurvePoint] = field(default_factory=list)
    best: tuple[CurvePoint, QNetwork, int] | None = None

    @property
    def policy(self) -> TrainedPolicy:
        """The best policy tested so far."""
        if self.best is None:
            raise RuntimeError("no network was tested yet")
        point, network, tested = self.best
        return TrainedPolicy(
            tuple(self.curve), self.curve[-1].steps, point.success_rate, point.length_ratio, tested,
            self.config, self.seed, self.parent, self.budget, network=network,
        )  # fmt: skip

    def resume(self, checkpoint: TrainedPolicy) -> None:
        """Continue with the tests and the best policy of an interrupted training."""
        self.curve = list(checkpoint.curve)
        point = CurvePoint(checkpoint.steps, checkpoint.success_rate, checkpoint.length_ratio)
        self.best = (point, checkpoint.network, checkpoint.tested)

    def test(self, network: QNetwork, steps: int, *, counts: bool = True) -> bool:
        """Test a network and return whether it is good enough; ``counts``: whether it may be the one that is kept."""
        config = self.config
        limit = TEST_LIMIT if config.both_ways else config.limit
        starts, both_ways = config.test_starts, config.both_ways
        self.evaluation = evaluate(network, self.problems, starts=starts, limit=limit, both_ways=both_ways)
        point = CurvePoint(steps, self.evaluation.success_rate, self.evaluation.length_ratio)
        self.curve.append(point)
        if counts and (self.best is None or _rank(point) > _rank(self.best[0])):
            self.best = (point, network, self.evaluation.arrived.size)
        if self.progress is not None:
            self.progress(point)
        if self.checkpoint is not None and self.best is not None:
            self.checkpoint(self.policy)
        return config.is_passed_by(point.success_rate, point.length_ratio)

    def weights(self) -> NDArray[np.float64]:
        """Return (P,) how often to draw each problem, by its failures in the last test."""
        if self.evaluation is None:
            raise RuntimeError("no network was tested yet")
        tries = np.bincount(self.evaluation.problem)
        failed = np.bincount(self.evaluation.problem, weights=~self.evaluation.arrived) / tries
        return np.asarray(1.0 + (_HARD_PROBLEMS_FIRST - 1.0) * failed, np.float64)


def _rank(point: CurvePoint) -> tuple[float, float]:
    """Return the sort key of tested networks: higher success rate first, then shorter paths."""
    return (point.success_rate, -point.length_ratio)
