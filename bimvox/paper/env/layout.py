"""A layout: everything that may differ between two episodes on a site."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.errors import PlanningError
from bimvox.paper.env.component import AXES, HUNG_LAYER, Box, ComponentKind, YardPose, above_slab, overlap
from bimvox.paper.env.draw import draw_layout, may_lie
from bimvox.paper.env.dynamics import paint_fixed
from bimvox.paper.env.rules import Drawing, drawing_of, empty_site, rules_of
from bimvox.paper.env.spec import PaperSpec
from bimvox.paper.env.state import SiteState
from bimvox.site.component import IntVec


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
            axis = next((a for a in range(2) if may_lie(rules, drawing, site.cells, 0, x, y, a)), None)
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
