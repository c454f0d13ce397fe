"""The exact distance-to-go: fewest unit moves to the target from every free placement."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.env.actions import ACTION_COUNT, MOVES
from bimvox.site.collision import CollisionSpace, placement_is_free

UNREACHABLE = -1
"""Entry of a distance field from which the target cannot be reached."""

FARTHEST = 2**15 - 1
"""Largest distance of a field; anything farther counts as unreachable (int16 halves the memory of a large site)."""


@kernel
def distance_field(space: CollisionSpace, target: NDArray[np.int32]) -> NDArray[np.int16]:
    """Return the (X, Y, Z) int16 moves to a target, (3,) int32, by breadth-first search.

    ``UNREACHABLE`` if there is no path or the placement is not free; all cells are if the target is not free.
    """
    nx, ny, nz = space.table.shape[0] - 1, space.table.shape[1] - 1, space.table.shape[2] - 1
    unseen, blocked = np.int16(-3), np.int16(-2)
    field = np.full((nx, ny, nz), unseen, np.int16)
    if placement_is_free(space, target[0], target[1], target[2]):
        frontier = np.empty((1024, 3), np.int32)
        upcoming = np.empty((1024, 3), np.int32)
        frontier[0] = target
        count = 1
        field[target[0], target[1], target[2]] = 0
        distance = 0
        while count > 0 and distance < FARTHEST:
            distance += 1
            found = 0
            if upcoming.shape[0] < ACTION_COUNT * count:
                upcoming = np.empty((2 * ACTION_COUNT * count, 3), np.int32)
            for c in range(count):
                for a in range(ACTION_COUNT):
                    x, y, z = frontier[c, 0] + MOVES[a, 0], frontier[c, 1] + MOVES[a, 1], frontier[c, 2] + MOVES[a, 2]
                    if x < 0 or y < 0 or z < 0 or x >= nx or y >= ny or z >= nz or field[x, y, z] != unseen:
                        continue
                    if placement_is_free(space, x, y, z):
                        field[x, y, z] = distance
                        upcoming[found, 0], upcoming[found, 1], upcoming[found, 2] = x, y, z
                        found += 1
                    else:
                        field[x, y, z] = blocked
            frontier, upcoming = upcoming, frontier
            count = found
    for x in range(nx):
        for y in range(ny):
            for z in range(nz):
                if field[x, y, z] < 0:
                    field[x, y, z] = UNREACHABLE
    return field
