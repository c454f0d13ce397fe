"""Rolling a policy out: greedy, under a loop guard, many lifts at once.

The guard (:mod:`bimvox.env.guard`): of the moves that are free, those to the reference cells visited least often so far
come first; among these the policy's value decides. The memory is the path itself, nothing else. So a move is never
blocked, a lift never circles, and a policy that would dither at a wall is pushed along it. It is no search: at most
``ROLLOUT_LIMIT`` moves a try, no backtracking but by moving back.

There are four guards (``GUARDS``), the last three leaning down, to the left and to the right. A lift tries them in
turn, each from its start and with a memory of its own, until three have arrived, or one by a way that is surely as
short as any; the shortest way is taken. Where none arrives, the same from the target to the start: moves can be
reversed.

A way over visited cells is cut as short as these allow, and what three straight free legs shorten is replaced by them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.env.actions import MOVES
from bimvox.env.guard import CALM, GUARDS, Guard, guarded_action, is_lost
from bimvox.env.limits import StepLimit, steps_allowed
from bimvox.env.observation import VIEW_SIZE, look
from bimvox.env.pool import ProblemPool, pool_of, pooled_clearance
from bimvox.env.problem import LiftProblem, lift_problem
from bimvox.env.state import NO_ACTION, LiftState
from bimvox.planning.propose import Propose, Transit
from bimvox.site.collision import CollisionSpace, placement_is_free
from bimvox.site.component import IntVec

Values = Callable[[NDArray[np.float32]], NDArray[np.float32]]
"""A policy: (N, VIEW_SIZE) float32 observations to (N, 6) float32 values of the actions, higher is better."""

ROLLOUT_LIMIT = StepLimit(factor=8.0, slack=1000)
"""Moves allowed each try, from the Manhattan distance."""

ARRIVALS = 3
"""Tries that arrive before no other is made."""

LIFTS_AT_ONCE = 32
"""Lifts of different stages packed together: bounds the memory for their tables ..."""

TABLES_AT_ONCE_BYTES = 320_000_000
"""... as this does on large sites."""


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


def lifts_at_once(grid_shape: IntVec) -> int:
    """Return how many lifts of different stages of a site are rolled out together."""
    x, y, z = grid_shape
    return max(1, min(LIFTS_AT_ONCE, TABLES_AT_ONCE_BYTES // (4 * (x + 1) * (y + 1) * (z + 1))))


def roll_out_all(
    values: Values,
    problems: Sequence[LiftProblem],
    *,
    limit: StepLimit = ROLLOUT_LIMIT,
    least_moves: Sequence[int | None] | None = None,
    from_target: bool = True,
) -> tuple[Rollout, ...]:
    """Roll a policy out on many lifts, each from its ``start_vox``.

    Args:
        values: The policy.
        problems: The lifts; their distance fields are neither needed nor looked at.
        limit: Moves allowed each try, from each lift's Manhattan distance.
        least_moves: Per lift the fewest moves possible, where known: a way as short needs no other try, which could not
            shorten it. Paths and outcomes are the same without it.
        from_target: Whether a lift that does not arrive is tried from its target too; without, it is one way.

    Returns:
        One roll-out per problem, in their order. Each is what it would be alone, if ``values`` is row by row.
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
    values: Values, problems: Sequence[LiftProblem], least: Sequence[int], limit: StepLimit, from_target: bool
) -> list[Rollout]:
    """Roll out under one guard after the other; where none arrives, from the other end."""
    best = _one_way(values, problems, least, limit)
    lost = [n for n, rollout in enumerate(best) if rollout.outcome is Outcome.STEP_LIMIT]
    if from_target and lost:
        turned = [
            replace(problems[n], start_vox=problems[n].target_vox, target_vox=problems[n].start_vox) for n in lost
        ]
        for n, back in zip(lost, _one_way(values, turned, [least[n] for n in lost], limit), strict=True):
            steps = best[n].steps + back.steps
            if back.arrived:
                best[n] = Rollout(np.ascontiguousarray(back.path_vox[::-1]), back.outcome, steps)
            else:
                best[n] = replace(best[n], steps=steps)
    return best


def _one_way(values: Values, problems: Sequence[LiftProblem], least: Sequence[int], limit: StepLimit) -> list[Rollout]:
    """Roll out from the starts, each lift under one guard after the other until it has arrived often enough."""
    best = list(_forth(values, problems, limit, GUARDS[0]))
    arrivals = [int(rollout.arrived) for rollout in best]
    for guard in GUARDS[1:]:
        again = [
            n
            for n, rollout in enumerate(best)
            if rollout.outcome is Outcome.STEP_LIMIT
            or (rollout.arrived and arrivals[n] < ARRIVALS and len(rollout.path_vox) - 1 > least[n])
        ]
        for n, other in zip(again, _forth(values, [problems[n] for n in again], limit, guard), strict=True):
            arrivals[n] += other.arrived
            shorter = len(other.path_vox) < len(best[n].path_vox)
            taken = other if other.arrived and (shorter or not best[n].arrived) else best[n]
            best[n] = Rollout(taken.path_vox, taken.outcome, best[n].steps + other.steps)
    return best


def _forth(values: Values, problems: Sequence[LiftProblem], limit: StepLimit, guard: Guard) -> list[Rollout]:
    starts = np.array([problem.start_vox for problem in problems], np.int32).reshape(-1, 3)
    rollouts = roll_out_starts(values, problems, np.arange(len(problems)), starts, limit=limit, guard=guard)
    return [
        Rollout(straightened(problem.space, rollout.path_vox), rollout.outcome, rollout.steps)
        for problem, rollout in zip(problems, rollouts, strict=True)
    ]


def _manhattan(problem: LiftProblem) -> int:
    return int(np.abs(np.subtract(problem.start_vox, problem.target_vox)).sum())


def roll_out_starts(
    values: Values,
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
        starts_vox: (L, 3) int32 reference cell each begins at.
        limit: Moves allowed, from ``least_moves``.
        least_moves: (L,) fewest moves of each, where known; the Manhattan distance without.
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
    paths = np.zeros((lifts, int(allowed.max()) + 1, 3), np.int32)
    paths[:, 0] = starts_vox
    steps = np.zeros(lifts, np.int64)
    last_action = np.full(lifts, NO_ACTION, np.int64)
    outcome = np.zeros(lifts, np.int64)
    _check_starts(pool, index, paths, outcome)
    observations = np.zeros((lifts, VIEW_SIZE), np.float32)
    running = np.flatnonzero(outcome == _RUNNING)
    while running.size:
        rows = observations[: running.size]
        _observe_running(pool, index, running, paths, steps, last_action, rows)
        _move_running(pool, index, running, manhattan, allowed, guard, values(rows), paths, steps, last_action, outcome)
        running = running[outcome[running] == _RUNNING]
    return tuple(
        Rollout(shortest_of_visited(paths[n, : steps[n] + 1]), _OUTCOMES[int(outcome[n])], int(steps[n]))
        for n in range(lifts)
    )


def proposer(values: Values, *, limit: StepLimit = ROLLOUT_LIMIT) -> Propose:
    """Return a policy in the form that :func:`bimvox.planning.planner.plan_lifts` takes.

    Args:
        values: The policy.
        limit: Moves allowed, from the Manhattan distance.

    Returns:
        From ways to be found to their paths, None where the policy did not arrive.
    """

    def propose(transits: Sequence[Transit]) -> list[NDArray[np.int32] | None]:
        problems = [lift_problem(transit.space, transit.start_vox, transit.goal_vox) for transit in transits]
        least = [transit.least_moves for transit in transits]
        rollouts = roll_out_all(values, problems, limit=limit, least_moves=least)
        return [rollout.path_vox if rollout.arrived else None for rollout in rollouts]

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
def shortest_of_visited(path_vox: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return a shortest way from a path's first to its last cell over the cells that it visited, and no other.

    Args:
        path_vox: (N, 3) int32, unit moves.

    Returns:
        (M, 3) int32, M <= N, unit moves, the same ends; the path itself where none of it can be left out.
    """
    count = path_vox.shape[0]
    low = path_vox[0].copy()
    high = path_vox[0].copy()
    for n in range(count):
        for axis in range(3):
            low[axis] = min(low[axis], path_vox[n, axis])
            high[axis] = max(high[axis], path_vox[n, axis])
    ny, nz = np.int64(high[1] - low[1] + 3), np.int64(high[2] - low[2] + 3)
    keys = np.empty(count, np.int64)
    for n in range(count):
        keys[n] = ((path_vox[n, 0] - low[0] + 1) * ny + path_vox[n, 1] - low[1] + 1) * nz + path_vox[n, 2] - low[2] + 1
    visited = np.unique(keys)
    before = np.full(visited.size, -1, np.int64)
    queue = np.empty(visited.size, np.int64)
    goal = np.searchsorted(visited, keys[count - 1])
    queue[0] = goal
    before[goal] = goal
    first, size = 0, 1
    start = np.searchsorted(visited, keys[0])
    while first < size and before[start] < 0:
        here = queue[first]
        first += 1
        for move in (-ny * nz, ny * nz, -nz, nz, np.int64(-1), np.int64(1)):
            there = np.searchsorted(visited, visited[here] + move)
            if there < visited.size and visited[there] == visited[here] + move and before[there] < 0:
                before[there] = here
                queue[size] = there
                size += 1
    kept = np.empty((count, 3), np.int32)
    at, length = start, 0
    while True:
        key = visited[at]
        kept[length, 0] = key // (ny * nz) - 1 + low[0]
        kept[length, 1] = key // nz % ny - 1 + low[1]
        kept[length, 2] = key % nz - 1 + low[2]
        length += 1
        if at == goal:
            break
        at = before[at]
    return kept[:length].copy()


@kernel
def straightened(space: CollisionSpace, path_vox: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return a path with its detours cut: from each cell straight on to the farthest that three legs reach.

    A cut runs along each axis once, in one of the six orders, over free placements; so it is as short as any way
    between its ends. It is taken where it is shorter than the path. Repeated until nothing is cut.

    Args:
        space: What decides whether a placement is free.
        path_vox: (N, 3) int32, unit moves over free placements.

    Returns:
        (M, 3) int32, M <= N, unit moves over free placements, the same ends.
    """
    path = path_vox.copy()
    legs = np.empty((path.shape[0] + 1, 3), np.int32)
    changed = True
    while changed:
        changed = False
        kept = np.empty_like(path)
        kept[0] = path[0]
        count = 1
        n = 0
        while n < path.shape[0] - 1:
            far = n + 1
            for m in range(path.shape[0] - 1, n + 1, -1):
                away = 0
                for axis in range(3):
                    away += abs(path[m, axis] - path[n, axis])
                if away < m - n and _three_legs(space, path[n], path[m], legs):
                    kept[count : count + away] = legs[:away]
                    count += away
                    far = m
                    changed = True
                    break
            if far == n + 1:
                kept[count] = path[far]
                count += 1
            n = far
        path = kept[:count].copy()
    return path


@leaf_kernel
def _three_legs(
    space: CollisionSpace, start: NDArray[np.int32], goal: NDArray[np.int32], out: NDArray[np.int32]
) -> bool:
    """Write the cells after ``start`` of a way that runs along each axis once, if one is free."""
    for first, second, third in ((2, 0, 1), (2, 1, 0), (0, 1, 2), (1, 0, 2), (0, 2, 1), (1, 2, 0)):
        x, y, z = start[0], start[1], start[2]
        count = 0
        free = True
        for axis in (first, second, third):
            way = goal[axis] - start[axis]
            step = 1 if way > 0 else -1
            for _ in range(abs(way)):
                if axis == 0:
                    x += step
                elif axis == 1:
                    y += step
                else:
                    z += step
                if not placement_is_free(space, x, y, z):
                    free = False
                    break
                out[count, 0], out[count, 1], out[count, 2] = x, y, z
                count += 1
            if not free:
                break
        if free:
            return True
    return False


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
        look(pooled_clearance(pool, p), pool.target[p], state, paths[n], observations[row])


@kernel
def _move_running(
    pool: ProblemPool,
    index: NDArray[np.int64],
    running: NDArray[np.int64],
    least: NDArray[np.int64],
    allowed: NDArray[np.int64],
    guard: Guard,
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
        space = pooled_clearance(pool, p)
        path = paths[n, : steps[n] + 1]
        at = path[steps[n]]
        lost = is_lost(guard, steps[n], least[n])
        best = guarded_action(space, pool.target[p], path, steps[n], values[row], guard, lost)
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
