"""The transit clearance of a part, as whole cells on every side.

Between its departure, straight up from the yard, and its gate a part keeps this distance from everything, including the
ground and the site boundary. Its rope keeps ``rope_clearance_m`` from everything higher than its lower end.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.site.collision import CollisionSpace
from bimvox.site.site import Site


def margin_vox(site: Site) -> int:
    """Return the transit clearance, rounded up to whole cells."""
    return int(np.ceil(site.rules.transit_clearance_m / site.frame.voxel_size_m - 1e-9))


def rope_margin_vox(site: Site) -> int:
    """Return the transit clearance of hook and rope, rounded up to whole cells."""
    return int(np.ceil(site.rules.rope_clearance_m / site.frame.voxel_size_m - 1e-9))


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
