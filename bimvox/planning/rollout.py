"""Rolling a policy out: greedy, under a loop guard, many lifts at once.

The guard: of the moves that are free, those to the reference cells visited least often so far come first; among these
the policy's value decides. The memory is the path itself, nothing else. So a move is never blocked, a lift never
circles, and a policy that would dither at a wall is pushed along it. It is no search: at most ``RolloutLimit`` moves,
no backtracking but by moving back.

A path that came through the same cell twice is cut: what lies between the visits is left out, nothing else is changed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.env.actions import ACTION_COUNT, MOVES
from bimvox.env.limits import StepLimit, steps_allowed
from bimvox.env.observation import OBSERVATION_SIZE, observe
from bimvox.env.pool import ProblemPool, pool_of, pooled_clearance
from bimvox.env.problem import LiftProblem, lift_problem
from bimvox.env.state import NO_ACTION, LiftState
from bimvox.site.clearance import Clearance, placement_is_free
from bimvox.site.component import IntVec

Values = Callable[[NDArray[np.float32]], NDArray[np.float32]]
"""A policy: (N, OBSERVATION_SIZE) float32 observations to (N, 6) float32 values of the actions, higher is better."""

ROLLOUT_LIMIT = StepLimit(factor=4.0, slack=50)
"""Moves allowed, from the Manhattan distance."""

LIFTS_AT_ONCE = 32
"""Lifts of different stages packed together: bounds the memory for their tables."""


class Outcome(StrEnum):
    """How a roll-out ended."""

    ARRIVED = "arrived"
    STEP_LIMIT = "step limit reached"
    ENCLOSED = "no free move"
    START_NOT_FREE = "the start is not free"


@dataclass(frozen=True, slots=True, eq=False)
class Rollout:
    """Where a policy took one lift.

    Attributes:
        path_vox: (N, 3) int32 reference cells from the start, one unit move between neighbours, no cell twice; it ends
            at the target where the outcome is ``ARRIVED``, else it is how far the policy came.
        outcome: How it ended.
        steps: Moves the policy made, those cut out of the path included.
    """

    path_vox: NDArray[np.int32]
    outcome: Outcome
    steps: int

    @property
    def arrived(self) -> bool:
        """Whether the target was reached."""
        return self.outcome is Outcome.ARRIVED


_RUNNING, _ARRIVED, _STEP_LIMIT, _ENCLOSED, _START_NOT_FREE = range(5)
_OUTCOMES = {
    _ARRIVED: Outcome.ARRIVED,
    _STEP_LIMIT: Outcome.STEP_LIMIT,
    _ENCLOSED: Outcome.ENCLOSED,
    _START_NOT_FREE: Outcome.START_NOT_FREE,
}


def roll_out(values: Values, problem: LiftProblem, *, limit: StepLimit = ROLLOUT_LIMIT) -> Rollout:
    """Roll a policy out on one lift; see :func:`roll_out_all`."""
    return roll_out_all(values, [problem], limit=limit)[0]


def roll_out_all(
    values: Values, problems: Sequence[LiftProblem], *, limit: StepLimit = ROLLOUT_LIMIT
) -> tuple[Rollout, ...]:
    """Roll a policy out on many lifts, each from its ``start_vox``.

    Args:
        values: The policy.
        problems: The lifts; their distance fields are neither needed nor looked at.
        limit: Moves allowed, from each lift's Manhattan distance.

    Returns:
        One roll-out per problem, in their order. Each is what it would be alone, if ``values`` is row by row.
    """
    rollouts: list[Rollout] = []
    for first in range(0, len(problems), LIFTS_AT_ONCE):
        part = problems[first : first + LIFTS_AT_ONCE]
        starts = np.array([problem.start_vox for problem in part], np.int32)
        rollouts += roll_out_starts(values, part, np.arange(len(part)), starts, limit=limit)
    return tuple(rollouts)


def roll_out_starts(
    values: Values,
    problems: Sequence[LiftProblem],
    problem_index: NDArray[np.int64],
    starts_vox: NDArray[np.int32],
    *,
    limit: StepLimit = ROLLOUT_LIMIT,
    least_moves: NDArray[np.int64] | None = None,
) -> tuple[Rollout, ...]:
    """Roll a policy out from many starts of a few problems, in lock-step.

    Args:
        values: The policy.
        problems: The lifts.
        problem_index: (L,) which problem each roll-out is on.
        starts_vox: (L, 3) int32 reference cell each begins at.
        limit: Moves allowed, from ``least_moves``.
        least_moves: (L,) fewest moves of each, where known; the Manhattan distance without.
    """
    lifts = len(problem_index)
    if lifts == 0:
        return ()
    pool = pool_of(problems, with_distances=False)
    index = np.asarray(problem_index, np.int64)
    least = np.abs(pool.target[index] - starts_vox).sum(axis=1) if least_moves is None else least_moves
    allowed = np.array([steps_allowed(limit, int(moves)) for moves in least], np.int64)
    paths = np.zeros((lifts, int(allowed.max()) + 1, 3), np.int32)
    paths[:, 0] = starts_vox
    steps = np.zeros(lifts, np.int64)
    last_action = np.full(lifts, NO_ACTION, np.int64)
    outcome = np.zeros(lifts, np.int64)
    _check_starts(pool, index, paths, outcome)
    observations = np.zeros((lifts, OBSERVATION_SIZE), np.float32)
    running = np.flatnonzero(outcome == _RUNNING)
    while running.size:
        rows = observations[: running.size]
        _observe_running(pool, index, running, paths, steps, last_action, rows)
        _move_running(pool, index, running, allowed, values(rows), paths, steps, last_action, outcome)
        running = running[outcome[running] == _RUNNING]
    return tuple(
        Rollout(without_loops(paths[n, : steps[n] + 1]), _OUTCOMES[int(outcome[n])], int(steps[n]))
        for n in range(lifts)
    )


def proposer(
    values: Values, *, limit: StepLimit = ROLLOUT_LIMIT
) -> Callable[[Clearance, IntVec, IntVec], NDArray[np.int32] | None]:
    """Return a policy in the form that :func:`bimvox.planning.planner.plan_lifts` takes.

    Args:
        values: The policy.
        limit: Moves allowed, from the Manhattan distance.

    Returns:
        From collision rule, start and goal to a path, or None where the policy did not arrive.
    """

    def propose(clearance: Clearance, start_vox: IntVec, goal_vox: IntVec) -> NDArray[np.int32] | None:
        rollout = roll_out(values, lift_problem(clearance, start_vox, goal_vox), limit=limit)
        return rollout.path_vox if rollout.arrived else None

    return propose


@kernel
def without_loops(path_vox: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return a path without what lies between the first and the last visit of any cell.

    Args:
        path_vox: (N, 3) int32.

    Returns:
        (M, 3) int32, M <= N, no cell twice, the same ends.
    """
    kept = np.empty_like(path_vox)
    count = 0
    n = 0
    while n < path_vox.shape[0]:
        last = n
        for later in range(path_vox.shape[0] - 1, n, -1):
            if (
                path_vox[later, 0] == path_vox[n, 0]
                and path_vox[later, 1] == path_vox[n, 1]
                and path_vox[later, 2] == path_vox[n, 2]
            ):
                last = later
                break
        kept[count] = path_vox[last]
        count += 1
        n = last + 1
    return kept[:count].copy()


@kernel
def _check_starts(
    pool: ProblemPool, index: NDArray[np.int64], paths: NDArray[np.int32], outcome: NDArray[np.int64]
) -> None:
    """Settle the roll-outs that are over before they begin."""
    for n in range(index.size):
        x, y, z = paths[n, 0]
        target = pool.target[index[n]]
        if not placement_is_free(pooled_clearance(pool, index[n]), x, y, z):
            outcome[n] = _START_NOT_FREE
        elif x == target[0] and y == target[1] and z == target[2]:
            outcome[n] = _ARRIVED


@kernel
def _observe_running(
    pool: ProblemPool,
    index: NDArray[np.int64],
    running: NDArray[np.int64],
    paths: NDArray[np.int32],
    steps: NDArray[np.int64],
    last_action: NDArray[np.int64],
    observations: NDArray[np.float32],
) -> None:
    """Write the observations of the lifts under way."""
    for row in range(running.size):
        n = running[row]
        p = index[n]
        at = paths[n, steps[n]]
        state = LiftState(int(at[0]), int(at[1]), int(at[2]), last_action[n], steps[n])
        observe(pooled_clearance(pool, p), pool.target[p], state, observations[row])


@kernel
def _move_running(
    pool: ProblemPool,
    index: NDArray[np.int64],
    running: NDArray[np.int64],
    allowed: NDArray[np.int64],
    values: NDArray[np.float32],
    paths: NDArray[np.int32],
    steps: NDArray[np.int64],
    last_action: NDArray[np.int64],
    outcome: NDArray[np.int64],
) -> None:
    """Move the lifts under way by one cell, by the loop guard's rule."""
    for row in range(running.size):
        n = running[row]
        p = index[n]
        clearance = pooled_clearance(pool, p)
        path = paths[n, : steps[n] + 1]
        at = path[steps[n]]
        best = NO_ACTION
        best_visits = 0
        for action in range(ACTION_COUNT):
            x, y, z = at[0] + MOVES[action, 0], at[1] + MOVES[action, 1], at[2] + MOVES[action, 2]
            if not placement_is_free(clearance, x, y, z):
                continue
            visits = _visits(path, x, y, z)
            if (
                best == NO_ACTION
                or visits < best_visits
                or (visits == best_visits and values[row, action] > values[row, best])
            ):
                best, best_visits = action, visits
        if best == NO_ACTION:
            outcome[n] = _ENCLOSED
            continue
        steps[n] += 1
        last_action[n] = best
        target = pool.target[p]
        here = True
        for axis in range(3):
            paths[n, steps[n], axis] = at[axis] + MOVES[best, axis]
            here = here and paths[n, steps[n], axis] == target[axis]
        if here:
            outcome[n] = _ARRIVED
        elif steps[n] >= allowed[n]:
            outcome[n] = _STEP_LIMIT


@leaf_kernel
def _visits(path: NDArray[np.int32], x: int, y: int, z: int) -> int:
    """Return how often a path came through a cell."""
    count = 0
    for n in range(path.shape[0]):
        if path[n, 0] == x and path[n, 1] == y and path[n, 2] == z:
            count += 1
    return count
