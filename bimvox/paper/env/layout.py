"""A layout: everything that may differ between two episodes on a site."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.env.pool import random_below
from bimvox.env.problem import distance_field
from bimvox.errors import PlanningError
from bimvox.grid.summed_area import summed_area_table
from bimvox.paper.env.dynamics import (
    clearance_of,
    length_of,
    lying,
    paint,
    paint_built,
    paint_fixed,
    paint_stored,
)
from bimvox.paper.env.spec import (
    AXES,
    HUNG_LAYER,
    STORED_LAYER,
    Box,
    ComponentKind,
    PaperSpec,
    YardPose,
    above_slab,
    overlap,
)
from bimvox.paper.env.state import (
    AIR,
    FIRST_COMPONENT,
    OBSTRUCTION,
    Drawing,
    SiteState,
    SpecArrays,
    drawing_of,
    empty_site,
    rules_of,
)
from bimvox.site.component import IntVec

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
            if _may_lie(rules, drawing, site.cells, i, x, y, axis):
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
                free += 1 if _may_lie(rules, drawing, site.cells, component, x, y, axis) else 0
    if free == 0:
        return False
    chosen = random_below(generator, free)
    for x in range(nx):
        for y in range(ny):
            for axis in range(2):
                if _may_lie(rules, drawing, site.cells, component, x, y, axis):
                    if chosen == 0:
                        place = site.stored[component]
                        place[0], place[1], place[2] = x, y, axis
                    chosen -= 1
    return True


@leaf_kernel
def _may_lie(
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


@dataclass(frozen=True, slots=True)
class PaperLayout:
    """Where everything is when an episode begins; components in the order of building.

    Attributes:
        starts: Place of each component in the yard.
        targets: Reference cell of each component when set.
        obstructions: Half-open boxes of cells, including the fixed ones of the site.
    """

    starts: tuple[YardPose, ...]
    targets: tuple[IntVec, ...]
    obstructions: tuple[Box, ...] = ()


class LayoutPool(NamedTuple):
    """P layouts as arrays for kernels; with P = 0 every episode draws its own.

    Attributes:
        stored: (P, n, 3) int64.
        target: (P, n, 3) int32.
        obstructions: (P, M, 6) int32.
    """

    stored: NDArray[np.int64]
    target: NDArray[np.int32]
    obstructions: NDArray[np.int32]


def random_layouts(spec: PaperSpec, count: int, seed: int) -> tuple[PaperLayout, ...]:
    """Draw layouts as episodes do; the same seed gives the same layouts.

    Raises:
        PlanningError: The yard has no room, or there is no path to the targets.
    """
    spec = spec.in_building_order()
    rules, drawing = rules_of(spec), drawing_of(spec)
    site = empty_site(spec, drawing, with_field=False)
    generator = random_words(seed, 1)
    layouts = []
    for _ in range(count):
        if not draw_layout(rules, drawing, site, generator):
            raise no_layout(spec)
        layouts.append(layout_of(site))
    return tuple(layouts)


def yard_layouts(spec: PaperSpec) -> tuple[PaperLayout, ...]:
    """Return a layout for every distinct transit start of a site with one component, ascending.

    A column along x and one along y from the same cell are the same start once upended: one layout represents both.
    Targets and obstructions are the fixed ones.

    Raises:
        ValueError: The site has several components.
    """
    if spec.count != 1:
        raise ValueError(f"components: {spec.count}; every start can be listed for one component only")
    rules, drawing = rules_of(spec), drawing_of(spec)
    site = empty_site(spec, drawing, with_field=False)
    site.obstructions[:] = drawing.obstructions
    paint_fixed(site)
    nx, ny, _ = spec.shape
    layouts = []
    for x in range(nx):
        for y in range(ny):
            axis = next((a for a in range(2) if _may_lie(rules, drawing, site.cells, 0, x, y, a)), None)
            if axis is not None:
                place = YardPose(x, y, AXES[axis])
                layouts.append(PaperLayout((place,), (spec.components[0].target_vox,), spec.obstructions))
    return tuple(layouts)


def layout_of(site: SiteState) -> PaperLayout:
    """Return the layout that a site holds."""
    return PaperLayout(
        tuple(YardPose(int(x), int(y), AXES[axis]) for x, y, axis in site.stored),
        tuple((int(x), int(y), int(z)) for x, y, z in site.target),
        tuple(
            ((int(b[0]), int(b[1]), int(b[2])), (int(b[3]), int(b[4]), int(b[5])))
            for b in site.obstructions
            if b[3] > b[0]
        ),
    )


def write_layout(spec: PaperSpec, layout: PaperLayout, site: SiteState) -> None:
    """Write a layout into the arrays of a site.

    Raises:
        ValueError: The layout does not fit the site.
    """
    check_layout(spec, layout)
    if len(layout.obstructions) > len(site.obstructions):
        raise ValueError(f"obstructions: {len(layout.obstructions)}, but there is room for {len(site.obstructions)}")
    site.stored[:] = [(place.x, place.y, AXES.index(place.axis)) for place in layout.starts]
    site.target[:] = layout.targets
    site.obstructions[:] = 0
    for row, (low, high) in enumerate(layout.obstructions):
        site.obstructions[row] = (*low, *high)


def pool_of_layouts(spec: PaperSpec, drawing: Drawing, layouts: Sequence[PaperLayout]) -> LayoutPool:
    """Return layouts as arrays; with none, every episode draws its own."""
    site = empty_site(spec, drawing, with_field=False)
    pool = LayoutPool(
        *(np.zeros((len(layouts), *a.shape), a.dtype) for a in (site.stored, site.target, site.obstructions))
    )
    for p, layout in enumerate(layouts):
        write_layout(spec, layout, site)
        pool.stored[p], pool.target[p], pool.obstructions[p] = site.stored, site.target, site.obstructions
    return pool


def check_layout(spec: PaperSpec, layout: PaperLayout) -> None:
    """Refuse a layout that does not fit a site whose components are in the order of building.

    Raises:
        ValueError: The message begins with the name of the field.
    """
    if len(layout.starts) != spec.count or len(layout.targets) != spec.count:
        raise ValueError(f"starts, targets: {len(layout.starts)} and {len(layout.targets)} for {spec.count} components")
    taken: list[tuple[str, Box]] = [(f"obstructions[{m}]", box) for m, box in enumerate(layout.obstructions)]
    for i, (part, place, target) in enumerate(zip(spec.components, layout.starts, layout.targets, strict=True)):
        boxes = [(f"starts[{i}]", place.box(part.length_vox)), (f"targets[{i}]", part.box_at(target))]
        hung = part.box_at((place.x, place.y, HUNG_LAYER))
        for name, box in [*boxes, (f"starts[{i}]", hung)]:
            if not above_slab(box, spec.shape):
                raise ValueError(f"{name}: {box} is not above the slab and inside {spec.shape}")
            hit = next((other for other, there in taken if overlap(box, there)), None)
            if hit and not (box is hung and not hit.startswith("obstructions")):
                raise ValueError(f"{name}: shares a cell with {hit}")
        (x0, y0, _), (x1, y1, _) = boxes[0][1]
        if not all(spec.in_yard(x, y) for x in range(x0, x1) for y in range(y0, y1)):
            raise ValueError(f"starts[{i}]: {place} is not in the yard")
        if part.kind is ComponentKind.BEAM and place.axis != part.axis:
            raise ValueError(f"starts[{i}]: {place} does not lie along {part.axis}, and a beam is never turned")
        taken += boxes


def random_words(seed: int, count: int) -> NDArray[np.uint64]:
    """Return (count,) uint64 states of random generators; the first few are the same for any count."""
    return np.random.SeedSequence(seed).generate_state(count, np.uint64).astype(np.uint64, copy=False)


def no_layout(spec: PaperSpec) -> PlanningError:
    """Return the error for a site on which no layout was found."""
    return PlanningError(
        f"no layout of {spec.count} components was found on a site of {spec.shape} cells: the yard has no room for all,"
        " or a component has no path to its target",
        hint="enlarge the site, or take fewer or shorter components or obstructions",
    )
