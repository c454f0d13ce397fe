"""A site and its components, columns and beams (linear sequences of voxels), with checks of both."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import combinations
from typing import NamedTuple

from bimvox.env.actions import named
from bimvox.site.component import IntVec

Box = tuple[IntVec, IntVec]
"""Half-open box of cells: lowest corner, highest corner."""

STORED_LAYER = 1
"""Components lie on the slab."""

HUNG_LAYER = 2
"""Layer of the reference cell when transit begins: lifted by one voxel."""

AXES = ("x", "y")


class ComponentKind(StrEnum):
    """Kind of a component."""

    COLUMN = "column"
    """Lies in the yard along x or y; before transit it is upended about its lowest-index end and hoisted one voxel."""

    BEAM = "beam"
    """Lies in the yard along its final axis; before transit it is hoisted one voxel. It is never turned."""


class YardPose(NamedTuple):
    """Where a component lies in the yard.

    Attributes:
        x: Reference cell: the end with the lowest index.
        y: Reference cell.
        axis: ``x`` or ``y``.
    """

    x: int
    y: int
    axis: str = "x"

    def box(self, length_vox: int) -> Box:
        """Return the cells of a component of that length at this place."""
        dx, dy = (length_vox, 1) if self.axis == "x" else (1, length_vox)
        return (self.x, self.y, STORED_LAYER), (self.x + dx, self.y + dy, STORED_LAYER + 1)


@dataclass(frozen=True, slots=True)
class PaperComponent:
    """One component; its serial number is its place in ``PaperSpec.components``, from 1.

    Attributes:
        kind: Column or beam.
        length_vox: Cells; the section is one cell.
        target_vox: Reference cell when set: a column's foot, a beam's end with the lowest index.
        axis: Of a beam, ``x`` or ``y``.
        after: Serial numbers of the components it waits for. None: a beam waits for the columns whose heads carry its
            ends (directly below an end, or next to it); a column waits for nothing.
        start: Where it lies in the yard. None draws a place for every episode.
    """

    kind: ComponentKind
    length_vox: int
    target_vox: IntVec
    axis: str = "x"
    after: tuple[int, ...] | None = None
    start: YardPose | None = None

    @property
    def size_vox(self) -> IntVec:
        """Edges in transit and when set: a column stands, a beam lies."""
        if self.kind is ComponentKind.COLUMN:
            return (1, 1, self.length_vox)
        return (self.length_vox, 1, 1) if self.axis == "x" else (1, self.length_vox, 1)

    def box_at(self, cell_vox: IntVec) -> Box:
        """Return the cells that it fills in transit with its reference cell at a cell."""
        x, y, z = cell_vox
        dx, dy, dz = self.size_vox
        return (x, y, z), (x + dx, y + dy, z + dz)


def column(
    length_vox: int, target_vox: IntVec, *, start: YardPose | None = None, after: tuple[int, ...] | None = None
) -> PaperComponent:
    """Return a column with its foot at a cell."""
    return PaperComponent(ComponentKind.COLUMN, length_vox, target_vox, after=after, start=start)


def beam(
    length_vox: int,
    target_vox: IntVec,
    axis: str,
    *,
    start: YardPose | None = None,
    after: tuple[int, ...] | None = None,
) -> PaperComponent:
    """Return a beam with its lowest-index end at a cell, along an axis."""
    return PaperComponent(ComponentKind.BEAM, length_vox, target_vox, axis, after, start)


def above_slab(box: Box, shape: IntVec) -> bool:
    """Return whether a box is inside a site and above its slab."""
    return all(box[0][a] >= (0, 0, 1)[a] and box[1][a] <= shape[a] for a in range(3))


def overlap(first: Box, second: Box) -> bool:
    """Return whether two boxes share a cell."""
    return all(first[0][a] < second[1][a] and second[0][a] < first[1][a] for a in range(3))


@dataclass(frozen=True, slots=True)
class RandomObstructions:
    """Obstructions drawn for every episode: one cell wide, along x or y, on the slab.

    They never overlap one another, a stored component or a target, and leave every component a path; otherwise the
    layout is drawn again.

    Attributes:
        fewest: Least number of them.
        most: Greatest number.
        length_vox: Cells in plan.
        height_vox: Cells.
    """

    fewest: int = 1
    most: int = 3
    length_vox: int = 3
    height_vox: int = 2


@dataclass(frozen=True, slots=True)
class PaperSpec:
    """A site. The slab is the layer k = 0; everything else is above it. There is no crane and no rope rule.

    Attributes:
        shape: X, Y, Z cells, the slab's layer included.
        construction_area: ``x0 y0 x1 y1``, half-open; the rest of the slab is the yard. Targets lie above it.
        components: In serial order. One that waits for others is skipped until they are assembled.
        obstructions: Half-open boxes of cells, in every episode.
        random_obstructions: Further ones, drawn for every episode.
        random_targets: Whether targets are drawn inside the construction area for every episode. Components that wait
            for one another move together, so that a frame stays a frame.
        step_limit: Steps after which a component is late: its step cost doubles and the paper's observation sets its
            flag. None: X + Y + Z.
        max_steps: Steps of an episode. None: n (X + Y + Z).

    Raises:
        ValueError: A value is impossible; the message begins with the name of the field.
    """

    shape: IntVec
    construction_area: tuple[int, int, int, int]
    components: tuple[PaperComponent, ...]
    obstructions: tuple[Box, ...] = ()
    random_obstructions: RandomObstructions | None = None
    random_targets: bool = False
    step_limit: int | None = None
    max_steps: int | None = None

    def __post_init__(self) -> None:
        _check_spec(self)

    @property
    def count(self) -> int:
        """n, the number of components."""
        return len(self.components)

    @property
    def steps_before_late(self) -> int:
        """The step limit of a component."""
        return sum(self.shape) if self.step_limit is None else self.step_limit

    @property
    def steps_allowed(self) -> int:
        """The steps of an episode."""
        return self.count * sum(self.shape) if self.max_steps is None else self.max_steps

    def in_yard(self, x: int, y: int) -> bool:
        """Return whether a cell of the slab belongs to the yard."""
        x0, y0, x1, y1 = self.construction_area
        inside = 0 <= x < self.shape[0] and 0 <= y < self.shape[1]
        return inside and not (x0 <= x < x1 and y0 <= y < y1)

    def waits_for(self, serial: int) -> tuple[int, ...]:
        """Return the serial numbers of the components that one waits for, ascending."""
        part = self.components[serial - 1]
        if part.after is not None:
            return tuple(sorted(set(part.after)))
        if part.kind is ComponentKind.COLUMN:
            return ()
        carrying = _carrying_cells(part)
        return tuple(
            other
            for other, column in enumerate(self.components, start=1)
            if column.kind is ComponentKind.COLUMN and _head(column) in carrying
        )

    def building_order(self) -> tuple[int, ...]:
        """Return the serial numbers in the order of building: always the lowest that waits for nothing next."""
        order: list[int] = []
        left = list(range(1, self.count + 1))
        while left:
            ready = [serial for serial in left if set(self.waits_for(serial)) <= set(order)]
            if not ready:
                raise ValueError(f"components: {left} wait for one another")
            order.append(ready[0])
            left.remove(ready[0])
        return tuple(order)

    def in_building_order(self) -> PaperSpec:
        """Return the same site with its components numbered in the order of building."""
        order = self.building_order()
        number = {old: new for new, old in enumerate(order, start=1)}
        components = tuple(
            replace(
                self.components[old - 1],
                after=tuple(sorted(number[other] for other in self.waits_for(old))),
            )
            for old in order
        )
        return replace(self, components=components)


def _head(column: PaperComponent) -> IntVec:
    x, y, z = column.target_vox
    return (x, y, z + column.length_vox - 1)


def _carrying_cells(beam: PaperComponent) -> set[IntVec]:
    """Return where the heads of columns that carry a beam may be: below its ends, or beyond them at its level."""
    x, y, z = beam.target_vox
    last = beam.length_vox - 1
    if beam.axis == "x":
        return {(x, y, z - 1), (x + last, y, z - 1), (x - 1, y, z), (x + last + 1, y, z)}
    return {(x, y, z - 1), (x, y + last, z - 1), (x, y - 1, z), (x, y + last + 1, z)}


def _check_spec(spec: PaperSpec) -> None:
    """Raise an error for an impossible site.

    Raises ValueError: the message names the field.
    """
    _check_shape(spec)
    _check_obstructions(spec)
    if not spec.components:
        raise ValueError("components: at least one is needed")
    for index, part in enumerate(spec.components):
        _check_component(spec, f"components[{index}]", part)
    for (i, first), (j, second) in combinations(enumerate(spec.components), 2):
        if overlap(first.box_at(first.target_vox), second.box_at(second.target_vox)):
            raise ValueError(f"components[{j}].target_vox: shares a cell with components[{i}]")
        if (
            first.start
            and second.start
            and overlap(first.start.box(first.length_vox), second.start.box(second.length_vox))
        ):
            raise ValueError(f"components[{j}].start: lies on components[{i}]")
    spec.building_order()
    for name in ("step_limit", "max_steps"):
        value = getattr(spec, name)
        if value is not None and value < 1:
            raise ValueError(f"{name}: {value} is less than one step")


def _check_shape(spec: PaperSpec) -> None:
    if len(spec.shape) != 3 or min(spec.shape) < 1 or spec.shape[2] <= HUNG_LAYER:
        raise ValueError(f"shape: {spec.shape} must be three numbers of cells, the last at least {HUNG_LAYER + 1}")
    if len(spec.construction_area) != 4:
        raise ValueError(f"construction_area: {spec.construction_area} must be x0, y0, x1, y1")
    x0, y0, x1, y1 = spec.construction_area
    if not (0 <= x0 < x1 <= spec.shape[0] and 0 <= y0 < y1 <= spec.shape[1]):
        raise ValueError(f"construction_area: {spec.construction_area} is empty or not inside the site {spec.shape}")
    if x1 - x0 == spec.shape[0] and y1 - y0 == spec.shape[1]:
        raise ValueError("construction_area: covers the whole slab and leaves no yard")


def _check_obstructions(spec: PaperSpec) -> None:
    for index, box in enumerate(spec.obstructions):
        low, high = box
        if any(low[a] >= high[a] for a in range(3)):
            raise ValueError(f"obstructions[{index}]: the box {box} is empty")
        if not above_slab(box, spec.shape):
            raise ValueError(f"obstructions[{index}]: the box {box} is not above the slab and inside {spec.shape}")
    drawn = spec.random_obstructions
    if drawn is None:
        return
    if not 0 <= drawn.fewest <= drawn.most:
        raise ValueError(f"random_obstructions: from {drawn.fewest} to {drawn.most} is not a range of numbers")
    if not (1 <= drawn.length_vox <= min(spec.shape[:2]) and 1 <= drawn.height_vox < spec.shape[2]):
        raise ValueError(
            f"random_obstructions: {drawn.length_vox} cells long and {drawn.height_vox} high do not fit into"
            f" {spec.shape}"
        )


def _check_component(spec: PaperSpec, name: str, part: PaperComponent) -> None:
    if part.length_vox < 1:
        raise ValueError(f"{name}.length_vox: {part.length_vox} is less than one cell")
    if part.axis not in AXES:
        raise ValueError(f"{name}.axis: {part.axis!r} is neither 'x' nor 'y'")
    if HUNG_LAYER + part.size_vox[2] > spec.shape[2]:
        raise ValueError(
            f"{name}.length_vox: a column of {part.length_vox} cells, upended and hoisted by one, does not fit under"
            f" the height of {spec.shape[2]} cells"
        )
    target = part.box_at(part.target_vox)
    if not above_slab(target, spec.shape):
        raise ValueError(f"{name}.target_vox: {part.target_vox} is not above the slab and inside {spec.shape}")
    x0, y0, x1, y1 = spec.construction_area
    (low_x, low_y, _), (high_x, high_y, _) = target
    if not (x0 <= low_x and y0 <= low_y and high_x <= x1 and high_y <= y1):
        raise ValueError(f"{name}.target_vox: {part.target_vox} is not over the construction area")
    for index, box in enumerate(spec.obstructions):
        if not spec.random_targets and overlap(target, box):
            raise ValueError(f"obstructions[{index}]: lies on the target of {name}")
    for serial in part.after or ():
        if not 1 <= serial <= spec.count:
            raise ValueError(f"{name}.after: there is no component {serial}; serial numbers go from 1 to {spec.count}")
    places = [part.start] if part.start is not None else _yard_places(spec, part)
    reasons = [why for why in (_why_not(spec, part, place) for place in places) if why]
    if part.start is not None and reasons:
        raise ValueError(f"{name}.start: {part.start} {reasons[0]}")
    if len(reasons) == len(places):
        raise ValueError(f"{name}.start: the yard has no room for {part.length_vox} cells in a row")


def _yard_places(spec: PaperSpec, part: PaperComponent) -> list[YardPose]:
    axes = (part.axis,) if part.kind is ComponentKind.BEAM else AXES
    return [YardPose(x, y, axis) for x in range(spec.shape[0]) for y in range(spec.shape[1]) for axis in axes]


def _why_not(spec: PaperSpec, part: PaperComponent, place: YardPose) -> str:
    """Return why a component cannot lie somewhere; empty if it can."""
    if place.axis not in AXES:
        return f"has an axis {place.axis!r}, which is neither 'x' nor 'y'"
    if part.kind is ComponentKind.BEAM and place.axis != part.axis:
        return f"lies along {place.axis}, but this beam is built in along {part.axis} and is never turned"
    lying = place.box(part.length_vox)
    (x0, y0, _), (x1, y1, _) = lying
    if not all(spec.in_yard(x, y) for x in range(x0, x1) for y in range(y0, y1)):
        return "is not in the yard"
    hung = part.box_at((place.x, place.y, HUNG_LAYER))
    if any(overlap(lying, box) or overlap(hung, box) for box in spec.obstructions):
        return "shares a cell with an obstruction, stored or hoisted by one cell"
    return ""


# The sites of the paper and of its authors' later work.

PAPER = PaperSpec(
    shape=(15, 15, 6),
    construction_area=(5, 5, 10, 10),
    components=(column(4, (7, 7, 1)),),
    step_limit=15,
    max_steps=36,
)
"""The experiment: one column of four cells to the middle of 15 x 15 x 6. Only the paper's Figure 3 shows the areas, not
its text: here the construction area and the target are in the middle of the site."""

OBSTRUCTED = replace(PAPER, random_obstructions=RandomObstructions())
"""The same with one to three obstructions of the experiment's size, drawn anywhere for every episode."""

FOUR_COLUMNS_FOUR_BEAMS = PaperSpec(
    shape=(15, 15, 8),
    construction_area=(6, 6, 15, 15),
    components=(
        column(4, (9, 9, 1)),
        column(4, (9, 13, 1)),
        column(4, (13, 9, 1)),
        column(4, (13, 13, 1)),
        beam(3, (9, 10, 4), "y"),
        beam(3, (10, 9, 4), "x"),
        beam(3, (13, 10, 4), "y"),
        beam(3, (10, 13, 4), "x"),
    ),
)
"""The authors' later case: a frame of four columns with four beams between their heads, from random yards. Areas,
targets and lengths are those of their published environment."""

PRESETS: dict[str, PaperSpec] = {
    "paper": PAPER,
    "obstructed": OBSTRUCTED,
    "frame": FOUR_COLUMNS_FOUR_BEAMS,
}


def site_named(site: PaperSpec | str) -> PaperSpec:
    """Return a site, or the preset of that name."""
    return named("site", site, PRESETS) if isinstance(site, str) else site


def obstruction(x: int, y: int, axis: str, length_vox: int = 3, height_vox: int = 2) -> Box:
    """Return an obstruction on the slab from its lowest-index end; the default size is the experiments'."""
    dx, dy = (length_vox, 1) if axis == "x" else (1, length_vox)
    return (x, y, 1), (x + dx, y + dy, 1 + height_vox)
