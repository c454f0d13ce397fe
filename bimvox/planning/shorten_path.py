"""Shortening of a cell path: over the cells that it visited, and by straight legs over free placements."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.site.collision import CollisionSpace, placement_is_free


@kernel
def shortest_of_visited(path_vox: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return a shortest path between the ends of a path that uses only the cells that it visited.

    Args:
        path_vox: (N, 3) int32, unit moves.

    Returns:
        (M, 3) int32, M <= N, unit moves, the same ends.
    """
    count = path_vox.shape[0]
    low = path_vox[0].copy()
    high = path_vox[0].copy()
    for n in range(count):
        for axis in range(3):
            low[axis] = min(low[axis], path_vox[n, axis])
            high[axis] = max(high[axis], path_vox[n, axis])
    ny, nz = np.int64(high[1] - low[1] + 3), np.int64(high[2] - low[2] + 3)
    keys = np.empty(count, np.int64)
    for n in range(count):
        keys[n] = ((path_vox[n, 0] - low[0] + 1) * ny + path_vox[n, 1] - low[1] + 1) * nz + path_vox[n, 2] - low[2] + 1
    visited = np.unique(keys)
    before = np.full(visited.size, -1, np.int64)
    queue = np.empty(visited.size, np.int64)
    goal = np.searchsorted(visited, keys[count - 1])
    queue[0] = goal
    before[goal] = goal
    first, size = 0, 1
    start = np.searchsorted(visited, keys[0])
    while first < size and before[start] < 0:
        here = queue[first]
        first += 1
        for move in (-ny * nz, ny * nz, -nz, nz, np.int64(-1), np.int64(1)):
            there = np.searchsorted(visited, visited[here] + move)
            if there < visited.size and visited[there] == visited[here] + move and before[there] < 0:
                before[there] = here
                queue[size] = there
                size += 1
    kept = np.empty((count, 3), np.int32)
    at, length = start, 0
    while True:
        key = visited[at]
        kept[length, 0] = key // (ny * nz) - 1 + low[0]
        kept[length, 1] = key // nz % ny - 1 + low[1]
        kept[length, 2] = key % nz - 1 + low[2]
        length += 1
        if at == goal:
            break
        at = before[at]
    return kept[:length].copy()


@kernel
def straightened(space: CollisionSpace, path_vox: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return a path without detours: from each cell straight to the farthest one that three legs reach.

    A cut runs along each axis once, in one of the six orders, over free placements, so it is as short as possible. It
    is used if it is shorter than the path. Repeated until nothing is cut.

    Args:
        space: The collision rule.
        path_vox: (N, 3) int32, unit moves over free placements.

    Returns:
        (M, 3) int32, M <= N, unit moves over free placements, the same ends.
    """
    path = path_vox.copy()
    legs = np.empty((path.shape[0] + 1, 3), np.int32)
    changed = True
    while changed:
        changed = False
        kept = np.empty_like(path)
        kept[0] = path[0]
        count = 1
        n = 0
        while n < path.shape[0] - 1:
            far = n + 1
            for m in range(path.shape[0] - 1, n + 1, -1):
                away = 0
                for axis in range(3):
                    away += abs(path[m, axis] - path[n, axis])
                if away < m - n and _three_legs(space, path[n], path[m], legs):
                    kept[count : count + away] = legs[:away]
                    count += away
                    far = m
                    changed = True
                    break
            if far == n + 1:
                kept[count] = path[far]
                count += 1
            n = far
        path = kept[:count].copy()
    return path


@leaf_kernel
def _three_legs(
    space: CollisionSpace, start: NDArray[np.int32], goal: NDArray[np.int32], out: NDArray[np.int32]
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
