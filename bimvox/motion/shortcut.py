"""From voxel stairs to a few moves of the crane, each proven free: over the top, around, or along the path.

Two routes are tried. *Over the top*: straight up, slew and trolley at the lowest free height, or around what is in the
way (``around.py``), straight down. *Along the path*: the fastest chain of joint lines between corners of the voxel
path, by A* that checks an edge for collision only when it would be used; between neighbouring corners the path's own
straight run is always available. On both routes the last moves of the path, in contact with neighbours, are driven
exactly as planned.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import ceil, pi
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import inline_kernel, kernel
from bimvox.crane.kinematics import AxisNumbers, axis_numbers, nearest_turn, unwrap_slew
from bimvox.crane.tower_crane import AxisLimits, CranePose, TowerCrane, radius_limits
from bimvox.crane.travel import least_time_s, rest_to_rest_s
from bimvox.errors import PlanningError
from bimvox.motion.move import Line, Move, axes_of, line_time_s, move_time_s, share_limits
from bimvox.motion.swept import HookEnd, LoadFrame, axes_of_cells, in_cell, line_is_free
from bimvox.motion.swing import RiggedCrane
from bimvox.planning.search import all_free
from bimvox.planning.shorten_path import straightened, with_room
from bimvox.site.collision import CollisionSpace, free_up_to, placement_is_free

# The hook's way around obstacles at one height (A* over turns), and the fastest chain of joint lines.
#
# Poses are a lattice over slewing angle and radius, in which both ends lie. A run of steps along one axis costs its
# time at full rate and one run-up, so that few long runs are found rather than many short ones.


@kernel
def _fastest_chain(
    space: CollisionSpace,
    load: LoadFrame,
    axes: NDArray[np.float64],
    limits: AxisNumbers,
    own_s: NDArray[np.float64],
) -> NDArray[np.int64]:
    """Return (N,) int64 the corner before each on the fastest chain to it; of corners that it leaves out, anything.

    ``load``: how hook poses and reference cells correspond; ``axes``: (N, 3) slew, radius and height of the corners;
    ``limits``: the crane's; ``own_s``: (N,) time of the path's own run to the next corner if the joint line there is
    not free, else 0.
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


def _kept_by(before: NDArray[np.int64]) -> list[int]:
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
    before = _fastest_chain(space, load, axes, axis_numbers(crane), np.zeros(len(axes)))
    cut_short = tuple(by_turns[n] for n in _kept_by(before))
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


_HAIR_M = 1e-6
"""Rounding of heights: a cell this little above the highest hook is within reach, as in the map of hook columns."""


@dataclass(frozen=True, slots=True)
class Route:
    """A collision-free route of the hook.

    Attributes:
        moves: In order; each starts where the one before ends.
        clearance_height_m: Highest hook height on it.
    """

    moves: tuple[Move, ...]
    clearance_height_m: float


def move_is_free(space: CollisionSpace, load: LoadFrame, move: Move) -> bool:
    """Return whether every position of the load along a joint or site line is free."""
    return bool(line_is_free(space, load, axes_of(move.start), axes_of(move.end), move.line is Line.SITE))


def over_the_top(
    rigged: RiggedCrane,
    space: CollisionSpace,
    start_vox: HookEnd,
    end_vox: HookEnd,
    slew_rad: float,
) -> tuple[Route, ...]:
    """Return routes up, across and down between two placements ((3,) cells), at the lowest free height.

    An end may be aside of a whole cell on plan (``in_cell``): up and down, the column of that cell counts.
    ``slew_rad`` is the angle at the start, including full turns. Across: straight in (slew, radius) by the smaller
    angle; if that is free at no height, trolley and slewing one after the other, then the same by the larger angle. If
    none of these is free, around what is in the way (``around``), at the height of several at which it is quickest,
    both by turns and cut short.

    Returns mostly one route; none if there is none of this form.
    """
    crane, load = rigged.crane, rigged.load
    start_axes, end_axes = axes_of_cells(load, start_vox), axes_of_cells(load, end_vox)
    start = CranePose(nearest_turn(float(start_axes[0]), slew_rad), float(start_axes[1]), float(start_axes[2]))
    end = CranePose(nearest_turn(float(end_axes[0]), start.slew_rad), float(end_axes[1]), float(end_axes[2]))
    heights = list(_open_heights(rigged, space, start_vox, end_vox))
    for stops in stops_across(start, end):
        for height_m in heights:
            poses = [replace(stop, height_m=height_m) for stop in stops]
            across = [Move(a, b) for a, b in pairwise(poses)]
            if all(move_is_free(space, load, move) for move in across):
                return (_up_across_down(start, poses, end.height_m),)
    ways: tuple[tuple[CranePose, ...], ...] = ()
    best_s = np.inf
    for height_m in _some_of(heights):
        # Higher, the way may be shorter.
        extra_s = 2.0 * (height_m - heights[0]) / crane.hoist.rate
        first, last = (replace(pose, height_m=height_m) for pose in (start, end))
        found = around(rigged, space, first, last, best_s - extra_s)
        if found is not None and found.time_s + extra_s < best_s:
            ways, best_s = (found.by_turns, found.cut_short), found.time_s + extra_s
    return tuple(_up_across_down(start, way, end.height_m) for way in dict.fromkeys(ways))


def _some_of(heights: Sequence[float]) -> list[float]:
    """Return the lowest of ascending heights, some above it, further and further apart, and the highest."""
    n = np.unique([0, *(2 ** np.arange(8)), len(heights) - 1])
    return [heights[i] for i in n.tolist() if i < len(heights)] if heights else []


def _up_across_down(start: CranePose, stops: Sequence[CranePose], end_height_m: float) -> Route:
    """Return the route between two heights over stops at one height."""
    across = [Move(a, b) for a, b in pairwise(stops)]
    down = Move(stops[-1], replace(stops[-1], height_m=end_height_m))
    return Route(tuple(_without_rests([Move(start, stops[0]), *across, down])), stops[0].height_m)


def _open_heights(
    rigged: RiggedCrane,
    space: CollisionSpace,
    start_vox: HookEnd,
    end_vox: HookEnd,
) -> Iterator[float]:
    """Yield ascending hook heights up to which the columns over both placements are free."""
    until = min(free_up_to(space, *in_cell(end)) for end in (start_vox, end_vox))
    for z in range(max(int(start_vox[2]), int(end_vox[2])), until):
        height_m = rigged.load.zero_height_m + z * rigged.load.voxel_size_m
        if height_m > rigged.crane.highest_hook_m + _HAIR_M:
            return
        yield height_m


def stops_across(start: CranePose, end: CranePose) -> Iterator[list[CranePose]]:
    """Yield the stops (heights to be replaced) of routes from one plan position to another, the plainest first."""
    turn = end.slew_rad - start.slew_rad
    long_way = turn - 2.0 * pi if turn > 0.0 else turn + 2.0 * pi
    for angle in (turn, long_way):
        slew = start.slew_rad + angle
        last = replace(end, slew_rad=slew)
        yield [start, last]
        yield [start, replace(start, radius_m=end.radius_m), last]
        yield [start, replace(start, slew_rad=slew), last]


def along_the_path(rigged: RiggedCrane, space: CollisionSpace, path_vox: NDArray[np.int32], slew_rad: float) -> Route:
    """Return the fastest chain of moves between corners of a voxel path, every placement of which must be free.

    The crane rests at each corner that it keeps. ``slew_rad`` is its angle before, including full turns. A load that
    swings is moved away from what is next to the path first, since it is accelerated at each corner.
    """
    crane, load = rigged.crane, rigged.load
    path_vox = straightened(space, path_vox) if rigged.pendulum is None else with_room(space, path_vox)
    every = _poses_of_path(load, path_vox, slew_rad)
    poses = [every[corner] for corner in corners_of(path_vox)]
    axes = np.array([axes_of(pose) for pose in poses])
    own_s = np.zeros(len(poses))
    for n in _blocked_runs(space, load, axes).tolist():
        own_s[n] = move_time_s(crane, Move(poses[n], poses[n + 1], Line.SITE))
    before = _fastest_chain(space, load, axes, axis_numbers(crane), own_s)
    moves: list[Move] = []
    for first, node in pairwise(_kept_by(before)):
        along_run = node == first + 1 and own_s[first] > 0.0
        moves.append(Move(poses[first], poses[node], Line.SITE if along_run else Line.JOINT))
    moves = _without_rests(moves)
    return Route(tuple(moves), max(pose.height_m for pose in [poses[0], *(move.end for move in moves)]))


@kernel
def _blocked_runs(space: CollisionSpace, load: LoadFrame, axes: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the corners ((N, 3) axes) from which the joint line to the next one is not free."""
    blocked = np.zeros(axes.shape[0], np.bool_)
    for n in range(axes.shape[0] - 1):
        blocked[n] = not line_is_free(space, load, axes[n], axes[n + 1], False)
    return np.flatnonzero(blocked)


def follow(load: LoadFrame, path_vox: NDArray[np.int32], slew_rad: float) -> list[Move]:
    """Return the moves that follow a voxel path exactly, one per straight run."""
    poses = _poses_of_path(load, path_vox, slew_rad)
    moves = [Move(poses[a], poses[b]) for a, b in pairwise(corners_of(path_vox))]
    return [move if move.is_vertical else replace(move, line=Line.SITE) for move in moves]


def _poses_of_path(load: LoadFrame, path_vox: NDArray[np.int32], slew_rad: float) -> list[CranePose]:
    """Return the hook's pose at every cell of a path, slew unwrapped from the turn nearest to ``slew_rad``."""
    # Cells of one column share one slew and radius to the last bit: a vertical move must not slew by rounding noise.
    columns, column_of = np.unique(path_vox[:, :2], axis=0, return_inverse=True)
    plan = axes_of_cells(load, np.pad(columns, ((0, 0), (0, 1))))[column_of.ravel()]
    slew = unwrap_slew(plan[:, 0], slew_rad)
    height = axes_of_cells(load, path_vox)[:, 2]
    return [CranePose(float(s), float(r), float(h)) for s, r, h in zip(slew, plan[:, 1], height, strict=True)]


def check_path(rigged: RiggedCrane, space: CollisionSpace, path_vox: NDArray[np.int32]) -> None:
    """Refuse a path that the crane cannot follow.

    Raises PlanningError: if a placement is not free, two neighbours are not one unit move apart, or the hook would be
    above the jib's rope exit.
    """
    steps = np.abs(np.diff(path_vox.astype(np.int64), axis=0)).sum(axis=1)
    if (steps != 1).any():
        i = int(np.flatnonzero(steps != 1)[0])
        raise PlanningError(f"the path jumps from {path_vox[i].tolist()} to {path_vox[i + 1].tolist()}")
    if not all_free(space, path_vox):
        cell = next(cell for cell in path_vox if not placement_is_free(space, cell[0], cell[1], cell[2]))
        raise PlanningError(f"the path is not free at {cell.tolist()}", hint="plan the lift again")
    crane, load = rigged.crane, rigged.load
    highest_m = load.zero_height_m + int(path_vox[:, 2].max()) * load.voxel_size_m
    if highest_m > crane.highest_hook_m + _HAIR_M:
        raise PlanningError(
            f"the path takes the hook up to {highest_m:.2f} m, above the jib at {crane.highest_hook_m:.2f} m",
            hint="raise [crane] jib_height_m, or shorten the slings",
        )


def corners_of(path_vox: NDArray[np.int32]) -> list[int]:
    """Indices of the first and last cell and of every cell at which the path turns."""
    steps = np.diff(path_vox.astype(np.int64), axis=0)
    turns = np.flatnonzero((steps[1:] != steps[:-1]).any(axis=1)) + 1
    return sorted({0, *turns.tolist(), len(path_vox) - 1})


def _without_rests(moves: Sequence[Move]) -> list[Move]:
    return [move for move in moves if any(move.moving)]
