"""What is beside a part that is upended or turned, leaves the yard straight up, or goes down to its place.

These clearances follow from where a part lies and how it goes down. So they are measured, in whole cells, and a lift
that cannot keep the rule's keeps as much as was measured.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from bimvox.grid.frame import whole_cells
from bimvox.grid.summed_area import summed_area_table
from bimvox.records.lift import YardPlace
from bimvox.site.collision import clearance_vox
from bimvox.site.component import Component
from bimvox.site.default_rules import REST_ZONE_M
from bimvox.site.site import Site


@dataclass(frozen=True, slots=True, eq=False)
class Column:
    """What counts beside a load on its way straight up from where it rests, or down to it.

    What is beside the part at rest does not count up to ``REST_ZONE_M`` above it, nor what is lower than the part.

    Attributes:
        low: (3,) lowest cell of the window that is looked at.
        is_cut: (2, 2) whether the window ends, along x and y, before the site does: below, above.
        taken: (X, Y, Z) what counts in the window.
        table: (X + 1, Y + 1, Z + 1) its summed-area table.
        asked_vox: The clearance of the rules, cells.
    """

    low: NDArray[np.int64]
    is_cut: NDArray[np.bool_]
    taken: NDArray[np.bool_]
    table: NDArray[np.int32]
    asked_vox: int

    def which_free(self, boxes: NDArray[np.int32], places: NDArray[np.int32], apart_vox: int) -> NDArray[np.bool_]:
        """Return at which of (N, 3) placements (B, 6) boxes keep so many cells from what counts."""
        size = np.array(self.table.shape) - 1
        first = places[:, None] + boxes[None, :, :3] - apart_vox - self.low
        last = places[:, None] + boxes[None, :, 3:] + apart_vox - self.low
        outside = ((first[..., :2] < 0) & self.is_cut[0]) | ((last[..., :2] > size[:2]) & self.is_cut[1])
        x0, y0, z0 = np.moveaxis(np.clip(first, 0, size), -1, 0)
        x1, y1, z1 = np.moveaxis(np.clip(last, 0, size), -1, 0)
        t = self.table
        met = t[x1, y1, z1] - t[x0, y1, z1] - t[x1, y0, z1] - t[x1, y1, z0]
        met += t[x0, y0, z1] + t[x0, y1, z0] + t[x1, y0, z0] - t[x0, y0, z0]
        free: NDArray[np.bool_] = ~((met != 0) | outside.any(axis=-1)).any(axis=1)
        return free

    def kept_vox(self, boxes: NDArray[np.int32], places: NDArray[np.int32]) -> int:
        """Return how many cells the boxes keep at all of (N, 3) placements, at most those that are asked for."""
        asked = range(self.asked_vox, 0, -1)
        return next((apart for apart in asked if self.which_free(boxes, places, apart).all()), 0)

    def near(self, boxes: NDArray[np.int32], places: NDArray[np.int32]) -> NDArray[np.int32]:
        """Return the (N, 3) cells that count and are nearer to the boxes than the rules ask for."""
        close = np.zeros_like(self.taken)
        for place in places:
            grown = np.concatenate([boxes[:, :3] - self.asked_vox, boxes[:, 3:] + self.asked_vox], axis=1)
            for box in np.maximum(grown + np.tile(place - self.low, 2), 0).tolist():
                close[box[0] : box[3], box[1] : box[4], box[2] : box[5]] = True
        cells: NDArray[np.int32] = (np.argwhere(close & self.taken) + self.low).astype(np.int32)
        return cells


def column_of(site: Site, counts: NDArray[np.uint16], rest: NDArray[np.int32], asked_vox: int, room_vox: int) -> Column:
    """Return what counts beside a load above where it rests.

    Args:
        site: The site.
        counts: (X, Y, Z) how many objects occupy each cell.
        rest: (N, 3) the cells of the part at rest.
        asked_vox: The clearance of the rules, cells.
        room_vox: How far around the rest the load may be on plan.
    """
    reach, shape = asked_vox + room_vox, np.array(site.shape[:2])
    first, last = rest.min(axis=0)[:2] - reach, rest.max(axis=0)[:2] + 1 + reach
    low, high = np.maximum(first, 0), np.minimum(last, shape)
    taken = counts[low[0] : high[0], low[1] : high[1]] > 0
    taken[:, :, : rest[:, 2].min()] = False
    near = np.zeros(high - low, np.bool_)
    for x, y in np.unique(rest[:, :2] - low, axis=0).tolist():
        near[max(0, x - asked_vox) : x + asked_vox + 1, max(0, y - asked_vox) : y + asked_vox + 1] = True
    taken[near, : rest[:, 2].max() + 1 + whole_cells(REST_ZONE_M, site.frame.voxel_size_m)] = False
    is_cut = np.array([first > 0, last < shape])
    return Column(np.array([*low, 0], np.int64), is_cut, taken, summed_area_table(taken), asked_vox)


class Apart(NamedTuple):
    """How many cells a part keeps, at most those of the rules, and the (N, 3) cells that are nearer than those."""

    kept_vox: int
    near: NDArray[np.int32]


_NOTHING = np.zeros((0, 3), np.int32)


def departing(
    site: Site, counts: NDArray[np.uint16], component: Component, place: YardPlace, leaving: NDArray[np.int32]
) -> Apart:
    """Return what a part keeps straight up from the yard.

    ``leaving``: (N, 3) placements from the start of its transit until it has the clearance of transit.
    """
    asked = clearance_vox(site, "departure_clearance_m")
    start = np.array(place.transit_start_vox, np.int32)
    ways = [(component.shape.cells + start, component.shape.boxes, leaving)]
    if not place.is_upended:
        low = np.array(place.cell_vox, np.int32)
        heights = np.arange(1, place.rise_vox + 1 if place.turn else 1, dtype=np.int32)
        raised = low + np.column_stack([0 * heights, 0 * heights, heights])
        lain = place.shape.cells + low
        ways = [(lain, place.shape.boxes, raised), *(ways if place.turn else [(lain, ways[0][1], leaving)])]
    least = Apart(asked, _NOTHING)
    for rest, boxes, way in ways if asked else ():
        column = column_of(site, counts, rest, asked, 0)
        if len(way) and (kept_vox := column.kept_vox(boxes, way)) < least.kept_vox:
            least = Apart(kept_vox, column.near(boxes, way))
    return least


def upending(site: Site, counts: NDArray[np.uint16], component: Component, place: YardPlace) -> Apart:
    """Return what a part keeps while it is upended.

    What does not reach above its underside is under the ground or under it.
    """
    asked, low = clearance_vox(site, "upending_clearance_m"), place.cell_vox
    if not place.is_upended:
        return Apart(asked, _NOTHING)
    size_x, size_y, size_z = place.raising_size_vox(component)
    columns = np.argwhere(np.ones((size_x, size_y), np.bool_)) + np.array(low[:2])
    return _apart(site, counts, columns, (low[2], low[2] + size_z), asked, low[2])


def turning(site: Site, counts: NDArray[np.uint16], component: Component, place: YardPlace) -> Apart:
    """Return what a part keeps while it is turned in the yard."""
    asked, cells = clearance_vox(site, "turning_clearance_m"), place.turning_cells(component)
    if not len(cells):
        return Apart(asked, _NOTHING)
    (low, high), columns = (int(cells[:, 2].min()), int(cells[:, 2].max()) + 1), np.unique(cells[:, :2], axis=0)
    return _apart(site, counts, columns, (low, high), asked, 0)


def _apart(
    site: Site,
    counts: NDArray[np.uint16],
    columns: NDArray[np.int64] | NDArray[np.int32],
    heights: tuple[int, int],
    asked: int,
    from_vox: int,
) -> Apart:
    """Return what (N, 2) columns between two heights keep from everything but the ground and what is lower."""
    box = np.array([[*columns.min(axis=0), heights[0]], [*columns.max(axis=0) + 1, heights[1]]])
    first, last = np.maximum(box[0] - asked, 0), np.minimum(box[1] + asked, site.shape)
    x, y, z = (slice(int(a), int(b)) for a, b in zip(first, last, strict=True))
    inside = np.arange(first[2], last[2])
    taken = (counts[x, y, z] > 0) & (inside >= from_vox) & (inside > site.ground_vox[x, y, None])
    cells = (np.argwhere(taken) + first).astype(np.int32)
    if not len(cells):
        return Apart(asked, cells)
    on_plan = KDTree(columns).query(cells[:, :2], p=np.inf)[0] - 1.0
    apart_vox = np.maximum(on_plan, np.maximum(heights[0] - cells[:, 2] - 1, cells[:, 2] - heights[1])).clip(0.0)
    return Apart(min(asked, round(float(apart_vox.min()))), cells[apart_vox < asked])
