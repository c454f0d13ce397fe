"""Columns and beams: linear sequences of voxels."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

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
