"""The collision rule for a load that turns with the jib: its place is free if it is free at every heading."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bimvox.kept import kept
from bimvox.site.collision import HOOK_FORBIDDEN, NOTHING_CLEARED, CollisionSpace, placement_is_free
from bimvox.site.component import Component, IntVec, Shape
from bimvox.site.shape import turning_columns
from bimvox.site.site import Site
from bimvox.site.transit_clearance import in_transit
from bimvox.site.zones import hooks_with_load_over

_MOST_BANDS = 24


@kept
def turning_shape(component: Component) -> Shape:
    """Return the cells around a part at every heading, relative to its reference cell: a cylinder about its hook line.

    Its boxes overlap none of each other and reach a little further, so that there are few of them.
    """
    columns = turning_columns(component.shape, component.hook_line_vox, 0)
    height = component.shape.size_vox[2]
    rows = np.unique(columns[:, 1])
    boxes = []
    for band in np.array_split(rows, min(len(rows), _MOST_BANDS)):
        own = columns[(columns[:, 1] >= band[0]) & (columns[:, 1] <= band[-1]), 0]
        boxes.append((own.min(), band[0], 0, own.max() + 1, band[-1] + 1, height))
    layers = [np.column_stack([columns, np.full(len(columns), k)]) for k in range(height)]
    return Shape(np.concatenate(layers).astype(np.int32), np.array(boxes, np.int32))


def any_heading_space(site: Site, component: Component, space: CollisionSpace, margin: int) -> CollisionSpace:
    """Return the collision rule for a load at any heading, its boxes grown by a margin, nothing cleared."""
    shape = turning_shape(component)
    floor = space.hook_floor
    if site.no_load is not None:
        floor = np.where(hooks_with_load_over(site.no_load, replace(component, shape=shape)), HOOK_FORBIDDEN, floor)
    low, cleared = NOTHING_CLEARED
    bare = space._replace(boxes=shape.boxes, hook_floor=floor, cleared_low=low, cleared=cleared)
    return in_transit(bare, margin)


def turning_space(
    site: Site, component: Component, space: CollisionSpace, start_vox: IntVec, margin: int
) -> CollisionSpace | None:
    """Return the collision rule of a transit in which a load turns with the jib.

    From the start the load goes straight up in the heading that it has there, until it may turn: this column is
    cleared, and its hook may leave it only above.

    Args:
        site: The site.
        component: The part.
        space: The rule for its transit in its final heading.
        start_vox: Where the transit starts.
        margin: The clearance that it keeps, in whole cells.

    Returns:
        The rule; None if the load can turn nowhere above its start.
    """
    turning = any_heading_space(site, component, space, margin)
    x, y, z = start_vox
    while not placement_is_free(turning, x, y, z):
        if z >= site.shape[2] or not placement_is_free(space, x, y, z):
            return None
        z += 1
    hook = np.array((x, y, z)) + component.hook_offset_vox
    around = tuple(slice(max(0, n - 1), n + 2) for n in hook[:2].tolist())
    floor: NDArray[np.int32] = np.array(turning.hook_floor)
    floor[around] = np.maximum(floor[around], hook[2])
    low, cleared = np.array(start_vox, np.int32), np.ones((1, 1, z - start_vox[2]), np.bool_)
    return turning._replace(hook_floor=floor, cleared_low=low, cleared=cleared)
