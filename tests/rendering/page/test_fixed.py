"""The slab of the page and the ground around it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from box_sites import box_site

from bimvox.rendering.page.document import NOTHING, boxes_record, slab_map, standing
from bimvox.rendering.page.geometry import Blob
from bimvox.site.ground import ground_cells
from bimvox.site.site import Site


def on_raised_ground(pit_layer: int) -> Site:
    """Return a site whose ground reaches up to layer 3, with a pit of 4 x 4 columns."""
    site = box_site([("a", (1, 1, 0), (2, 2, 1))])
    tops = np.full(site.shape[:2], 3, np.int32)
    tops[10:14, 10:14] = pit_layer
    ground = replace(site.blockers[0], cells=ground_cells(tops, site.shape))
    return replace(site, blockers=(ground, *site.blockers[1:]))


def filled(site: Site) -> np.ndarray:
    blob = Blob()
    (ground,) = [one for one in standing(site) if one.kind == "ground"]
    _, offset, count = boxes_record(site, ground, blob)["boxes"]
    boxes = np.frombuffer(blob.to_bytes(), "<u2", int(count), int(offset)).reshape(-1, 6)
    found = np.zeros(site.shape, bool)
    for x0, y0, z0, x1, y1, z1 in boxes.tolist():
        found[x0:x1, y0:y1, z0:z1] = True
    return found


def test_on_flat_ground_the_slab_is_all() -> None:
    site = box_site([("a", (1, 1, 0), (2, 2, 1))])
    assert not standing(site)
    assert (slab_map(site) != NOTHING).all()


def test_slab_and_boxes_show_all_the_ground_each_cell_once() -> None:
    for pit_layer in (0, 1, 5):
        site = on_raised_ground(pit_layer)
        slab = np.zeros(site.shape, bool)
        slab[:, :, site.yard_floor_vox - 1] = (slab_map(site) != NOTHING).T
        assert slab.sum() == np.prod(site.shape[:2]) - 16
        shown = filled(site)
        assert not (shown & slab).any()
        ground = np.zeros(site.shape, bool)
        ground[tuple(site.blockers[0].cells.T)] = True
        assert ((shown | slab) == ground).all()
