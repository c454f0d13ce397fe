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
from bimvox.site.default_rules import SMALLER_CLEARANCES_M
from bimvox.site.site import Site

CLEARANCES = ("transit_clearance_m", "rope_clearance_m")
"""The rules about a lift in transit that can give way."""


def margin_vox(site: Site, clearance_m: float | None = None) -> int:
    """Return the transit clearance in whole cells, for a lift that keeps ``clearance_m`` if the rule gives way."""
    return _whole(site, site.rules.kept_m("transit_clearance_m", clearance_m))


def rope_margin_vox(site: Site, clearance_m: float | None = None) -> int:
    """Return the transit clearance of hook and rope in whole cells; the arguments are those of ``margin_vox``."""
    return _whole(site, site.rules.kept_m("rope_clearance_m", clearance_m))


def smaller_clearances_m(site: Site) -> tuple[float, ...]:
    """Return what a lift may keep instead of the rules' clearances, the largest first; none if they do not give way."""
    rules = site.rules
    most_m = max(rules.kept_m(rule, None) - rules.kept_m(rule, 0.0) for rule in CLEARANCES)
    return tuple(one for one in SMALLER_CLEARANCES_M if one < most_m)


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
