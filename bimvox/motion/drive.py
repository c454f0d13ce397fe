"""The quickest motion for one path: over the top and along the path are timed, blended and compared."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bimvox.errors import PlanningError
from bimvox.motion.move import Line, Move, axes_of
from bimvox.motion.shortcut import Route, along_the_path, check_path, follow, over_the_top
from bimvox.motion.steady import Swaying, SwingRules, busiest_s, steadied, swing_fault_s
from bimvox.motion.swept import HookEnd, axes_of_cells, in_cell, pose_next_to
from bimvox.motion.swing import RiggedCrane
from bimvox.motion.timeline import Timeline, blended, followed
from bimvox.planning.search import shortest_path
from bimvox.records.lift import Guide, Lift
from bimvox.records.track import turn_back_s
from bimvox.site.collision import CollisionSpace, margin_vox, placement_is_free, turning_space
from bimvox.site.site import Site

_GOOD_ENOUGH = 1.05
"""The other route is skipped if going over the top takes at most this multiple of the slowest axis's time."""

_ROUNDING = 1e-9
"""Poses that differ by less, in metres and radians, are the same."""

SET_DOWN_M = 0.5
"""Height above its place from which a part is lowered straight down."""


def drive_path(
    rigged: RiggedCrane,
    space: CollisionSpace,
    path_vox: NDArray[np.int32],
    contact_moves: int,
    slew_rad: float,
    guide: Guide | None = None,
) -> tuple[Timeline, float]:
    """Return the quickest motion found that carries a load from the start to the end of a voxel path.

    The last ``contact_moves`` unit moves are driven exactly as planned. A path that ends without contact ends by
    lowering straight down if the space above the place is free.

    Args:
        rigged: The crane with the load.
        space: The collision rule.
        path_vox: (N, 3) int32 reference cells, N >= 2, one unit move between neighbours.
        contact_moves: How many of the last placements were cleared by the narrow phase.
        slew_rad: Slewing angle before, including full turns; the motion starts at the turn nearest to it.
        guide: How a crew guides the load on its last moves: the crane rests at each of its poses.

    Returns:
        The motion, and the height that the hook has to reach.

    Raises:
        PlanningError: If the path is not free, or takes the hook above the jib.
    """
    check_path(rigged, space, path_vox)
    head, tail = _with_set_down(rigged, space, path_vox, contact_moves)
    transit = space
    if contact_moves > 0:
        # The cells that the last moves clear are cleared for them alone: no shortcut may use them. Only if the last
        # moves lead straight down may lowering begin, above their start, before the other axes are at rest.
        transit = _without_cleared(space, tail[1:])
        if (tail[:, :2] != tail[0, :2]).any():
            space = transit
    return _quickest(_Driver(rigged, transit, space, guide), head, tail, slew_rad, goes_back=contact_moves == 0)


def _drive_above(
    rigged: RiggedCrane, space: CollisionSpace, path_vox: NDArray[np.int32], slew_rad: float
) -> tuple[Timeline, float]:
    """Return what ``drive_path`` does for a path that does not end at the load's place: the load comes to rest there.

    Raises PlanningError: if the path is not free, or takes the hook above the jib.
    """
    check_path(rigged, space, path_vox)
    return _quickest(_Driver(rigged, space, space), path_vox, path_vox[-1:], slew_rad)


def _quickest(
    driver: _Driver, head: NDArray[np.int32], tail: NDArray[np.int32], slew_rad: float, *, goes_back: bool = False
) -> tuple[Timeline, float]:
    """Return the quicker motion of the two routes, and the height that the hook has to reach.

    ``driver``: lays moves over time; ``head``: (N, 3) the path up to the last moves; ``tail``: (M, 3) the placements of
    the last moves, the first one the last of the head; ``slew_rad``: slewing angle before; ``goes_back``: whether the
    last moves may begin at any height of their column.
    """
    rigged, transit = driver.rigged, driver.transit
    over = over_the_top(rigged, transit, head[0], head[-1], slew_rad)
    best: Timeline | None = None
    for route in over:
        best = _quicker(best, driver.finished(route.moves, tail, slew_rad, _length_s(best)))
    if best is not None and best.duration_s <= _GOOD_ENOUGH * busiest_s(
        best.moves, [profile.duration_s for profile in best.profiles]
    ):
        return best, over[0].clearance_height_m
    along = along_the_path(rigged, transit, head, slew_rad)
    moves, is_same = list(along.moves), any(_same_moves(along, route) for route in over)
    if goes_back and moves and moves[-1].is_vertical and moves[-1].difference[2] > 0.0:
        # The only route to above the place leads up its own column: go straight to the place instead of up and down.
        begins = round((moves[-1].start.height_m - rigged.load.zero_height_m) / rigged.load.voxel_size_m)
        moves, tail, is_same = moves[:-1], _straight(tail[-1], begins), False
    # Where nothing is in the way, the path is cut short to the moves over the top.
    if not is_same:
        best = _quicker(best, driver.finished(moves, tail, slew_rad, _length_s(best)))
    assert best is not None
    return best, min(route.clearance_height_m for route in (*over, along))


def _length_s(timeline: Timeline | None) -> float:
    return np.inf if timeline is None else timeline.duration_s


def _quicker(best: Timeline | None, other: Timeline | None) -> Timeline | None:
    """Return the quicker of two motions, the first one if they take equally long."""
    return other if _length_s(other) < _length_s(best) else best


def _same_moves(along: Route, over: Route) -> bool:
    """Return whether two routes have the same moves, but for rounding."""
    if [move.line for move in along.moves] != [move.line for move in over.moves]:
        return False
    one, other = (np.array([(axes_of(m.start), axes_of(m.end)) for m in route.moves]) for route in (along, over))
    return bool(np.abs(one - other).max(initial=0.0) <= _ROUNDING)


def _without_cleared(space: CollisionSpace, placements_vox: NDArray[np.int32]) -> CollisionSpace:
    """Return a collision rule in which these placements ((N, 3)) are not cleared."""
    cleared = space.cleared.copy()
    local = placements_vox - space.cleared_low
    inside = ((local >= 0) & (local < cleared.shape)).all(axis=1)
    cleared[tuple(local[inside].T)] = False
    return space._replace(cleared=cleared)


def _with_set_down(
    rigged: RiggedCrane, space: CollisionSpace, path_vox: NDArray[np.int32], contact_moves: int
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Split a path into what may be shortcut and the last moves, which are driven exactly.

    The last moves are those in contact. Without contact the part is lowered onto its place from as high above it as is
    free, half a metre at most, and the path is extended from its end up to there.
    """
    if contact_moves > 0:
        split = max(0, len(path_vox) - 1 - contact_moves)
        return path_vox[: split + 1], path_vox[split:]
    (x, y, z), load = (int(n) for n in path_vox[-1]), rigged.load
    highest = int(np.floor((rigged.crane.highest_hook_m - load.zero_height_m) / load.voxel_size_m + 1e-6))
    above = z
    while above < min(highest, z + max(1, round(SET_DOWN_M / load.voxel_size_m))):
        if not placement_is_free(space, x, y, above + 1):
            break
        above += 1
    column = np.array([[x, y, k] for k in range(z, above + 1)], np.int32)
    return np.concatenate([path_vox, column[1:]]), column[::-1]


def _straight(place_vox: NDArray[np.int32], begins: int) -> NDArray[np.int32]:
    """Return the unit moves in the column of a place from one height to the place."""
    x, y, z = (int(n) for n in place_vox)
    step = 1 if begins <= z else -1
    return np.array([[x, y, k] for k in range(begins, z + step, step)], np.int32)


def drive_free(
    rigged: RiggedCrane,
    space: CollisionSpace,
    start_vox: HookEnd,
    end_vox: HookEnd,
    slew_rad: float,
) -> tuple[Timeline, float]:
    """Return a motion between two placements for which there is no path yet (the empty hook).

    The hook goes over the top if that is free, otherwise along a path found by search. An end may be aside of a whole
    cell on plan (``in_cell``): the path begins and ends in that cell.

    Returns the motion, and the height that the hook has to reach. Raises PlanningError: if there is no free route.
    """
    routes = over_the_top(rigged, space, start_vox, end_vox, slew_rad)
    if not routes:
        first, last = in_cell(start_vox), in_cell(end_vox)
        found = shortest_path(space, first, last).path_vox
        if found is None:
            (_, from_m, high_m), (_, to_m, to_high_m) = axes_of_cells(rigged.load, [first, last]).tolist()
            raise PlanningError(
                f"no free path for the empty hook from {high_m:.1f} m above z = 0 at a radius of {from_m:.1f} m "
                f"to {to_high_m:.1f} m at {to_m:.1f} m",
                hint="something is in the way over the set point or the pick point; look at the lift in the log",
            )
        check_path(rigged, space, found)
        routes = (_from_aside(rigged, along_the_path(rigged, space, found, slew_rad), start_vox, end_vox),)
    driver, best = _Driver(rigged, space, space), None
    for route in routes:
        best = _quicker(best, driver.steady(_joined(route.moves), 0, -np.inf, _length_s(best)))
    assert best is not None
    return best, routes[0].clearance_height_m


def _from_aside(
    rigged: RiggedCrane,
    route: Route,
    start_vox: HookEnd,
    end_vox: HookEnd,
) -> Route:
    """Return a route between whole cells from and to where the hook hangs in these cells."""
    first, last = route.moves[0].start, route.moves[-1].end
    begin, end = (pose_next_to(rigged.load, vox, pose) for vox, pose in ((start_vox, first), (end_vox, last)))
    moves = (Move(begin, first, Line.SITE), *route.moves, Move(last, end, Line.SITE))
    return replace(route, moves=tuple(move for move in moves if move.start != move.end))


@dataclass(frozen=True, slots=True, eq=False)
class _Driver:
    """Lays the moves of one crane with one load over time.

    Attributes:
        rigged: The crane with its load.
        transit: The collision rule up to the last moves.
        last: The rule for the last moves.
        guide: How a crew guides the load on them; None if it only hangs on its hook.
    """

    rigged: RiggedCrane
    transit: CollisionSpace
    last: CollisionSpace
    guide: Guide | None = None

    def finished(
        self, moves: Sequence[Move], tail_vox: NDArray[np.int32], slew_rad: float, limit_s: float = np.inf
    ) -> Timeline | None:
        """Append the exact last moves to a route's, and lay all of them over time; None if that takes too long."""
        load = self.rigged.load
        tail = follow(load, tail_vox, moves[-1].end.slew_rad if moves else slew_rad)
        begins_m = load.zero_height_m + int(tail_vox[0, 2]) * load.voxel_size_m
        whole = _joined([*moves, *tail])
        if self.guide is not None:
            whole = _guided(whole, self.guide)
            return self.steady(whole, len(self.guide.poses) - 1, begins_m, limit_s)
        return self.steady(whole, len(tail), begins_m, limit_s)

    def steady(
        self, moves: Sequence[Move], tail_moves: int, straight_below_m: float, limit_s: float = np.inf
    ) -> Timeline | None:
        """Lay moves over time, corners rounded, the load at rest in the last moves; None if that takes too long."""
        crane, load, pendulum, _ = self.rigged

        def blend(timeline: Timeline) -> Timeline:
            return blended(timeline, self.transit, load, straight_below_m, self.last, pendulum)

        def fault_s(timeline: Timeline, sway: Swaying) -> float | None:
            return swing_fault_s(timeline, sway, load, self.transit, self.last, tail_moves, straight_below_m)

        rules = SwingRules(blend, fault_s, load.voxel_size_m / 2.0, limit_s)
        return steadied(crane, moves, pendulum, rules)


def drive_turning(
    site: Site, rigged: RiggedCrane, space: CollisionSpace, lift: Lift, slew_rad: float
) -> tuple[Timeline, float]:
    """Return the quickest motion found for the path of a lift whose load turns with the jib.

    The crane pauses at the start of the last moves while a crew turns the load to its final heading.

    Args:
        site: The site.
        rigged: The crane with the load.
        space: The collision rule in the final heading, the last moves cleared.
        lift: The lift; it must have a path.
        slew_rad: Slewing angle before, including full turns.

    Returns:
        The motion, and the height that the hook has to reach.

    Raises:
        PlanningError: If the path is not free at every heading, or takes the hook above the jib.
    """
    assert lift.path_vox is not None
    begins = len(lift.path_vox) - 1 - lift.contact_moves
    x, y, z = (int(n) for n in lift.path_vox[0])
    component = site.components[lift.component]
    turning = turning_space(site, component, space, (x, y, z), margin_vox(site, lift.kept))
    if turning is None:
        raise PlanningError("the load cannot turn above its place in the yard", hint="plan the lift again")
    there, there_m = _drive_above(rigged, turning, lift.path_vox[: begins + 1], slew_rad)
    first, last = there.moves[0].start, there.moves[-1].end
    down, down_m = drive_path(rigged, space, lift.path_vox[begins:], lift.contact_moves, last.slew_rad, lift.guide)
    pause_s = turn_back_s(last.slew_rad - first.slew_rad, site.rules.turn_s)
    return followed(there, down, pause_s), max(there_m, down_m)


def _guided(moves: Sequence[Move], guide: Guide) -> tuple[Move, ...]:
    """Return moves whose last one, straight down, rests at the height of every pose of a guide."""
    *before, last = moves
    place_m = last.end.height_m
    if last.start.height_m > place_m + guide.top_m:
        at = replace(last.end, height_m=place_m + guide.top_m)
        before.append(Move(last.start, at))
        last = Move(at, last.end)
    start = last.start
    for (height_m, _, _), least_s in zip(guide.poses[1:], guide.least_s, strict=True):
        end = replace(last.end, height_m=place_m + height_m)
        if end.height_m < start.height_m:
            before.append(Move(start, end, least_s=least_s))
            start = end
    return tuple(before)


def _joined(moves: Sequence[Move]) -> tuple[Move, ...]:
    """Return the moves with consecutive vertical ones in the same direction merged."""
    result: list[Move] = []
    for move in moves:
        last = result[-1] if result else None
        if last and last.is_vertical and move.is_vertical and last.difference[2] * move.difference[2] > 0.0:
            result[-1] = Move(last.start, replace(last.end, height_m=move.end.height_m))
        else:
            result.append(move)
    return tuple(result)
