"""Hook columns at which a luffing jib and its counterweight are clear of everything.

The hook column determines slew and luff angle, and so the position of the whole jib. So the jib's collisions are one
more map of hook columns, like reach and rope. Along the ray from the slewing axis to the column, the jib's underside
must be above everything; on the other side of the axis, so must the counterweight's.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from hashlib import sha256
from weakref import ref

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from bimvox.compiled import kernel
from bimvox.crane.luffing import LuffingJib


def jib_blocked(
    jib: LuffingJib,
    base_m: tuple[float, float, float],
    origin_m: tuple[float, float, float],
    voxel_size_m: float,
    top: NDArray[np.int32],
    own_m: float,
    reach_m: tuple[float, float],
) -> NDArray[np.bool_]:
    """Return the (X, Y) columns over which the hook may not be because jib or counterweight would hit something.

    Args:
        jib: The jib.
        base_m: Foot of the slewing axis.
        origin_m: Lowest corner of the grid.
        voxel_size_m: Edge of a cell.
        top: (X, Y) int32, one above the highest occupied cell of each column.
        own_m: Half the edge of the mast or the undercarriage; cells there are the crane itself.
        reach_m: Smallest and largest radius that matters.
    """
    key = _Heights(sha256(np.ascontiguousarray(top).data).digest(), ref(top))
    return _jib_blocked(jib, base_m, origin_m, voxel_size_m, key, own_m, reach_m)


@dataclass(frozen=True, slots=True)
class _Heights:
    """A height map as a key.

    Attributes:
        digest: Of its cells.
        cells: The map, which the key does not keep alive.
    """

    digest: bytes
    cells: ref[NDArray[np.int32]] = field(compare=False)


@lru_cache(maxsize=32)  # lift after lift, hook and load, their ways and their ends: few maps are new
def _jib_blocked(
    jib: LuffingJib,
    base_m: tuple[float, float, float],
    origin_m: tuple[float, float, float],
    voxel_size_m: float,
    heights: _Heights,
    own_m: float,
    reach_m: tuple[float, float],
) -> NDArray[np.bool_]:
    top = heights.cells()
    assert top is not None
    # The jib covers the cells around its ray: the map is widened by its half width and one cell.
    wide = 1 + 2 * int(np.ceil((jib.width_m / 2.0) / voxel_size_m + 1.0))
    tail_wide = 1 + 2 * int(np.ceil((jib.tail_width_m / 2.0) / voxel_size_m + 1.0))
    over = _without_own(top, base_m, origin_m, voxel_size_m, own_m)
    blocked: NDArray[np.bool_] = _blocked(
        np.ascontiguousarray(maximum_filter(over, size=wide, mode="constant")).astype(np.int32),
        np.ascontiguousarray(maximum_filter(over, size=tail_wide, mode="constant")).astype(np.int32),
        np.array([*base_m[:2], *origin_m, voxel_size_m]),
        np.array([jib.pivot_offset_m, jib.pivot_height_m, jib.length_m, *jib.luff_rad]),
        np.array([jib.tail_radius_m, jib.tail_low_m]),
        np.array(reach_m),
    )
    blocked.setflags(write=False)
    return blocked


def _without_own(
    top: NDArray[np.int32],
    base_m: tuple[float, float, float],
    origin_m: tuple[float, float, float],
    voxel_size_m: float,
    own_m: float,
) -> NDArray[np.int32]:
    """Return the height map without the crane itself."""
    low = [int(np.floor((base_m[i] - own_m - origin_m[i]) / voxel_size_m)) - 1 for i in (0, 1)]
    high = [int(np.ceil((base_m[i] + own_m - origin_m[i]) / voxel_size_m)) + 1 for i in (0, 1)]
    over = top.copy()
    over[max(0, low[0]) : max(0, high[0]), max(0, low[1]) : max(0, high[1])] = 0
    return over


@kernel
def _blocked(
    top: NDArray[np.int32],
    tail_top: NDArray[np.int32],
    place: NDArray[np.float64],
    jib: NDArray[np.float64],
    tail: NDArray[np.float64],
    reach: NDArray[np.float64],
) -> NDArray[np.bool_]:
    nx, ny = top.shape
    base_x, base_y, origin_x, origin_y, origin_z, size = place
    offset, pivot, length, lowest, highest = jib
    blocked = np.zeros((nx, ny), np.bool_)
    highest_m, highest_tail_m = origin_z + top.max() * size, origin_z + tail_top.max() * size
    for i in range(nx):
        for j in range(ny):
            dx = origin_x + (i + 0.5) * size - base_x
            dy = origin_y + (j + 0.5) * size - base_y
            radius = np.sqrt(dx * dx + dy * dy)
            if radius < reach[0] - size or radius > reach[1] + size or radius < 1e-6:
                continue
            ux, uy = dx / radius, dy / radius
            # A column represents hooks up to one cell further out, where the jib is lower.
            share = min(max((radius + size - offset) / length, np.cos(highest)), np.cos(lowest))
            slope = np.sqrt(1.0 - share * share) / share
            steps = int(np.ceil((radius + size) / (0.5 * size)))
            for n in range(steps + 1):
                at = n * 0.5 * size
                if at < offset:
                    continue
                lowest_m = max(pivot + (at - offset - size) * slope, pivot - size) - size
                if highest_m <= lowest_m:
                    break  # it rises: everything is below it from here on
                x = int(np.floor((base_x + ux * at - origin_x) / size))
                y = int(np.floor((base_y + uy * at - origin_y) / size))
                if x < 0 or y < 0 or x >= nx or y >= ny:
                    continue
                if top[x, y] > 0 and origin_z + top[x, y] * size > lowest_m:
                    blocked[i, j] = True
                    break
            if highest_tail_m <= tail[1]:
                continue
            steps = int(np.ceil(tail[0] / (0.5 * size)))
            for n in range(steps + 1):
                if blocked[i, j]:
                    break
                at = n * 0.5 * size
                x = int(np.floor((base_x - ux * at - origin_x) / size))
                y = int(np.floor((base_y - uy * at - origin_y) / size))
                if x < 0 or y < 0 or x >= nx or y >= ny:
                    continue
                if tail_top[x, y] > 0 and origin_z + tail_top[x, y] * size > tail[1]:
                    blocked[i, j] = True
    return blocked
