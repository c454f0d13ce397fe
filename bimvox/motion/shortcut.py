"""From voxel stairs to a few moves of the crane, each proven free.

Two routes are tried. *Over the top*: straight up, slew and trolley at the lowest free height, or around what is in the
way (``around.py``), straight down. *Along the path*: the fastest chain of joint lines between corners of the voxel
path, by A* that checks an edge for collision only when it would be used; between neighbouring corners the path's own
straight run is always available. On both routes the last moves of the path, in contact with neighbours, are driven
exactly as planned.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import pi

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.crane.kinematics import axis_numbers, nearest_turn, unwrap_slew
from bimvox.crane.tower_crane import CranePose
from bimvox.errors import PlanningError
from bimvox.motion.around import around, fastest_chain, kept_by
from bimvox.motion.move import Line, Move, axes_of, move_time_s
from bimvox.motion.swept import HookEnd, LoadFrame, axes_of_cells, in_cell, line_is_free
from bimvox.motion.swing import RiggedCrane
from bimvox.planning.roomy_path import with_room
from bimvox.planning.search import all_free
from bimvox.planning.shorten_path import straightened
from bimvox.site.collision import CollisionSpace, free_up_to, placement_is_free

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

    Returns:
        Mostly one route; none if there is none of this form.
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
    poses = [every[corner] for corner in _corners(path_vox)]
    axes = np.array([axes_of(pose) for pose in poses])
    own_s = np.zeros(len(poses))
    for n in _blocked_runs(space, load, axes).tolist():
        own_s[n] = move_time_s(crane, Move(poses[n], poses[n + 1], Line.SITE))
    before = fastest_chain(space, load, axes, axis_numbers(crane), own_s)
    moves: list[Move] = []
    for first, node in pairwise(kept_by(before)):
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
    moves = [Move(poses[a], poses[b]) for a, b in pairwise(_corners(path_vox))]
    return [move if move.is_vertical else replace(move, line=Line.SITE) for move in moves]


def joined(moves: Sequence[Move]) -> tuple[Move, ...]:
    """Return the moves with consecutive vertical ones in the same direction merged."""
    result: list[Move] = []
    for move in moves:
        last = result[-1] if result else None
        if last and last.is_vertical and move.is_vertical and last.difference[2] * move.difference[2] > 0.0:
            result[-1] = Move(last.start, replace(last.end, height_m=move.end.height_m))
        else:
            result.append(move)
    return tuple(result)


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

    Raises:
        PlanningError: If a placement is not free, two neighbours are not one unit move apart, or the hook would be
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


def _corners(path_vox: NDArray[np.int32]) -> list[int]:
    """Indices of the first and last cell and of every cell at which the path turns."""
    steps = np.diff(path_vox.astype(np.int64), axis=0)
    turns = np.flatnonzero((steps[1:] != steps[:-1]).any(axis=1)) + 1
    return sorted({0, *turns.tolist(), len(path_vox) - 1})


def _without_rests(moves: Sequence[Move]) -> list[Move]:
    return [move for move in moves if any(move.moving)]
