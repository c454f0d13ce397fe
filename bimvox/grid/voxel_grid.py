"""A voxelized building: labels, owners, and what each part fills."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bimvox.grid.frame import GridFrame
from bimvox.grid.labels import Label

NO_OWNER = -1


@dataclass(frozen=True, slots=True)
class Part:
    """One voxelized element, as the grid file's component table lists it.

    Attributes:
        id: Unique within the grid.
        global_id: IFC GlobalId, or the body's name.
        ifc_class: For example ``IfcBeam``; ``Mesh`` for bodies of mesh files.
        name: The source's name.
        role: ``component``, ``structure``, ``fitting`` or ``ground`` (see ``bimvox.bim.building.Role``).
        label: Label of its cells.
        cells: Number of cells that it meets.
        solid_volume_m3: Volume of its solid.
        mass_kg: Its mass.
        fill: How its interior was found (``winding``, ``vote``, ``surface`` ...).
        type_name: Name of its IFC type, or None.
        storey: Name of its storey, or None.
        material: Name of its material, or None.
    """

    id: str
    global_id: str
    ifc_class: str
    name: str
    role: str
    label: Label
    cells: int
    solid_volume_m3: float
    mass_kg: float
    fill: str
    type_name: str | None = None
    storey: str | None = None
    material: str | None = None


@dataclass(frozen=True, slots=True, eq=False)
class VoxelGrid:
    """A dense labelled grid, indexed [x, y, z].

    Attributes:
        frame: Metres to cells.
        labels: (X, Y, Z) uint8, values of ``Label``.
        owners: (X, Y, Z) int32, index into ``parts``; ``NO_OWNER`` where the cell is air. A cell met by several parts
            belongs to the one that fills most of it (ties: the lower index).
        parts: The table of parts.
        shared_cells: (S, 3) int32, one row per (cell, part) overlap of every cell that several parts meet.
        shared_parts: (S,) int32, the part of that row.
        shared_fractions: (S,) float32, the share of the cell that the part fills, 0..1.
        source: Plain values about the source (``name``, ``sha256``, ``format``, ``unit`` ...).
        origin_m: (3,) what was subtracted from the source's world coordinates, metres.
    """

    frame: GridFrame
    labels: NDArray[np.uint8]
    owners: NDArray[np.int32]
    parts: tuple[Part, ...]
    shared_cells: NDArray[np.int32]
    shared_parts: NDArray[np.int32]
    shared_fractions: NDArray[np.float32]
    source: Mapping[str, str | float | bool] = field(default_factory=dict)
    origin_m: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def shape(self) -> tuple[int, int, int]:
        """(X, Y, Z)."""
        x, y, z = self.labels.shape
        return (x, y, z)

    def counts(self) -> dict[str, int]:
        """Return the number of cells of every label, air included, by the label's name in lower case."""
        numbers = np.bincount(self.labels.ravel(), minlength=len(Label))
        return {label.name.lower(): int(numbers[label]) for label in Label if numbers[label] or label is Label.AIR}
