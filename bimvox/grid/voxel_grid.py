"""A voxelized building: owners, labels, and the cells of each part."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bimvox.errors import MissingPackageError
from bimvox.grid.bricks import Bricks
from bimvox.grid.frame import GridFrame
from bimvox.grid.labels import Label

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True, slots=True)
class Part:
    """One voxelized element.

    Attributes:
        id: Unique within the grid.
        global_id: IFC GlobalId, or the body's name.
        ifc_class: For example ``IfcBeam``; ``Mesh`` for bodies of mesh files.
        name: The source's name.
        role: ``component``, ``structure``, ``fitting`` or ``ground``.
        label: Label of its cells.
        cells: Number of cells that it meets.
        solid_volume_m3: Volume of its solid.
        mass_kg: Its mass.
        mass_source: ``quantity``, ``density`` (of its material) or ``default`` (of its kind).
        fill: How its interior was found: ``winding``, ``vote``, ``flood`` or ``surface``.
        type_name: Name of its IFC type, if any.
        storey: Name of its storey, if any.
        material: Name of its material, if any.
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
    mass_source: str
    fill: str
    type_name: str | None = None
    storey: str | None = None
    material: str | None = None


@dataclass(frozen=True, slots=True, eq=False)
class VoxelGrid:
    """A labelled grid, indexed [x, y, z].

    Attributes:
        frame: Metres to cells.
        owners: Index into ``parts`` for every cell; ``NO_OWNER`` for air. A cell that several parts meet belongs to the
            one that fills most of it (in a tie, to the lower index). A cell has its owner's label.
        parts: The table of parts.
        shared_cells: (S, 3) int32, for every cell that several parts meet, one row per part.
        shared_parts: (S,) int32, the part of that row.
        shared_fractions: (S,) float32, the share of the cell that this part fills, 0..1.
        boxes: (B, 6) int32, disjoint half-open boxes ``x0 y0 z0 x1 y1 z1`` of cells; the boxes of a part cover all
            the cells that it meets.
        box_parts: (B,) int32, the part of that row, ascending.
        source: Plain values about the source (``name``, ``sha256``, ``format``, ``unit`` ...).
        origin_m: (3,) offset subtracted from the source's world coordinates, metres.
        georeference: Map conversion of the source, if any, as plain values (``eastings_m``, ``crs`` ...).
    """

    frame: GridFrame
    owners: Bricks
    parts: tuple[Part, ...]
    shared_cells: NDArray[np.int32]
    shared_parts: NDArray[np.int32]
    shared_fractions: NDArray[np.float32]
    boxes: NDArray[np.int32]
    box_parts: NDArray[np.int32]
    source: Mapping[str, str | float | bool] = field(default_factory=dict)
    origin_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    georeference: Mapping[str, str | float] = field(default_factory=dict)

    def __repr__(self) -> str:
        x, y, z = self.shape
        name, size_m = self.source.get("name", ""), self.frame.voxel_size_m
        return f"<VoxelGrid of {name!r}: {x} x {y} x {z} cells of {size_m:g} m, {len(self.parts):,} parts>"

    @property
    def shape(self) -> tuple[int, int, int]:
        """(X, Y, Z)."""
        return self.owners.shape

    @property
    def label_table(self) -> NDArray[np.uint8]:
        """(parts + 1,) uint8: the label of a cell by its owner + 1, air first."""
        return np.array([Label.AIR, *(part.label for part in self.parts)], np.uint8)

    @property
    def labels(self) -> NDArray[np.uint8]:
        """(X, Y, Z) uint8 ``Label`` of every cell: a new dense array."""
        return self.label_table[self.owners.dense() + 1]

    def fill_fraction(self, part: Part) -> float:
        """Return the share of a part's cells that its solid fills, 0..1."""
        return min(1.0, part.solid_volume_m3 / (part.cells * self.frame.voxel_size_m**3)) if part.cells else 0.0

    def counts(self) -> dict[str, int]:
        """Return the number of cells by label name in lower case, including air."""
        cells = np.bincount(self.label_table, self.owners.counts(len(self.parts)), len(Label))
        return {label.name.lower(): int(cells[label]) for label in Label if cells[label] or label is Label.AIR}

    def to_xarray(self) -> xarray.Dataset:
        """Return an ``xarray.Dataset``: ``labels`` uint8 and ``owners`` int32 over x, y, z (cell centres, metres).

        The arrays are dense: 5 bytes a cell. The variables ``part_id``, ``part_name`` ... over ``part`` are the table
        that ``owners`` points into. All values are plain, so that ``to_netcdf`` and ``to_zarr`` can write them.

        Raises:
            MissingPackageError: If xarray is not installed.
        """
        from bimvox.grid.layout import ARRAYS, AXES

        try:
            import xarray
        except ModuleNotFoundError as error:
            raise MissingPackageError("xarray", "a dataset of a grid") from error
        owners = self.owners.dense()
        cells = np.arange(max(self.shape))
        centres_m = self.frame.centre_of(np.column_stack([cells, cells, cells]))
        values = {"labels": self.label_table[owners + 1], "owners": owners}
        coordinates = {name: centres_m[: self.shape[axis], axis] for axis, name in enumerate(AXES)}
        columns = {entry.name: [getattr(part, entry.name) for part in self.parts] for entry in fields(Part)}
        table = {
            f"part_{name}": ("part", np.array(["" if value is None else value for value in column]))
            for name, column in columns.items()
        }
        return xarray.Dataset(
            {name: (AXES, array, dict(ARRAYS[name].attributes)) for name, array in values.items()} | table,
            {name: (name, array, dict(ARRAYS[name].attributes)) for name, array in coordinates.items()},
            {
                "voxel_size_m": self.frame.voxel_size_m,
                "origin_m": list(self.frame.origin_m),
                "source_origin_m": list(self.origin_m),
                **{f"source_{key}": int(one) if isinstance(one, bool) else one for key, one in self.source.items()},
            },
        )
