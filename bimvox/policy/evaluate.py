"""The success of a policy on known problems: greedy roll-outs with the planner's loop guard."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bimvox.env.dynamics import StepLimit
from bimvox.env.problem import LiftProblem
from bimvox.planning.rollout import LIFTS_AT_ONCE, ROLLOUT_LIMIT, Values, roll_out_all, roll_out_starts

TEST_LIMIT = StepLimit(8.0, 200)
"""Limit of each try in a test; tighter than a plan's, because lifts that fail take most of a test's time."""


GOOD_ENOUGH = 1.05
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
            enough = np.floor(GOOD_ENOUGH * shortest[rows]).astype(int).tolist()
            rollouts = roll_out_all(values, lifts, limit=limit, least_moves=enough)
        else:
            rollouts = roll_out_starts(
                values, part, index[rows] - first, cells[rows], limit=limit, least_moves=shortest[rows]
            )
        for row, rollout in zip(rows, rollouts, strict=True):
            arrived[row] = rollout.arrived
            moves[row] = len(rollout.path_vox) - 1
    return Evaluation(index, arrived, moves, shortest.astype(np.int64))
