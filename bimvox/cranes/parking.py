"""Parking places: a crane waits there, jib turned aside and empty hook raised, so that another crane can work."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bimvox.kept import kept
from bimvox.motion.swept import HookEnd, in_cell
from bimvox.site.collision import HOOK_FORBIDDEN, CollisionSpace
from bimvox.site.site import Site

KEPT_PARKINGS = 5
"""Places at which an empty hook may wait for a lift: so many are tried."""
_SECTORS = 24
_SHARES = (0.0, 0.5)
"""Where the hook may wait in a sector, as shares of its columns from the nearest to the furthest."""
_OFF_VOX = 3.0
"""Distance from the smallest radius at which the hook can slew: columns nearer to it are only partly in reach."""


def drawn_up(site: Site, rule: CollisionSpace, end_vox: HookEnd) -> NDArray[np.int32]:
    """Return the highest cell of the slings' lower end over a column."""
    x, y, _ = in_cell(end_vox)
    return np.array([x, y, _top(site, rule)[x, y]], np.int32)


def _top(site: Site, rule: CollisionSpace) -> NDArray[np.int32]:
    top = np.full(rule.hook_floor.shape, site.shape[2] - 1, np.int32)
    return np.minimum(top, rule.hook_ceiling) if rule.hook_ceiling.size else top


def parking_cells(site: Site, number: int, rule: CollisionSpace, sectors: int = _SECTORS) -> list[NDArray[np.int32]]:
    """Return cells of the slings' lower end at which a crane can wait, in every direction, with the hook raised."""
    top, (columns, ends) = _top(site, rule), _by_sector(site, number, sectors)
    free = ((rule.hook_floor < HOOK_FORBIDDEN) & (rule.hook_floor <= top))[columns[:, 0], columns[:, 1]]
    cells = []
    for first, end in pairwise(ends):
        own = first + np.flatnonzero(free[first:end])
        for share in _SHARES if len(own) else ():
            x, y = columns[own[int(share * (len(own) - 1))]].tolist()
            cells.append(np.array([x, y, top[x, y]], np.int32))
    return cells


@kept
def _by_sector(site: Site, number: int, sectors: int) -> tuple[NDArray[np.int64], list[int]]:
    """Return (N, 2) columns where the hook can slew by sector, the nearest first, and where each sector begins."""
    columns = np.argwhere(np.ones(site.shape[:2], np.bool_))
    base_m = np.array(site.cranes[number].base_m[:2])
    from_base_m = np.array(site.frame.origin_m[:2]) + site.frame.voxel_size_m * (columns + 0.5) - base_m
    radius_m, angle = np.hypot(*from_base_m.T), np.arctan2(*from_base_m.T[::-1])
    nearest_m = site.cranes[number].min_radius_m + _OFF_VOX * site.frame.voxel_size_m
    sector = np.floor((angle + np.pi) / (2.0 * np.pi) * sectors).astype(np.int64) % sectors
    order = np.lexsort((radius_m, sector))
    order = order[radius_m[order] >= nearest_m]
    return columns[order], [0, *np.searchsorted(sector[order], np.arange(sectors), side="right").tolist()]
