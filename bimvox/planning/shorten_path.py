"""Shortening of a cell path: over the cells that it visited, and by straight legs over free, roomy placements."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.planning.search import roomy_path, which_free
from bimvox.site.collision import CollisionSpace, placement_is_free

_MOST_CORNERS = 4
"""Three legs have two corners, and one more at each end."""


def shortest_of_visited(path_vox: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return a shortest path between the ends of a path that uses only the cells that it visited.

    ``path_vox``: (N, 3) int32, unit moves. Returns (M, 3) int32, M <= N, unit moves, the same ends.
    """
    low = path_vox.min(axis=0).astype(np.int64) - 1
    ny, nz = (path_vox.max(axis=0) - low + 2)[1:].tolist()
    x, y, z = (path_vox - low).T
    visited, places = np.unique((x * ny + y) * nz + z, return_inverse=True)
    moves = np.array([-ny * nz, ny * nz, -nz, nz, -1, 1])
    kept = visited[_steps_between(visited, moves, int(places[0]), int(places[-1]))]
    path: NDArray[np.int64] = np.stack((kept // (ny * nz), kept // nz % ny, kept % nz), axis=1) + low
    return path.astype(np.int32)


@kernel
def _steps_between(visited: NDArray[np.int64], moves: NDArray[np.int64], start: int, goal: int) -> NDArray[np.int64]:
    """Return the places in ``visited``, which is in order, of a shortest path from ``start`` to ``goal``."""
    before = np.full(visited.size, -1, np.int64)
    queue = np.empty(visited.size, np.int64)
    queue[0] = goal
    before[goal] = goal
    first, size = 0, 1
    while first < size and before[start] < 0:
        here = queue[first]
        first += 1
        for n in range(moves.size):
            key = visited[here] + moves[n]
            low, high = 0, visited.size
            while low < high:
                middle = (low + high) // 2
                if visited[middle] < key:
                    low = middle + 1
                else:
                    high = middle
            if low < visited.size and visited[low] == key and before[low] < 0:
                before[low] = here
                queue[size] = low
                size += 1
    at, length = start, 0
    queue[0] = start
    while at != goal:
        at = before[at]
        length += 1
        queue[length] = at
    return queue[: length + 1].copy()


@kernel
def straightened(space: CollisionSpace, path_vox: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return a path without detours and stairs: from each cell straight to the farthest one that three legs reach.

    A cut runs along each axis once, in one of the six orders, over free placements, so it is as short as possible. It
    is used if it is shorter than the path, or as long with more corners than three legs have. Repeated until nothing
    is cut.

    ``path_vox``: (N, 3) int32, unit moves over free placements. Returns (M, 3) int32, M <= N, unit moves over free
    placements, the same ends.
    """
    count = path_vox.shape[0]
    path, kept = np.empty((count, 3), np.int64), np.empty((count, 3), np.int64)
    for n in range(count):
        for axis in range(3):
            path[n, axis] = kept[n, axis] = path_vox[n, axis]
    legs = np.empty((count + 1, 3), np.int64)
    changed = True
    while changed:
        changed = False
        corners = _corners_up_to(path, count)
        last, count = count - 1, 1
        n = 0
        while n < last:
            far = n + 1
            for m in range(last, n + 1, -1):
                away = 0
                for axis in range(3):
                    away += abs(path[m, axis] - path[n, axis])
                stairs = corners[m - 1] - corners[n] > _MOST_CORNERS
                if (away < m - n or stairs) and _three_legs(space, path[n], path[m], legs):
                    for leg in range(away):
                        for axis in range(3):
                            kept[count + leg, axis] = legs[leg, axis]
                    count += away
                    far = m
                    changed = True
                    break
            if far == n + 1:
                for axis in range(3):
                    kept[count, axis] = path[far, axis]
                count += 1
            n = far
        path, kept = kept, path
    straight = np.empty((count, 3), np.int32)
    for n in range(count):
        for axis in range(3):
            straight[n, axis] = path[n, axis]
    return straight


@kernel
def _corners_up_to(path: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """Return (count,) how many corners the first cells of a path have up to each."""
    corners = np.zeros(count, np.int64)
    for n in range(1, count - 1):
        corners[n] = corners[n - 1]
        for axis in range(3):
            if path[n + 1, axis] - path[n, axis] != path[n, axis] - path[n - 1, axis]:
                corners[n] += 1
                break
    return corners


@leaf_kernel
def _three_legs(
    space: CollisionSpace, start: NDArray[np.int64], goal: NDArray[np.int64], out: NDArray[np.int64]
) -> bool:
    """Write the cells after ``start`` of a free path that runs along each axis once; return whether there is one."""
    for first, second, third in ((2, 0, 1), (2, 1, 0), (0, 1, 2), (1, 0, 2), (0, 2, 1), (1, 2, 0)):
        x, y, z = start[0], start[1], start[2]
        count = 0
        free = True
        for axis in (first, second, third):
            gap = goal[axis] - start[axis]
            step = 1 if gap > 0 else -1
            for _ in range(abs(gap)):
                if axis == 0:
                    x += step
                elif axis == 1:
                    y += step
                else:
                    z += step
                if not placement_is_free(space, x, y, z):
                    free = False
                    break
                out[count, 0], out[count, 1], out[count, 2] = x, y, z
                count += 1
            if not free:
                break
        if free:
            return True
    return False


def with_room(space: CollisionSpace, path_vox: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return a straightened path between the same ends, wherever it can a cell away from what is at its sides.

    ``path_vox``: (N, 3) int32, unit moves over free placements. Returns (M, 3) int32, unit moves over free placements.
    """
    wide = widened(space)
    if not which_free(wide, path_vox).all():
        path_vox = roomy_path(space, wide, path_vox)
    has_room = which_free(wide, path_vox)
    cuts = np.flatnonzero(has_room[1:] != has_room[:-1]) + 1
    starts = (0, *cuts.tolist())
    parts = zip(starts, np.split(path_vox, cuts), strict=True)
    return np.concatenate([straightened(wide if has_room[start] else space, part) for start, part in parts])


def widened(space: CollisionSpace) -> CollisionSpace:
    """Return the rule for a load that is one cell wider to each side on plan."""
    return space._replace(boxes=space.boxes + np.array([-1, -1, 0, 1, 1, 0], np.int32))
