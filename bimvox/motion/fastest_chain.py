"""The fastest chain of joint lines between poses in order, of which some may be left out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import inline_kernel, kernel
from bimvox.crane.axis_numbers import AxisNumbers
from bimvox.crane.bound import least_time_s
from bimvox.motion.load_frame import LoadFrame
from bimvox.motion.move import line_time_s
from bimvox.motion.swept import line_is_free
from bimvox.site.collision import CollisionSpace


@kernel
def fastest_chain(
    space: CollisionSpace,
    load: LoadFrame,
    axes: NDArray[np.float64],
    limits: AxisNumbers,
    own_s: NDArray[np.float64],
) -> NDArray[np.int64]:
    """Return (N,) int64 the corner before each on the fastest chain to it; of corners that it leaves out, anything.

    Args:
        space: The collision rule.
        load: How hook poses and reference cells correspond.
        axes: (N, 3) slew, radius and height of the corners.
        limits: The crane's.
        own_s: (N,) time of the path's own run to the next corner if the joint line there is not free, else 0.
    """
    goal = axes.shape[0] - 1
    left_s = np.empty(goal + 1)
    for n in range(goal + 1):
        left_s[n] = _least_s(limits, axes[n], axes[goal])
    # By corner, then by the corner before: when it is reached; infinite if unknown, or not free.
    reached_s = np.full((goal + 1, goal + 1), np.inf)
    before = np.full(goal + 1, -1)
    done = np.zeros(goal + 1, np.bool_)
    node, cost_s = 0, 0.0
    done[0] = True
    while node < goal:
        for later in range(node + 1, goal + 1):
            if done[later]:
                continue
            if later == node + 1 and own_s[node] > 0.0:
                reached_s[later, node] = cost_s + own_s[node]
            else:
                reached_s[later, node] = cost_s + line_time_s(limits, axes[node], axes[later])
            if before[later] < 0 or reached_s[later, node] < reached_s[later, before[later]]:
                before[later] = node
        while True:
            node = _most_promising(reached_s, before, done, left_s)
            # Runs between neighbouring corners are free.
            if node == before[node] + 1 or line_is_free(space, load, axes[before[node]], axes[node], False):
                break
            reached_s[node, before[node]] = np.inf
            before[node] = np.argmin(reached_s[node])
            if reached_s[node, before[node]] == np.inf:
                before[node] = -1
        done[node] = True
        cost_s = reached_s[node, before[node]]
    return before


def kept_by(before: NDArray[np.int64]) -> list[int]:
    """Return the corners that the fastest chain keeps, in order, of what :func:`fastest_chain` returns."""
    kept = [len(before) - 1]
    while kept[-1] > 0:
        kept.append(int(before[kept[-1]]))
    return kept[::-1]


@inline_kernel
def _most_promising(
    reached_s: NDArray[np.float64], before: NDArray[np.int64], done: NDArray[np.bool_], left_s: NDArray[np.float64]
) -> int:
    """Return the corner over which the goal may be reached soonest."""
    best, best_s, best_reached_s = -1, np.inf, np.inf
    for n in range(before.shape[0]):
        if done[n] or before[n] < 0:
            continue
        at_s = reached_s[n, before[n]]
        if at_s + left_s[n] < best_s or (at_s + left_s[n] == best_s and at_s < best_reached_s):
            best, best_s, best_reached_s = n, at_s + left_s[n], at_s
    return best


@inline_kernel
def _least_s(limits: AxisNumbers, start: NDArray[np.float64], end: NDArray[np.float64]) -> float:
    """Return a lower bound of the time between two poses ((3,) axes) from rest to rest: each axis on its own."""
    longest_s = 0.0
    for axis, (rate, acceleration, jerk) in enumerate((limits.slewing, limits.trolley, limits.hoist)):
        longest_s = max(longest_s, least_time_s(abs(end[axis] - start[axis]), rate, acceleration, jerk))
    return longest_s
