"""The loop guard: which free move to take, from the values of the policy and a small memory of visited cells.

Of the moves that are free, those to the reference cells visited least often so far come first; among these the
policy's value decides. So a move is never blocked, a lift never circles, and a policy that would dither at a wall is
pushed along it. A lift that is lost, because it has made many more moves than the way should take, is pushed away from
where it has been: each earlier visit near a move's end counts against it (:class:`Push`). It is no
search: it looks one move ahead and knows nothing but where the lift has been.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import leaf_kernel
from bimvox.env.actions import ACTION_COUNT, MOVES
from bimvox.env.state import NO_ACTION
from bimvox.site.clearance import Clearance, placement_is_free

VISIT_COST = 10.0
"""Against a move, per earlier visit of the cell that it leads to; values of actions differ by less than one."""


class Push(NamedTuple):
    """When a lift counts as lost, and how it is pushed away from where it has been.

    Attributes:
        factor: Lost after ``factor`` times the Manhattan distance of its way ...
        slack: ... plus ``slack`` moves.
        reach_vox: Visits up to so many cells away along every axis count.
        cost: Against a move, per such visit.
    """

    factor: float
    slack: int
    reach_vox: int
    cost: float


CALM = Push(2.0, 40, 2, 0.02)
RESTLESS = Push(1.0, 10, 6, 0.05)
"""For another try: it leaves early what the calm one does not get out of, and strays more on the way."""


@leaf_kernel
def is_lost(push: Push, steps: int, least_moves: int) -> bool:
    """Return whether a lift has made many more moves than the Manhattan distance of its way."""
    return bool(steps > push.factor * least_moves + push.slack)


@leaf_kernel
def guarded_action(
    clearance: Clearance, cells: NDArray[np.int32], steps: int, values: NDArray[np.float32], reach_vox: int, cost: float
) -> int:
    """Return the move that the guard lets a lift make, ``NO_ACTION`` where none is free.

    Args:
        clearance: What decides whether a placement is free.
        cells: (M, 3) int32 reference cells visited; step s is in row s % M, so the last M are remembered.
        steps: Moves made so far: the lift is at row ``steps % M``.
        values: (6,) float32 the policy's.
        reach_vox: Visits up to so far from a move's end count against it ...
        cost: ... each with so much; 0 for a lift that is not lost.
    """
    at = cells[steps % cells.shape[0]]
    best, best_score = NO_ACTION, 0.0
    for action in range(ACTION_COUNT):
        x, y, z = at[0] + MOVES[action, 0], at[1] + MOVES[action, 1], at[2] + MOVES[action, 2]
        if not placement_is_free(clearance, x, y, z):
            continue
        score = values[action] - VISIT_COST * visits_of(cells, steps, x, y, z)
        if cost > 0.0:
            score -= cost * _visits_near(cells, steps, x, y, z, reach_vox)
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
def _visits_near(cells: NDArray[np.int32], steps: int, x: int, y: int, z: int, reach: int) -> int:
    """Return how often cells within reach along every axis were visited."""
    visits = 0
    for n in range(min(steps + 1, cells.shape[0])):
        near_x, near_y = abs(cells[n, 0] - x) <= reach, abs(cells[n, 1] - y) <= reach
        if near_x and near_y and abs(cells[n, 2] - z) <= reach:
            visits += 1
    return visits
