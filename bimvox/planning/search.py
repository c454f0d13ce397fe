"""Complete shortest-path search over the placements of a component: the fallback behind the policy.

A* with unit moves and the Manhattan distance as heuristic. A move leaves the estimate f = g + h unchanged or raises it
by two, into a narrow placement by two or four, so three stacks (this f, the next two) replace the priority queue. Last
in, first out follows a path to its end before its siblings (tie-breaking on depth).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.env.actions import MOVES
from bimvox.site.collision import CollisionSpace, placement_is_free
from bimvox.site.component import IntVec

_UNKNOWN, _FREE, _NARROW, _BLOCKED, _CLOSED = 0, 1, 2, 3, 4
_PATIENCE = 16_384
"""Placements expanded before the search checks whether the goal is enclosed; then it checks again and again, ..."""
_MORE = 4
"""... each time after this many times more. So a search in vain takes about as long as the smaller of two rooms."""
_ROOM = 65_536
"""The largest room around the goal that a check searches, or as many placements as are expanded."""


@dataclass(frozen=True, slots=True, eq=False)
class _SearchResult:
    """The result of a search.

    Attributes:
        path_vox: (N, 3) int32 reference cells of a shortest path from start to goal; None if there is no path.
        expanded: Number of placements expanded.
    """

    path_vox: NDArray[np.int32] | None
    expanded: int


def shortest_path(space: CollisionSpace, start: IntVec, goal: IntVec) -> _SearchResult:
    """Return a shortest path of unit moves between two reference cells; the search is deterministic.

    There is no path if all placements reachable from the start, or all reachable from the goal, are known. The goal is
    checked after a while: a room around it is usually small, and the site around the start is large.
    """
    path, expanded = _a_star(space, space, np.array(start, np.int64), np.array(goal, np.int64), MOVES, 1)
    return _SearchResult(path if len(path) else None, int(expanded))


def roomy_path(space: CollisionSpace, wide: CollisionSpace, path_vox: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return a path between the ends of a path that avoids narrow placements: it counts each as three.

    Args:
        space: The collision rule.
        wide: A stricter one, under which narrow placements are not free.
        path_vox: (N, 3) int32, unit moves over free placements.

    Returns:
        (M, 3) int32, unit moves over free placements, the same ends.
    """
    first, last = path_vox[[0, -1]].astype(np.int64)
    path: NDArray[np.int32] = _a_star(space, wide, first, last, MOVES, 3)[0]
    return path


def reachable(space: CollisionSpace, cell: IntVec, limit: int) -> NDArray[np.int32]:
    """Return the placements reachable from ``cell``, at most ``limit`` of them: (N, 3) int32."""
    result: NDArray[np.int32] = _flood(space, np.array(cell, np.int64), MOVES, limit)
    return result


def room_around(space: CollisionSpace, cell: IntVec, top: int, limit: int) -> tuple[NDArray[np.int32], bool]:
    """Return placements reachable from a free one, upward first, until one reaches the height ``top``.

    Args:
        space: The collision rule.
        cell: The placement to start from; must be free.
        top: z of the reference cell that counts as outside.
        limit: A room with this many placements counts as open.

    Returns:
        (N, 3) int32 placements, and whether the room is open: it reached the top or the limit.
    """
    found, is_open = _room(space, np.array(cell, np.int64), MOVES, top, limit)
    return found, bool(is_open)


@kernel
def _pushed(stack: NDArray[np.int64], size: int, value: int) -> NDArray[np.int64]:
    """Return the stack with ``value`` at ``size``; a full stack grows."""
    if size == stack.shape[0]:
        grown = np.empty(2 * size, np.int64)
        for n in range(size):  # a slice assignment takes 5 s to compile
            grown[n] = stack[n]
        stack = grown
    stack[size] = value
    return stack


@kernel
def _a_star(
    space: CollisionSpace,
    wide: CollisionSpace,
    start: NDArray[np.int64],
    goal: NDArray[np.int64],
    moves: NDArray[np.int32],
    narrow: int,
) -> tuple[NDArray[np.int32], int]:
    """Return a path, empty if there is none, and the number of placements expanded.

    A placement that is not free in ``wide`` counts as ``narrow``, 1 or 3; if 1, nothing is looked up in ``wide``.
    """
    nx, ny, nz = space.table.shape[0] - 1, space.table.shape[1] - 1, space.table.shape[2] - 1
    state = np.zeros(nx * ny * nz, np.uint8)
    cost = np.zeros(nx * ny * nz, np.int32)
    came_by = np.zeros(nx * ny * nz, np.int8)  # one more than the move; zeros need no memory until they are used
    # Stacks of placements by the least length of a path through them: the present one, two more, four more.
    this_f, next_f, later_f = np.empty(1024, np.int64), np.empty(1024, np.int64), np.empty(1024, np.int64)
    this_size, next_size, later_size, expanded, patience = 0, 0, 0, 0, _PATIENCE
    no_path = np.empty((0, 3), np.int32)
    if not placement_is_free(space, start[0], start[1], start[2]):
        return no_path, expanded
    if not placement_is_free(space, goal[0], goal[1], goal[2]):
        return no_path, expanded
    first = (start[0] * ny + start[1]) * nz + start[2]
    last = (goal[0] * ny + goal[1]) * nz + goal[2]
    state[first] = _FREE
    this_f = _pushed(this_f, this_size, first)
    this_size += 1
    while this_size or next_size or later_size:
        # No placement of this length is left.
        if not this_size:
            this_f, next_f, later_f = next_f, later_f, this_f
            this_size, next_size, later_size = next_size, later_size, 0
            continue
        this_size -= 1
        here = this_f[this_size]
        if state[here] == _CLOSED:
            continue
        state[here] = _CLOSED
        expanded += 1
        if here == last:
            break
        # After many placements, look whether the goal is closed in: then there is no path.
        if expanded == patience:
            if _is_closed_in(space, goal, start, moves, max(_ROOM, expanded)):
                return no_path, expanded
            patience *= _MORE
        x, y, z = here // (ny * nz), here // nz % ny, here % nz
        away = abs(x - goal[0]) + abs(y - goal[1]) + abs(z - goal[2])
        for action in range(moves.shape[0]):
            u, v, w = x + moves[action, 0], y + moves[action, 1], z + moves[action, 2]
            if u < 0 or v < 0 or w < 0 or u >= nx or v >= ny or w >= nz:
                continue
            there = (u * ny + v) * nz + w
            # What is free is looked up once, when a placement is reached first.
            is_new = state[there] == _UNKNOWN
            if is_new:
                state[there] = _FREE if placement_is_free(space, u, v, w) else _BLOCKED
                if narrow > 1 and state[there] == _FREE and not placement_is_free(wide, u, v, w):
                    state[there] = _NARROW
            if state[there] >= _BLOCKED:
                continue
            step = narrow if state[there] == _NARROW else 1
            if not is_new and cost[there] <= cost[here] + step:
                continue
            cost[there] = cost[here] + step
            came_by[there] = action + 1
            # A step towards the goal leaves that length as it is; a step away or a narrow one adds 2, a narrow step
            # away 4.
            nearer = abs(u - goal[0]) + abs(v - goal[1]) + abs(w - goal[2]) < away
            if step == 1 and nearer:
                this_f = _pushed(this_f, this_size, there)
                this_size += 1
            elif step == 1 or nearer:
                next_f = _pushed(next_f, next_size, there)
                next_size += 1
            else:
                later_f = _pushed(later_f, later_size, there)
                later_size += 1
    if state[last] != _CLOSED:
        return no_path, expanded
    return _moves_back(came_by, start, goal, moves, (ny, nz)), expanded


@kernel
def _moves_back(
    came_by: NDArray[np.int8],
    start: NDArray[np.int64],
    goal: NDArray[np.int64],
    moves: NDArray[np.int32],
    size: tuple[int, int],
) -> NDArray[np.int32]:
    """Return the path to the goal by the moves, plus one, by which each was reached; ``size`` is the grid's in y, z."""
    ny, nz = size
    last = (start[0] * ny + start[1]) * nz + start[2]
    first = here = (goal[0] * ny + goal[1]) * nz + goal[2]
    length = 1
    while here != last:
        action = came_by[here] - 1
        here -= (moves[action, 0] * ny + moves[action, 1]) * nz + moves[action, 2]
        length += 1
    path = np.empty((length, 3), np.int32)
    here = first
    for step in range(length - 1, -1, -1):
        path[step, 0], path[step, 1], path[step, 2] = here // (ny * nz), here // nz % ny, here % nz
        action = came_by[here] - 1
        if action >= 0:
            here -= (moves[action, 0] * ny + moves[action, 1]) * nz + moves[action, 2]
    return path


@kernel
def _is_closed_in(
    space: CollisionSpace, goal: NDArray[np.int64], start: NDArray[np.int64], moves: NDArray[np.int32], limit: int
) -> bool:
    """Return whether the goal is in a room of fewer placements than a limit that the start is not in."""
    room = _flood(space, goal, moves, limit)
    if room.shape[0] == limit:
        return False
    for n in range(room.shape[0]):
        if room[n, 0] == start[0] and room[n, 1] == start[1] and room[n, 2] == start[2]:
            return False
    return True


@kernel
def _flood(space: CollisionSpace, start: NDArray[np.int64], moves: NDArray[np.int32], limit: int) -> NDArray[np.int32]:
    nx, ny, nz = space.table.shape[0] - 1, space.table.shape[1] - 1, space.table.shape[2] - 1
    seen = np.zeros((nx, ny, nz), np.bool_)
    found = np.empty((limit, 3), np.int32)
    if limit < 1 or not placement_is_free(space, start[0], start[1], start[2]):
        return found[:0].copy()
    seen[start[0], start[1], start[2]] = True
    found[0, 0], found[0, 1], found[0, 2] = start[0], start[1], start[2]
    size, at = 1, 0
    while at < size:
        for action in range(moves.shape[0]):
            u, v, w = found[at, 0] + moves[action, 0], found[at, 1] + moves[action, 1], found[at, 2] + moves[action, 2]
            if u < 0 or v < 0 or w < 0 or u >= nx or v >= ny or w >= nz or seen[u, v, w]:
                continue
            seen[u, v, w] = True
            if size < limit and placement_is_free(space, u, v, w):
                found[size, 0], found[size, 1], found[size, 2] = u, v, w
                size += 1
        at += 1
    return found[:size].copy()


@kernel
def which_free(space: CollisionSpace, placements_vox: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Return which of (N, 3) placements are free: (N,) bool."""
    free = np.empty(placements_vox.shape[0], np.bool_)
    for n in range(placements_vox.shape[0]):
        free[n] = placement_is_free(space, placements_vox[n, 0], placements_vox[n, 1], placements_vox[n, 2])
    return free


@kernel
def all_free(space: CollisionSpace, path_vox: NDArray[np.int32]) -> bool:
    """Return whether every placement of a path is free."""
    for n in range(path_vox.shape[0]):
        if not placement_is_free(space, path_vox[n, 0], path_vox[n, 1], path_vox[n, 2]):
            return False
    return True


@kernel
def _room(
    space: CollisionSpace, start: NDArray[np.int64], moves: NDArray[np.int32], top: int, limit: int
) -> tuple[NDArray[np.int32], bool]:
    nx, ny, nz = space.table.shape[0] - 1, space.table.shape[1] - 1, space.table.shape[2] - 1
    seen = np.zeros((nx, ny, nz), np.bool_)
    found = np.empty((1024, 3), np.int32)
    stack = np.empty(1024, np.int64)
    depth = 0
    size = 0
    stack = _pushed(stack, depth, (start[0] * ny + start[1]) * nz + start[2])
    depth += 1
    seen[start[0], start[1], start[2]] = True
    while depth:
        depth -= 1
        here = stack[depth]
        x, y, z = here // (ny * nz), here // nz % ny, here % nz
        if size == found.shape[0]:
            more = np.empty((2 * size, 3), np.int32)
            for n in range(size):
                more[n, 0], more[n, 1], more[n, 2] = found[n, 0], found[n, 1], found[n, 2]
            found = more
        found[size, 0], found[size, 1], found[size, 2] = x, y, z
        size += 1
        if z >= top or size >= limit:
            return found[:size].copy(), True
        # The last pushed is taken first: up.
        for up in range(2):
            for action in range(moves.shape[0]):
                if (moves[action, 2] == 1) != (up == 1):
                    continue
                u, v, w = x + moves[action, 0], y + moves[action, 1], z + moves[action, 2]
                if u < 0 or v < 0 or w < 0 or u >= nx or v >= ny or w >= nz or seen[u, v, w]:
                    continue
                seen[u, v, w] = True
                if placement_is_free(space, u, v, w):
                    stack = _pushed(stack, depth, (u * ny + v) * nz + w)
                    depth += 1
    return found[:size].copy(), False
