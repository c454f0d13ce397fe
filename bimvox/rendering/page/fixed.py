"""The fixed things on a site: the slab with its areas, structure, obstructions."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.grid.frame import Label
from bimvox.grid.summed_area import boxes_of
from bimvox.rendering.page.blob import Blob
from bimvox.site.site import Blocker, Site

NOTHING, GROUND, AREA, YARD, ACCESS = range(5)
PROHIBITED = 8
"""Added to a column's value if a zone forbids the hook there."""


def slab_map(site: Site) -> NDArray[np.uint8]:
    """Return the label of the ground in every column, (Y, X) uint8: nothing where it is not as high as the yard."""
    slab = site.labels[:, :, 0]
    columns = np.full(slab.shape, GROUND, np.uint8)
    columns[slab == Label.AIR] = NOTHING
    columns[slab == Label.CONSTRUCTION_AREA] = AREA
    # `Site.yard` defines the yard; the labels of the slab need not repeat it.
    columns[(slab == Label.YARD) | (site.yard & (columns == GROUND))] = YARD
    if site.access is not None:
        columns[site.access & (columns != NOTHING)] = ACCESS
    columns[site.ground_vox != site.yard_floor_vox - 1] = NOTHING
    closed = [zone for zone in (site.prohibited, site.no_load) if zone is not None]
    if closed:
        columns[np.logical_or.reduce(closed) & (columns != NOTHING)] += PROHIBITED
    return np.ascontiguousarray(columns.T)


def standing(site: Site) -> tuple[Blocker, ...]:
    """Return the blockers other than obstructions: structure, terrain, and a mast without a crane."""
    return tuple(
        blocker
        for n, blocker in enumerate(site.blockers)
        if blocker.kind == "structure"
        or (blocker.kind == "crane" and not site.cranes)
        or (n == 0 and bool((blocker.cells[:, 2] > 0).any()))
    )


def obstructions(site: Site) -> tuple[Blocker, ...]:
    """Return the obstructions."""
    return tuple(blocker for blocker in site.blockers if blocker.kind == "obstruction")


def boxes_record(site: Site, blocker: Blocker, blob: Blob) -> dict[str, Any]:
    """Return the cells above the lowest layer as a few boxes, in cells; of the ground what the slab does not show."""
    cells = blocker.cells[blocker.cells[:, 2] > 0]
    if blocker.kind == "ground":
        cells, level = blocker.cells, site.yard_floor_vox - 1
        cells = cells[(cells[:, 2] != level) | (site.ground_vox[cells[:, 0], cells[:, 1]] != level)]
    boxes = np.zeros((0, 6), np.int32)
    if len(cells):
        low = cells.min(axis=0)
        dense = np.zeros(cells.max(axis=0) - low + 1, np.bool_)
        dense[tuple((cells - low).T)] = True
        boxes = boxes_of(dense) + np.tile(low, 2)
    return {"id": blocker.id, "kind": blocker.kind, "name": blocker.name, "boxes": blob.put(boxes.astype(np.uint16))}
