"""The loop guard: which free move to take, from the values of the policy and a small memory of visited cells.

Of the moves that are free, those to the reference cells visited least often so far come first; among these the
policy's value decides. So a move is never blocked, a lift never circles, and a policy that would dither at a wall is
pushed along it. A lift that is lost, because it has made many more moves than the way should take, is pushed away from
where it has been: each earlier visit near a move's end counts against it. A guard may lean to one side: where the
policy sees little between two ways around something, it takes that side. It is no search: it looks one move ahead and
knows nothing but where the lift has been (:class:`Guard`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import leaf_kernel
from bimvox.env.actions import ACTION_COUNT, MOVES
from bimvox.env.state import NO_ACTION
from bimvox.site.collision import CollisionSpace, placement_is_free

VISIT_COST = 10.0
"""Against a move, per earlier visit of the cell that it leads to; values of actions differ by less than one."""

Counts = tuple[int, int, int, int, int, int]


class Guard(NamedTuple):
    """When a lift counts as lost, how it is pushed away from where it has been, and which way it leans.

    Attributes:
        factor: Lost after ``factor`` times the Manhattan distance of its way ...
        slack: ... plus ``slack`` moves.
        reach_vox: Then visits up to so many cells away from a move's end along every axis count ...
        cost: ... against the move, each with so much ...
        visit_cost: ... and each visit of the very cell with so much, instead of ``VISIT_COST``.
        left: For a move to the left of the way to the target, seen from above; less than 0: to the right.
        up: For a move up; less than 0: down.
    """

    factor: float
    slack: int
    reach_vox: int
    cost: float
    visit_cost: float = VISIT_COST
    left: float = 0.0
    up: float = 0.0


CALM = Guard(2.0, 40, 2, 0.02)
_LEANING = Guard(1.0, 20, 4, 0.02, 0.3)
LOW = _LEANING._replace(up=-0.2)
LEFT = _LEANING._replace(left=0.2)
RIGHT = _LEANING._replace(left=-0.2)

GUARDS = (CALM, LOW, LEFT, RIGHT)
"""In the order in which a roll-out tries them: alone the first is the best, but they fail on different lifts."""


@leaf_kernel
def is_lost(guard: Guard, steps: int, least_moves: int) -> bool:
    """Return whether a lift has made many more moves than the Manhattan distance of its way."""
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
    """Return the move that the guard lets a lift make, ``NO_ACTION`` where none is free.

    Args:
        space: What decides whether a placement is free.
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
    visit_cost = guard.visit_cost if lost else VISIT_COST
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
def visits_around(cells: NDArray[np.int32], steps: int, x: int, y: int, z: int) -> Counts:
    """Return how often the cell that each action leads to was visited, as far as ``cells`` remembers."""
    return _visits_near(cells, steps, x, y, z, 0)


@leaf_kernel
def _visits_near(cells: NDArray[np.int32], steps: int, x: int, y: int, z: int, reach: int) -> Counts:
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
