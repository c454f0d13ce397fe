"""The loop guard: which free move to take, from the values of the policy and a small memory of visited cells.

Of the free moves, the guard prefers those to the reference cells visited least often; among these the policy's value
decides. So a move is never blocked, a lift does not circle, and a policy that hesitates at a wall is pushed along it. A
lift is lost if it has made many more moves than its path should take. It is then pushed away from visited cells: each
earlier visit near the end of a move counts against that move. A guard may prefer one side: if the policy rates two
paths around an obstacle about equally, the lift takes that side. The guard looks one move ahead and remembers only
visited cells (:class:`Guard`).

To go where one was least often is Node Counting, a real-time search (S. Koenig and B. Szymanski, Value-update rules for
real-time search, AAAI 1999); the values break its ties.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import leaf_kernel
from bimvox.env.actions import ACTION_COUNT, MOVES
from bimvox.env.dynamics import NO_ACTION
from bimvox.site.collision import CollisionSpace, placement_is_free

_VISIT_COST = 10.0
"""Against a move, per earlier visit of the cell that it leads to; values of actions differ by less than one."""

_Counts = tuple[int, int, int, int, int, int]


class Guard(NamedTuple):
    """When a lift counts as lost, how it is pushed away from visited cells, and which side it prefers.

    Attributes:
        factor: A lift is lost after ``factor`` times the Manhattan distance of its path ...
        slack: ... plus ``slack`` moves.
        reach_vox: Of a lost lift, visits up to this many cells from the end of a move, along every axis, count ...
        cost: ... against the move, each with this cost.
        visit_cost: Of a lost lift, cost of a visit of the cell itself, instead of ``_VISIT_COST``.
        left: Bonus of a move to the left of the direction to the target, seen from above; negative: to the right.
        up: Bonus of a move up; negative: down.
    """

    factor: float
    slack: int
    reach_vox: int
    cost: float
    visit_cost: float = _VISIT_COST
    left: float = 0.0
    up: float = 0.0


CALM = Guard(2.0, 40, 2, 0.02)
_LEANING = Guard(1.0, 20, 4, 0.02, 0.3)
LOW = _LEANING._replace(up=-0.2)
LEFT = _LEANING._replace(left=0.2)
RIGHT = _LEANING._replace(left=-0.2)

GUARDS = (CALM, LOW, LEFT, RIGHT)
"""In the order in which a roll-out tries them. The first is the best alone; they fail on different lifts."""


@leaf_kernel
def is_lost(guard: Guard, steps: int, least_moves: int) -> bool:
    """Return whether a lift has made many more moves than the Manhattan distance of its path."""
    return bool(steps > guard.factor * least_moves + guard.slack)


@leaf_kernel
def guarded_action(
    space: CollisionSpace,
    target: NDArray[np.int32],
    cells: NDArray[np.int32],
    steps: int,
    values: NDArray[np.float32],
    guard: Guard,
    lost: bool,
) -> int:
    """Return the move that the guard chooses for a lift; ``NO_ACTION`` if none is free.

    Args:
        space: Decides whether a placement is free.
        target: (3,) int32 reference cell of the target.
        cells: (M, 3) int32 reference cells visited; step s is in row s % M, so the last M are remembered.
        steps: Moves made so far: the lift is at row ``steps % M``.
        values: (6,) float32 the policy's.
        guard: Its choices.
        lost: Whether the lift is lost (:func:`is_lost`).
    """
    at = cells[steps % cells.shape[0]]
    dx, dy = target[0] - at[0], target[1] - at[1]
    away = max(1.0, np.sqrt(float(dx * dx + dy * dy)))
    visits = visits_around(cells, steps, at[0], at[1], at[2])
    near = _visits_near(cells, steps, at[0], at[1], at[2], guard.reach_vox if lost else -2)
    visit_cost = guard.visit_cost if lost else _VISIT_COST
    best, best_score = NO_ACTION, 0.0
    for action in range(ACTION_COUNT):
        u, v, w = MOVES[action, 0], MOVES[action, 1], MOVES[action, 2]
        if not placement_is_free(space, at[0] + u, at[1] + v, at[2] + w):
            continue
        score = values[action] - visit_cost * visits[action] - guard.cost * near[action]
        score += guard.left * (dx * v - dy * u) / away + guard.up * w
        if best == NO_ACTION or score > best_score:
            best, best_score = action, score
    return best


@leaf_kernel
def visits_around(cells: NDArray[np.int32], steps: int, x: int, y: int, z: int) -> _Counts:
    """Return how often the cell that each action leads to was visited, as far as ``cells`` remembers."""
    return _visits_near(cells, steps, x, y, z, 0)


@leaf_kernel
def _visits_near(cells: NDArray[np.int32], steps: int, x: int, y: int, z: int, reach: int) -> _Counts:
    """Return how often cells within reach of each action's end along every axis were visited."""
    north, south, west, east, up, down = 0, 0, 0, 0, 0, 0
    for n in range(min(steps + 1, cells.shape[0]) if reach >= 0 else 0):
        dx, dy, dz = cells[n, 0] - x, cells[n, 1] - y, cells[n, 2] - z
        i, j, k = abs(dx) <= reach, abs(dy) <= reach, abs(dz) <= reach
        north += i and k and abs(dy - 1) <= reach
        south += i and k and abs(dy + 1) <= reach
        west += j and k and abs(dx + 1) <= reach
        east += j and k and abs(dx - 1) <= reach
        up += i and j and abs(dz - 1) <= reach
        down += i and j and abs(dz + 1) <= reach
    return north, south, west, east, up, down
