"""Drawing a layout: targets, places in the yard, obstructions.

Each is drawn uniformly from what is free at that moment: targets first, then the components' places in serial order
(fixed ones before all others), then obstructions.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.env.pool import random_below
from bimvox.env.problem import distance_field
from bimvox.grid.summed_area import summed_area_table
from bimvox.paper.env.component import HUNG_LAYER, STORED_LAYER
from bimvox.paper.env.dynamics import (
    clearance_of,
    length_of,
    lying,
    paint,
    paint_built,
    paint_fixed,
    paint_stored,
)
from bimvox.paper.env.rules import Drawing, SpecArrays
from bimvox.paper.env.state import AIR, FIRST_COMPONENT, OBSTRUCTION, SiteState

_TRIES = 100
_TRIES_PER_OBSTRUCTION = 64
_TRIES_BEFORE_COUNTING = 16


@kernel
def draw_layout(rules: SpecArrays, drawing: Drawing, site: SiteState, generator: NDArray[np.uint64]) -> bool:
    """Draw ``stored``, ``target`` and ``obstructions`` of a site, and return whether that succeeded.

    It fails if the yard has no room, or if a component has no path. If obstructions or several targets are drawn, a
    layout without a path is drawn again; after a hundred such layouts, one without obstructions. ``cells`` and
    ``table`` of the site are scratch; ``generator`` is the (1,) uint64 state of the random generator.
    """
    doubtful = drawing.most > 0 or (drawing.random_targets and drawing.group.max() > 0)
    for attempt in range(_TRIES + 1):
        drawn = _draw_once(rules, drawing, site, generator, attempt < _TRIES)
        if drawn and (not doubtful or every_component_has_a_way(rules, site)):
            return True
    return False


@kernel
def every_component_has_a_way(rules: SpecArrays, site: SiteState) -> bool:
    """Return whether each component can reach its target when those before it are assembled and the rest is stored.

    ``cells`` and ``table`` of the site are scratch.
    """
    paint_fixed(site)
    for i in range(rules.boxes.shape[0]):
        paint_stored(rules, site, i, FIRST_COMPONENT + i)
    for i in range(rules.boxes.shape[0]):
        paint_stored(rules, site, i, AIR)
        site.table[:] = summed_area_table(site.cells != AIR)
        field = distance_field(clearance_of(rules, site, i), site.target[i])
        if field[site.stored[i, 0], site.stored[i, 1], HUNG_LAYER] < 0:
            return False
        paint_built(rules, site, i, FIRST_COMPONENT + i)
    return True


@kernel
def _draw_once(
    rules: SpecArrays, drawing: Drawing, site: SiteState, generator: NDArray[np.uint64], with_obstructions: bool
) -> bool:
    site.obstructions[:] = drawing.obstructions
    site.target[:] = drawing.target
    paint_fixed(site)
    if drawing.random_targets and not _draw_targets(rules, drawing, site, generator):
        return False
    for i in range(rules.boxes.shape[0]):
        paint_built(rules, site, i, FIRST_COMPONENT + i)
    if not _draw_places(rules, drawing, site, generator):
        return False
    if with_obstructions and drawing.most > 0:
        _draw_obstructions(drawing, site, generator)
    return True


@leaf_kernel
def _draw_targets(rules: SpecArrays, drawing: Drawing, site: SiteState, generator: NDArray[np.uint64]) -> bool:
    """Move each group of targets to where it is free inside the construction area."""
    width, depth = drawing.area[2] - drawing.area[0], drawing.area[3] - drawing.area[1]
    for group in range(drawing.group.max() + 1):
        free = 0
        for dx in range(-width + 1, width):
            for dy in range(-depth + 1, depth):
                free += 1 if _group_fits(rules, drawing, site, group, dx, dy) else 0
        if free == 0:
            return False
        chosen = random_below(generator, free)
        for dx in range(-width + 1, width):
            for dy in range(-depth + 1, depth):
                if _group_fits(rules, drawing, site, group, dx, dy):
                    if chosen == 0:
                        _move_group(rules, drawing, site, group, dx, dy)
                    chosen -= 1
    return True


@leaf_kernel
def _group_fits(rules: SpecArrays, drawing: Drawing, site: SiteState, group: int, dx: int, dy: int) -> bool:
    """Return whether targets moved by (dx, dy) lie over the construction area, in cells that are free."""
    for i in range(rules.boxes.shape[0]):
        if drawing.group[i] != group:
            continue
        x, y, z = drawing.target[i, 0] + dx, drawing.target[i, 1] + dy, drawing.target[i, 2]
        u, v, w = x + rules.boxes[i, 3], y + rules.boxes[i, 4], z + rules.boxes[i, 5]
        if x < drawing.area[0] or y < drawing.area[1] or u > drawing.area[2] or v > drawing.area[3]:
            return False
        if not _is_air(site.cells, x, y, z, u, v, w):
            return False
    return True


@leaf_kernel
def _move_group(rules: SpecArrays, drawing: Drawing, site: SiteState, group: int, dx: int, dy: int) -> None:
    for i in range(rules.boxes.shape[0]):
        if drawing.group[i] == group:
            site.target[i, 0] = drawing.target[i, 0] + dx
            site.target[i, 1] = drawing.target[i, 1] + dy
            paint_built(rules, site, i, FIRST_COMPONENT + i)


@kernel
def _draw_places(rules: SpecArrays, drawing: Drawing, site: SiteState, generator: NDArray[np.uint64]) -> bool:
    """Lay every component into the yard."""
    for i in range(rules.boxes.shape[0]):
        if drawing.start[i, 0] >= 0:
            site.stored[i] = drawing.start[i]
            paint_stored(rules, site, i, FIRST_COMPONENT + i)
    nx, ny, _ = site.cells.shape
    for i in range(rules.boxes.shape[0]):
        if drawing.start[i, 0] >= 0:
            continue
        found = False
        for _ in range(_TRIES_BEFORE_COUNTING):
            x, y, axis = random_below(generator, nx), random_below(generator, ny), random_below(generator, 2)
            if may_lie(rules, drawing, site.cells, i, x, y, axis):
                site.stored[i, 0], site.stored[i, 1], site.stored[i, 2] = x, y, axis
                found = True
                break
        if not found and not _draw_place_by_counting(rules, drawing, site, i, generator):
            return False
        paint_stored(rules, site, i, FIRST_COMPONENT + i)
    return True


@leaf_kernel
def _draw_place_by_counting(
    rules: SpecArrays, drawing: Drawing, site: SiteState, component: int, generator: NDArray[np.uint64]
) -> bool:
    """Draw from the free places by counting them, for a yard with few."""
    nx, ny, _ = site.cells.shape
    free = 0
    for x in range(nx):
        for y in range(ny):
            for axis in range(2):
                free += 1 if may_lie(rules, drawing, site.cells, component, x, y, axis) else 0
    if free == 0:
        return False
    chosen = random_below(generator, free)
    for x in range(nx):
        for y in range(ny):
            for axis in range(2):
                if may_lie(rules, drawing, site.cells, component, x, y, axis):
                    if chosen == 0:
                        place = site.stored[component]
                        place[0], place[1], place[2] = x, y, axis
                    chosen -= 1
    return True


@leaf_kernel
def may_lie(
    rules: SpecArrays, drawing: Drawing, cells: NDArray[np.int16], component: int, x: int, y: int, axis: int
) -> bool:
    """Return whether a component has room in the yard, lying from (x, y) along an axis and hoisted from there."""
    if not drawing.yard[x, y] or (drawing.axis[component] >= 0 and drawing.axis[component] != axis):
        return False
    dx, dy = lying(length_of(rules, component), axis)
    if x + dx > drawing.yard.shape[0] or y + dy > drawing.yard.shape[1]:
        return False
    for u in range(x, x + dx):
        for v in range(y, y + dy):
            if not drawing.yard[u, v] or cells[u, v, STORED_LAYER] != AIR:
                return False
    box = rules.boxes[component]
    return _is_air(cells, x, y, HUNG_LAYER, x + box[3], y + box[4], HUNG_LAYER + box[5])


@leaf_kernel
def _draw_obstructions(drawing: Drawing, site: SiteState, generator: NDArray[np.uint64]) -> None:
    """Place obstructions in free cells; fewer if there is no room."""
    nx, ny, _ = site.cells.shape
    count = drawing.fewest + random_below(generator, drawing.most - drawing.fewest + 1)
    row = drawing.fixed
    for _ in range(count):
        for _ in range(_TRIES_PER_OBSTRUCTION):
            along_x = random_below(generator, 2) == 0
            dx, dy = (drawing.drawn_length, 1) if along_x else (1, drawing.drawn_length)
            x, y = random_below(generator, nx - dx + 1), random_below(generator, ny - dy + 1)
            z = 1 + drawing.drawn_height
            if _is_air(site.cells, x, y, 1, x + dx, y + dy, z):
                paint(site.cells, x, y, 1, x + dx, y + dy, z, OBSTRUCTION)
                box = site.obstructions[row]
                box[0], box[1], box[2], box[3], box[4], box[5] = x, y, 1, x + dx, y + dy, z
                row += 1
                break


@leaf_kernel
def _is_air(cells: NDArray[np.int16], x0: int, y0: int, z0: int, x1: int, y1: int, z1: int) -> bool:
    for x in range(x0, x1):
        for y in range(y0, y1):
            for z in range(z0, z1):
                if cells[x, y, z] != AIR:
                    return False
    return True
