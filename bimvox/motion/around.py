"""The hook's way around obstacles at one height (A* over turns), and the fastest chain of joint lines.

Poses are a lattice over slewing angle and radius, in which both ends lie. A run of steps along one axis costs its time
at full rate and one run-up, so that few long runs are found rather than many short ones.
"""

from __future__ import annotations

import heapq
from itertools import pairwise
from math import ceil, pi
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import inline_kernel, kernel
from bimvox.crane.kinematics import AxisNumbers, axis_numbers
from bimvox.crane.tower_crane import AxisLimits, CranePose, TowerCrane, radius_limits
from bimvox.crane.travel import least_time_s, rest_to_rest_s
from bimvox.motion.move import Move, line_time_s, move_time_s, share_limits
from bimvox.motion.swept import LoadFrame, line_is_free
from bimvox.motion.swing import RiggedCrane
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


_FAR_S = 1e4
"""A travel of this time at full rate reaches the rate."""
_STEP_VOX = 2
"""Cells from ring to ring of the lattice, and along its outermost ring."""
_MOST_RINGS = 80
"""With more rings, a search that finds nothing takes too long: they are further apart on a fine grid."""


class _Around(NamedTuple):
    """A way at one height, from start to end; the joint lines between neighbouring poses are free.

    Attributes:
        by_turns: Slewing and trolleying by turns: where there is room, they overlap.
        cut_short: The fastest chain of joint lines, with a rest at each pose.
        time_s: Time of the latter.
    """

    by_turns: tuple[CranePose, ...]
    cut_short: tuple[CranePose, ...]
    time_s: float


class _Lattice(NamedTuple):
    """The poses over which the way is searched, as kernels take them.

    Attributes:
        slews_rad: (S,) ascending, from a full turn before the start to a full turn after it.
        radii_m: (R,) ascending.
        height_m: Of the hook.
        turn_s: Time per radian at full rate.
        ring_s: (R - 1,) time from ring to ring at full rate.
        run_up_s: How much longer slewing and trolleying take from rest to rest.
    """

    slews_rad: NDArray[np.float64]
    radii_m: NDArray[np.float64]
    height_m: float
    turn_s: float
    ring_s: NDArray[np.float64]
    run_up_s: tuple[float, float]


def around(
    rigged: RiggedCrane, space: CollisionSpace, start: CranePose, end: CranePose, limit_s: float = np.inf
) -> _Around | None:
    """Return a quick way between two poses at the same height; None if there is none below a time.

    Args:
        rigged: The crane with its load.
        space: The collision rule.
        start: The first pose.
        end: The last one; it may be reached by a turn either way.
        limit_s: A way that takes longer is not looked for.
    """
    crane, load = rigged.crane, rigged.load
    turns = [end.slew_rad + turn for turn in (-2.0 * pi, 0.0, 2.0 * pi)]
    goals = [slew for slew in turns if abs(slew - start.slew_rad) < 2.0 * pi]
    lattice = _lattice(crane, load.voxel_size_m * _STEP_VOX, start, (end.radius_m, goals))
    places = [_place(lattice, slew, end.radius_m) for slew in goals]
    axes = _by_turns(
        space, load, lattice, _place(lattice, start.slew_rad, start.radius_m), np.array(places), float(limit_s)
    )
    if not len(axes):
        return None
    # Each step of a run was free; as a whole it is cut into other pieces.
    if not all(line_is_free(space, load, a, b, False) for a, b in pairwise(axes)):
        return None
    by_turns = tuple(CranePose(*pose) for pose in axes.tolist())
    before = fastest_chain(space, load, axes, axis_numbers(crane), np.zeros(len(axes)))
    cut_short = tuple(by_turns[n] for n in kept_by(before))
    return _Around(by_turns, cut_short, sum(move_time_s(crane, Move(a, b)) for a, b in pairwise(cut_short)))


def _lattice(crane: TowerCrane, step_m: float, start: CranePose, end: tuple[float, list[float]]) -> _Lattice:
    """Return the lattice through a start and an end, given by its radius and slewing angles, with this step or more."""
    inner, outer = crane.min_radius_m, max(crane.jib_length_m, start.radius_m, end[0])
    step_m = max(step_m, outer / _MOST_RINGS)
    turn_rad = step_m / outer
    turns = np.arange(-ceil(2.0 * pi / turn_rad), ceil(2.0 * pi / turn_rad) + 1)
    slews = np.unique([*(start.slew_rad + turns * turn_rad), *end[1]])
    radii = np.unique([*np.arange(inner, outer, step_m), outer, start.radius_m, end[0]])
    rings = [CranePose(start.slew_rad, float(radius), start.height_m) for radius in radii]
    ring_s = [1.0 / share_limits(crane, Move(a, b)).rate for a, b in pairwise(rings)]
    radial = crane.trolley
    if crane.luffing is not None:
        radial = radius_limits(crane.luffing, crane.luffing.winch, inner, outer)
    slewing = crane.slewing
    return _Lattice(
        slews, radii, start.height_m, 1.0 / slewing.rate, np.array(ring_s), (_run_up_s(slewing), _run_up_s(radial))
    )


def _place(lattice: _Lattice, slew_rad: float, radius_m: float) -> tuple[int, int]:
    return int(np.searchsorted(lattice.slews_rad, slew_rad)), int(np.searchsorted(lattice.radii_m, radius_m))


def _run_up_s(limits: AxisLimits) -> float:
    """Return how much longer than at full rate a long travel takes from rest to rest."""
    return rest_to_rest_s(_FAR_S * limits.rate, limits) - _FAR_S


@kernel
def _by_turns(
    space: CollisionSpace,
    load: LoadFrame,
    lattice: _Lattice,
    start: tuple[int, int],
    goals: NDArray[np.int64],
    limit_s: float,
) -> NDArray[np.float64]:
    """Return (N, 3) the axes at the ends of the runs of a quickest way; none if there is none below a time.

    ``load``: how hook poses and reference cells correspond; ``start``: slew and ring of the first one; ``goals``: (G,
    2) of those of which one has to be reached; their rings are the same.
    """
    slews, radii = lattice.slews_rad, lattice.radii_m
    n_slews, n_radii = slews.shape[0], radii.shape[0]
    from_start_s = np.zeros(n_radii)
    from_start_s[1:] = np.cumsum(lattice.ring_s)
    left_s = np.empty((n_slews, n_radii))
    for i in range(n_slews):
        nearest = np.inf
        for g in range(goals.shape[0]):
            nearest = min(nearest, abs(slews[i] - slews[goals[g, 0]]))
        for j in range(n_radii):
            left_s[i, j] = nearest * lattice.turn_s + abs(from_start_s[j] - from_start_s[goals[0, 1]])
    # A state is a pose and the axis along which it was reached, 0 slewing and 1 trolleying. By pose and axis: whether
    # the step to the next pose is free; -1 if that is not known yet.
    reached_s = np.full(2 * n_slews * n_radii, np.inf)
    before = np.full(2 * n_slews * n_radii, -1)
    free = np.full((n_slews, n_radii, 2), -1, np.int8)
    one, other = np.empty(3), np.empty(3)
    one[2] = other[2] = lattice.height_m
    first = 2 * (start[0] * n_radii + start[1])
    reached_s[first], reached_s[first + 1] = lattice.run_up_s
    queue = [(reached_s[first] + left_s[start], first), (reached_s[first + 1] + left_s[start], first + 1)]
    heapq.heapify(queue)
    while len(queue) > 0:
        expected_s, state = heapq.heappop(queue)
        i, j, axis = state // 2 // n_radii, state // 2 % n_radii, state % 2
        if left_s[i, j] == 0.0:
            return _ends_of_runs(lattice, before, state)
        if expected_s > reached_s[state] + left_s[i, j]:
            continue
        for to_axis in range(2):
            for side in (-1, 1):
                to_i, to_j = (i + side, j) if to_axis == 0 else (i, j + side)
                if to_i < 0 or to_j < 0 or to_i >= n_slews or to_j >= n_radii:
                    continue
                low_i, low_j = min(i, to_i), min(j, to_j)
                there_s = reached_s[state] + (0.0 if axis == to_axis else lattice.run_up_s[to_axis])
                there_s += lattice.ring_s[low_j] if to_axis == 1 else (slews[low_i + 1] - slews[low_i]) * lattice.turn_s
                to_state = 2 * (to_i * n_radii + to_j) + to_axis
                if there_s >= reached_s[to_state] or there_s + left_s[to_i, to_j] > limit_s:
                    continue
                if free[low_i, low_j, to_axis] < 0:
                    one[0], one[1], other[0], other[1] = slews[i], radii[j], slews[to_i], radii[to_j]
                    free[low_i, low_j, to_axis] = line_is_free(space, load, one, other, False)
                if free[low_i, low_j, to_axis] == 1:
                    reached_s[to_state], before[to_state] = there_s, state
                    heapq.heappush(queue, (there_s + left_s[to_i, to_j], to_state))
    return np.empty((0, 3))


@kernel
def _ends_of_runs(lattice: _Lattice, before: NDArray[np.int64], last: int) -> NDArray[np.float64]:
    """Return (N, 3) the axes at both ends of the runs up to a state."""
    n_radii = lattice.radii_m.shape[0]
    kept = [last]
    state = last
    while before[state] >= 0:
        # The axis changes at the pose at which the step before ended.
        if before[before[state]] < 0 or before[state] % 2 != state % 2:
            kept.append(before[state])
        state = before[state]
    axes = np.empty((len(kept), 3))
    for n, state in enumerate(kept):
        at = state // 2
        row = len(kept) - 1 - n
        axes[row, 0], axes[row, 1] = lattice.slews_rad[at // n_radii], lattice.radii_m[at % n_radii]
        axes[row, 2] = lattice.height_m
    return axes
