"""A site and its components."""

from __future__ import annotations

from dataclasses import dataclass, replace

from bimvox.paper.env.component import Box, ComponentKind, PaperComponent
from bimvox.paper.env.validation import check_spec
from bimvox.site.component import IntVec


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
        check_spec(self)

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
