"""The transit clearance of a part, as whole cells on every side.

Between its departure, straight up from the yard, and its gate a part keeps this distance from everything, including the
ground and the site boundary. Its rope keeps ``rope_clearance_m`` from everything higher than its lower end. Where these
rules are defaults, a lift may keep less.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.grid.frame import whole_cells
from bimvox.site.collision import CollisionSpace
from bimvox.site.default_rules import ALL_KEPT, SMALLER_CLEARANCES_M, Kept
from bimvox.site.site import Site

CLEARANCES = Kept._fields
"""The rules about a lift in transit that can give way."""


def margin_vox(site: Site, kept: Kept = ALL_KEPT) -> int:
    """Return the transit clearance in whole cells, for a lift that keeps less if the rule gives way."""
    return _whole(site, site.rules.kept_m("transit_clearance_m", kept))


def rope_margin_vox(site: Site, kept: Kept = ALL_KEPT) -> int:
    """Return the transit clearance of hook and rope in whole cells; the arguments are those of ``margin_vox``."""
    return _whole(site, site.rules.kept_m("rope_clearance_m", kept))


def smaller_clearances(site: Site) -> tuple[tuple[Kept, ...], ...]:
    """Return what a lift may keep instead of the rules' clearances; none if they do not give way.

    Each row has one clearance of the load, and in it the rope's. The larger ones come first in both.
    """
    loads_m, ropes_m = (_levels_m(site, rule) for rule in CLEARANCES)
    rows = (tuple(Kept(load_m, rope_m) for rope_m in ropes_m if (load_m, rope_m) != ALL_KEPT) for load_m in loads_m)
    return tuple(row for row in rows if row)


def _levels_m(site: Site, rule: str) -> tuple[float | None, ...]:
    """Return None, which is the rule's clearance, and the smaller ones if it gives way, each of fewer cells."""
    levels: list[float | None] = [None]
    cells = _whole(site, getattr(site.rules, rule))
    for smaller_m in SMALLER_CLEARANCES_M if rule in site.rules.gives_way else ():
        if _whole(site, smaller_m) < cells:
            levels.append(smaller_m)
            cells = _whole(site, smaller_m)
    return tuple(levels)


def _whole(site: Site, distance_m: float) -> int:
    return whole_cells(distance_m, site.frame.voxel_size_m)


def in_transit(space: CollisionSpace, margin: int) -> CollisionSpace:
    """Return a collision rule whose boxes are grown on every side by ``margin`` cells."""
    if margin == 0:
        return space
    grown = space.boxes + np.array([-margin] * 3 + [margin] * 3, np.int32)
    return space._replace(boxes=grown)


def grown_cells(cells: NDArray[np.int32], margin: int) -> NDArray[np.int32]:
    """Return (N, 3) int32 cells and all cells up to ``margin`` cells away on each axis, in ascending order."""
    if margin == 0 or len(cells) == 0:
        return cells
    low = cells.min(axis=0) - margin
    dense = np.zeros(cells.max(axis=0) - low + margin + 1, np.bool_)
    dense[tuple((cells - low).T)] = True
    for axis in range(3):
        lines = np.moveaxis(dense, axis, 0)
        before = lines.copy()
        for step in range(1, margin + 1):
            lines[step:] |= before[:-step]
            lines[:-step] |= before[step:]
    grown: NDArray[np.int32] = (np.argwhere(dense) + low).astype(np.int32)
    return grown
