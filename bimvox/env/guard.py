"""The loop guard: which free move to take, from the values of the policy and a small memory of visited cells.

Of the moves that are free, those to the reference cells visited least often so far come first; among these the
policy's value decides. So a move is never blocked, a lift never circles, and a policy that would dither at a wall is
pushed along it. A lift that is lost, because it has made many more moves than the way should take, is pushed away from
where it has been: each earlier visit within two cells of a move's end counts against it (``CROWD_COST``). It is no
search: it looks one move ahead and knows nothing but where the lift has been.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import leaf_kernel
from bimvox.env.actions import ACTION_COUNT, MOVES
from bimvox.env.state import NO_ACTION
from bimvox.site.clearance import Clearance, placement_is_free

VISIT_COST = 10.0
"""Against a move, per earlier visit of the cell that it leads to; values of actions differ by less than one."""

CROWD_COST = 0.02
"""Against a move of a lost lift, per earlier visit within ``CROWD_REACH`` of the cell that it leads to."""

CROWD_REACH = 2


@leaf_kernel
def is_lost(steps: int, least_moves: int) -> bool:
    """Return whether a lift has made many more moves than the Manhattan distance of its way."""
    return bool(steps > 2 * least_moves + 40)


@leaf_kernel
def guarded_action(
    clearance: Clearance, cells: NDArray[np.int32], steps: int, values: NDArray[np.float32], lost: bool
) -> int:
    """Return the move that the guard lets a lift make, ``NO_ACTION`` where none is free.

    Args:
        clearance: What decides whether a placement is free.
        cells: (M, 3) int32 reference cells visited; step s is in row s % M, so the last M are remembered.
        steps: Moves made so far: the lift is at row ``steps % M``.
        values: (6,) float32 the policy's.
        lost: Whether it is to be pushed away from where it has been.
    """
    at = cells[steps % cells.shape[0]]
    best, best_score = NO_ACTION, 0.0
    for action in range(ACTION_COUNT):
        x, y, z = at[0] + MOVES[action, 0], at[1] + MOVES[action, 1], at[2] + MOVES[action, 2]
        if not placement_is_free(clearance, x, y, z):
            continue
        score = values[action] - VISIT_COST * visits_of(cells, steps, x, y, z)
        if lost:
            score -= CROWD_COST * _visits_near(cells, steps, x, y, z)
        if best == NO_ACTION or score > best_score:
            best, best_score = action, score
    return best


@leaf_kernel
def visits_of(cells: NDArray[np.int32], steps: int, x: int, y: int, z: int) -> int:
    """Return how often a cell was visited, as far as ``cells`` remembers (see :func:`guarded_action`)."""
    visits = 0
    for n in range(min(steps + 1, cells.shape[0])):
        if cells[n, 0] == x and cells[n, 1] == y and cells[n, 2] == z:
            visits += 1
    return visits


@leaf_kernel
def _visits_near(cells: NDArray[np.int32], steps: int, x: int, y: int, z: int) -> int:
    """Return how often cells within ``CROWD_REACH`` along every axis were visited."""
    visits = 0
    for n in range(min(steps + 1, cells.shape[0])):
        near_x, near_y = abs(cells[n, 0] - x) <= CROWD_REACH, abs(cells[n, 1] - y) <= CROWD_REACH
        if near_x and near_y and abs(cells[n, 2] - z) <= CROWD_REACH:
            visits += 1
    return visits
