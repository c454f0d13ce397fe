"""Roll-out of values under a loop guard, many lifts at once: a real-time search.

The guard (:mod:`bimvox.env.guard`): of the free moves, those to the reference cells visited least often come first;
among these the value decides: a policy's, or greedy ones (:class:`TowardsTarget`). Its only memory is the path. So a
move is never blocked, a lift never circles, and values that would dither at a wall are pushed along it. That is Node
Counting, a real-time search; it makes at most ``PLAN_LIMIT`` or ``ROLLOUT_LIMIT`` moves, and it returns to a cell only
by moving there. The detours of its path are cut by a breadth-first search over the visited cells.

In a plan, where search stands behind it, a lift has one calm try (:func:`proposer`). In a test and in the experiments
there are four guards (``GUARDS``); the last three prefer down, left and right. A lift tries them in turn, each from its
start and with its own memory, until three arrive, or one arrives by a path known to be shortest. The shortest path is
used. If none arrives, the same is tried from the target to the start, because moves can be reversed.

The path is then shortened over the visited cells and by straight free legs (:mod:`bimvox.planning.shorten_path`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.env.actions import ACTION_COUNT, MOVES
from bimvox.env.dynamics import NO_ACTION, LiftState, StepLimit, steps_allowed
from bimvox.env.guard import CALM, GUARDS, Guard, guarded_action, is_lost
from bimvox.env.observation import VIEW_SIZE, look
from bimvox.env.pool import ProblemPool, pool_of, pooled_clearance
from bimvox.env.problem import LiftProblem, lift_problem
from bimvox.planning.shorten_path import shortest_of_visited, straightened
from bimvox.planning.stage import Propose, ProposedGreedily, Transit
from bimvox.site.collision import CollisionSpace, placement_is_free
from bimvox.site.component import IntVec

Values = Callable[[NDArray[np.float32]], NDArray[np.float32]]
"""A policy: (N, VIEW_SIZE) float32 observations to (N, 6) float32 values of the actions, higher is better."""


SCALE = 0.25
"""Weighs greedy values against the costs and bonuses of a guard; the best of 0.25, 0.5 and 1 on check problems."""


class TowardsTarget:
    """Greedy values: a move is worth ``SCALE`` times the share of the way left along it. Nothing is observed."""


GREEDY = TowardsTarget()

ROLLOUT_LIMIT = StepLimit(factor=8.0, slack=1000)
"""Moves allowed per try, from the Manhattan distance."""

PLAN_LIMIT = StepLimit(factor=2.0, slack=40)
"""Moves allowed in a plan, where search stands behind the policy: near the distance, before a lift counts as lost."""

ARRIVALS = 3
"""Arrivals after which no other guard is tried."""

LIFTS_AT_ONCE = 32
"""Most lifts of different stages rolled out together; bounds the memory of their tables ..."""

TABLES_AT_ONCE_BYTES = 320_000_000
"""... and so does this on large sites."""


class Outcome(StrEnum):
    """How a roll-out ended."""

    ARRIVED = "arrived"
    STEP_LIMIT = "step limit reached"
    ENCLOSED = "no free move"
    START_NOT_FREE = "the start is not free"


@dataclass(frozen=True, slots=True, eq=False)
class Rollout:
    """The path by which a policy moved one lift.

    Attributes:
        path_vox: (N, 3) int32 reference cells from the start, one unit move between neighbours, no cell twice. Ends at
            the target if the outcome is ``ARRIVED``, otherwise where the policy stopped.
        outcome: How it ended.
        steps: Moves of the policy, including those cut out of the path.
    """

    path_vox: NDArray[np.int32]
    outcome: Outcome
    steps: int

    @property
    def arrived(self) -> bool:
        """Whether the target was reached."""
        return self.outcome is Outcome.ARRIVED


_RUNNING, _ARRIVED, _STEP_LIMIT, _ENCLOSED, _START_NOT_FREE = range(5)
_OUTCOMES = dict(enumerate(Outcome, _ARRIVED))


def roll_out(values: Values | TowardsTarget, problem: LiftProblem, *, limit: StepLimit = ROLLOUT_LIMIT) -> Rollout:
    """Roll a policy out on one lift; see :func:`roll_out_all`."""
    return roll_out_all(values, [problem], limit=limit)[0]


def lifts_at_once(grid_shape: IntVec) -> int:
    """Return how many lifts of different stages of a site are rolled out together."""
    x, y, z = grid_shape
    return max(1, min(LIFTS_AT_ONCE, TABLES_AT_ONCE_BYTES // (4 * (x + 1) * (y + 1) * (z + 1))))


def roll_out_all(
    values: Values | TowardsTarget,
    problems: Sequence[LiftProblem],
    *,
    limit: StepLimit = ROLLOUT_LIMIT,
    least_moves: Sequence[int | None] | None = None,
    from_target: bool = True,
) -> tuple[Rollout, ...]:
    """Roll a policy out on many lifts, each from its ``start_vox``.

    Args:
        values: The policy.
        problems: The lifts; their distance fields are not used.
        limit: Moves allowed per try, from each lift's Manhattan distance.
        least_moves: Per lift the fewest moves possible, if known: a path of that length needs no other try. Paths and
            outcomes are the same without it.
        from_target: Whether a lift that does not arrive is also tried from its target.

    Returns:
        One roll-out per problem, in their order; the same as for each problem alone, if ``values`` works row by row.
    """
    known = [None] * len(problems) if least_moves is None else least_moves
    least = [_manhattan(p) if moves is None else moves for p, moves in zip(problems, known, strict=True)]
    rollouts: list[Rollout] = []
    first = 0
    while first < len(problems):
        last = first + lifts_at_once(problems[first].grid_shape)
        rollouts += _tried(values, problems[first:last], least[first:last], limit, from_target)
        first = last
    return tuple(rollouts)


def _tried(
    values: Values | TowardsTarget,
    problems: Sequence[LiftProblem],
    least: Sequence[int],
    limit: StepLimit,
    from_target: bool,
) -> list[Rollout]:
    """Roll out under one guard after the other; if none arrives, from the other end."""
    best = _from_starts(values, problems, least, limit)
    lost = [n for n, rollout in enumerate(best) if rollout.outcome is Outcome.STEP_LIMIT]
    if from_target and lost:
        turned = [
            replace(problems[n], start_vox=problems[n].target_vox, target_vox=problems[n].start_vox) for n in lost
        ]
        for n, back in zip(lost, _from_starts(values, turned, [least[n] for n in lost], limit), strict=True):
            steps = best[n].steps + back.steps
            if back.arrived:
                best[n] = Rollout(np.ascontiguousarray(back.path_vox[::-1]), back.outcome, steps)
            else:
                best[n] = replace(best[n], steps=steps)
    return best


def _from_starts(
    values: Values | TowardsTarget, problems: Sequence[LiftProblem], least: Sequence[int], limit: StepLimit
) -> list[Rollout]:
    """Roll out from the starts, each lift under one guard after the other until it has arrived often enough."""
    best = list(_under_guard(values, problems, limit, GUARDS[0]))
    arrivals = [int(rollout.arrived) for rollout in best]
    for guard in GUARDS[1:]:
        again = [
            n
            for n, rollout in enumerate(best)
            if rollout.outcome is Outcome.STEP_LIMIT
            or (rollout.arrived and arrivals[n] < ARRIVALS and len(rollout.path_vox) - 1 > least[n])
        ]
        for n, other in zip(again, _under_guard(values, [problems[n] for n in again], limit, guard), strict=True):
            arrivals[n] += other.arrived
            shorter = len(other.path_vox) < len(best[n].path_vox)
            taken = other if other.arrived and (shorter or not best[n].arrived) else best[n]
            best[n] = Rollout(taken.path_vox, taken.outcome, best[n].steps + other.steps)
    return best


def _under_guard(
    values: Values | TowardsTarget, problems: Sequence[LiftProblem], limit: StepLimit, guard: Guard
) -> list[Rollout]:
    starts = np.array([problem.start_vox for problem in problems], np.int32).reshape(-1, 3)
    rollouts = roll_out_starts(values, problems, np.arange(len(problems)), starts, limit=limit, guard=guard)
    return [
        Rollout(straightened(problem.space, rollout.path_vox), rollout.outcome, rollout.steps)
        for problem, rollout in zip(problems, rollouts, strict=True)
    ]


def _manhattan(problem: LiftProblem) -> int:
    return int(np.abs(np.subtract(problem.start_vox, problem.target_vox)).sum())


def roll_out_starts(
    values: Values | TowardsTarget,
    problems: Sequence[LiftProblem],
    problem_index: NDArray[np.int64],
    starts_vox: NDArray[np.int32],
    *,
    limit: StepLimit = ROLLOUT_LIMIT,
    least_moves: NDArray[np.int64] | None = None,
    guard: Guard = CALM,
) -> tuple[Rollout, ...]:
    """Roll a policy out from many starts of a few problems, in lock-step.

    Args:
        values: The policy.
        problems: The lifts.
        problem_index: (L,) which problem each roll-out is on.
        starts_vox: (L, 3) int32 start of each roll-out.
        limit: Moves allowed, from ``least_moves``.
        least_moves: (L,) fewest moves of each; None for the Manhattan distances.
        guard: The loop guard.
    """
    lifts = len(problem_index)
    if lifts == 0:
        return ()
    pool = pool_of(problems, with_distances=False)
    index = np.asarray(problem_index, np.int64)
    manhattan = np.abs(pool.target[index] - starts_vox).sum(axis=1).astype(np.int64)
    least = manhattan if least_moves is None else least_moves
    allowed = np.array([steps_allowed(limit, int(moves)) for moves in least], np.int64)
    runs = _Runs(
        problem=index,
        manhattan=manhattan,
        allowed=allowed,
        paths=np.zeros((lifts, int(allowed.max()) + 1, 3), np.int32),
        steps=np.zeros(lifts, np.int64),
        last_action=np.full(lifts, NO_ACTION, np.int64),
        outcome=np.zeros(lifts, np.int64),
    )
    runs.paths[:, 0] = starts_vox
    _check_starts(pool, runs)
    if isinstance(values, TowardsTarget):
        _move_towards(pool, runs, guard)
    else:
        _move_by_observation(values, pool, runs, guard)
    return tuple(
        Rollout(shortest_of_visited(runs.paths[n, : steps + 1]), _OUTCOMES[int(runs.outcome[n])], int(steps))
        for n, steps in enumerate(runs.steps)
    )


def proposer(values: Values | TowardsTarget, *, limit: StepLimit = PLAN_LIMIT, every_guard: bool = False) -> Propose:
    """Return a policy as :func:`bimvox.planning.planner.plan_lifts` takes it: one calm try a transit, from its start.

    Args:
        values: The policy.
        limit: Moves allowed in the calm try, from the Manhattan distance.
        every_guard: Whether each transit is tried as in a test, under every guard and both ways. For a policy that was
            retrained on the lifts that are hard on this site.
    """
    ask = _RolledOut(values, limit, every_guard)
    return ProposedGreedily(ask) if isinstance(values, TowardsTarget) else ask


@dataclass(frozen=True, slots=True)
class _RolledOut:
    """Proposes paths by roll-out; see ``proposer``."""

    values: Values | TowardsTarget
    limit: StepLimit
    every_guard: bool

    def __call__(self, transit: Transit) -> NDArray[np.int32] | None:
        problem = lift_problem(transit.space, transit.start_vox, transit.goal_vox)
        if self.every_guard:
            rollout = roll_out(self.values, problem)
        else:
            rollout = _under_guard(self.values, [problem], self.limit, CALM)[0]
        return rollout.path_vox if rollout.arrived else None


class _Runs(NamedTuple):
    """L roll-outs in lock-step; the kernels change them in place.

    Attributes:
        problem: (L,) problem of each.
        manhattan: (L,) Manhattan distance from start to target.
        allowed: (L,) moves allowed.
        paths: (L, largest ``allowed`` + 1, 3) visited cells; valid up to ``steps``.
        steps: (L,) moves so far.
        last_action: (L,) the last move.
        outcome: (L,) ``_RUNNING`` or how it ended.
    """

    problem: NDArray[np.int64]
    manhattan: NDArray[np.int64]
    allowed: NDArray[np.int64]
    paths: NDArray[np.int32]
    steps: NDArray[np.int64]
    last_action: NDArray[np.int64]
    outcome: NDArray[np.int64]


@kernel
def _check_starts(pool: ProblemPool, runs: _Runs) -> None:
    """Set the outcome of roll-outs that end before their first move."""
    for n in range(runs.problem.size):
        x, y, z = runs.paths[n, 0]
        target = pool.target[runs.problem[n]]
        if not placement_is_free(pooled_clearance(pool, runs.problem[n]), x, y, z):
            runs.outcome[n] = _START_NOT_FREE
        elif x == target[0] and y == target[1] and z == target[2]:
            runs.outcome[n] = _ARRIVED


def _move_by_observation(values: Values, pool: ProblemPool, runs: _Runs, guard: Guard) -> None:
    """Move every running roll-out until it ends, by the loop guard's rule and a policy's values."""
    lifts = runs.problem.size
    observations = np.zeros((lifts, VIEW_SIZE), np.float32)
    running = np.flatnonzero(runs.outcome == _RUNNING)
    while running.size:
        _observe_running(pool, runs, running, observations)
        rows = observations if running.size == lifts else observations[running]
        _move_running(pool, runs, running, guard, values(rows))
        running = running[runs.outcome[running] == _RUNNING]


@kernel
def _observe_running(
    pool: ProblemPool, runs: _Runs, running: NDArray[np.int64], observations: NDArray[np.float32]
) -> None:
    """Write the observations of the running roll-outs, each into its row."""
    for n in running:
        p = runs.problem[n]
        at = runs.paths[n, runs.steps[n]]
        state = LiftState(int(at[0]), int(at[1]), int(at[2]), runs.last_action[n], runs.steps[n])
        look(pooled_clearance(pool, p), pool.target[p], state, runs.paths[n], observations[n], runs.steps[n] > 0)


@kernel
def _move_running(
    pool: ProblemPool, runs: _Runs, running: NDArray[np.int64], guard: Guard, values: NDArray[np.float32]
) -> None:
    """Move the running roll-outs by one cell, by the loop guard's rule."""
    for row in range(running.size):
        p = runs.problem[running[row]]
        _move(pooled_clearance(pool, p), pool.target[p], runs, running[row], guard, values[row])


@kernel
def _move_towards(pool: ProblemPool, runs: _Runs, guard: Guard) -> None:
    """Move every running roll-out until it ends, by the loop guard's rule and the values of :class:`TowardsTarget`."""
    values = np.empty(ACTION_COUNT, np.float32)
    for n in range(runs.problem.size):
        target = pool.target[runs.problem[n]]
        space = pooled_clearance(pool, runs.problem[n])
        while runs.outcome[n] == _RUNNING:
            at = runs.paths[n, runs.steps[n]]
            left = np.float32(abs(target[0] - at[0]) + abs(target[1] - at[1]) + abs(target[2] - at[2]))
            for action in range(ACTION_COUNT):
                values[action] = 0.0
                for axis in range(3):
                    values[action] += SCALE * MOVES[action, axis] * (target[axis] - at[axis]) / left
            _move(space, target, runs, n, guard, values)


@leaf_kernel
def _move(
    space: CollisionSpace, target: NDArray[np.int32], runs: _Runs, n: int, guard: Guard, values: NDArray[np.float32]
) -> None:
    """Move one running roll-out by one cell, by the loop guard's rule."""
    steps = runs.steps[n]
    path = runs.paths[n, : steps + 1]
    lost = is_lost(guard, steps, runs.manhattan[n])
    best = guarded_action(space, target, path, steps, values, guard, lost)
    if best == NO_ACTION:
        runs.outcome[n] = _ENCLOSED
        return
    runs.steps[n] = steps + 1
    runs.last_action[n] = best
    here = True
    for axis in range(3):
        runs.paths[n, steps + 1, axis] = path[steps, axis] + MOVES[best, axis]
        here = here and runs.paths[n, steps + 1, axis] == target[axis]
    if here:
        runs.outcome[n] = _ARRIVED
    elif steps + 1 >= runs.allowed[n]:
        runs.outcome[n] = _STEP_LIMIT
