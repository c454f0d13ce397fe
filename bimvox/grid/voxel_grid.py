"""A voxelized building: owners, labels, the cells and the outer faces of each part."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.errors import MissingPackageError
from bimvox.grid.bricks import NO_OWNER, Bricks
from bimvox.grid.frame import GridFrame, Label

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

        Raises MissingPackageError: if xarray is not installed.
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


@kernel
def _expand(boxes: NDArray[np.int32], shape: tuple[int, int, int], out: NDArray[np.int64]) -> None:
    """Fill ``out`` with the cells in disjoint boxes, as positions in a C-ordered array of that shape."""
    row = 0
    for n in range(boxes.shape[0]):
        for i in range(boxes[n, 0], boxes[n, 3]):
            for j in range(boxes[n, 1], boxes[n, 4]):
                start = (i * shape[1] + j) * shape[2]
                for k in range(boxes[n, 2], boxes[n, 5]):
                    out[row] = start + k
                    row += 1


def part_boxes(grid: VoxelGrid, index: int) -> NDArray[np.int32]:
    """Return the disjoint boxes of the cells that one part meets: (B, 6) int32.

    Raises IndexError: if the part does not exist.
    """
    if not 0 <= index < len(grid.parts):
        raise IndexError(f"part {index} of a grid with {len(grid.parts)} parts")
    first, stop = np.searchsorted(grid.box_parts, (index, index + 1))
    return grid.boxes[first:stop]


def part_cells(grid: VoxelGrid, index: int) -> NDArray[np.int32]:
    """Return all cells that one part meets, owned or shared: (N, 3) int32, ascending."""
    boxes = part_boxes(grid, index)
    places = np.empty(int(np.prod(boxes[:, 3:] - boxes[:, :3], axis=1, dtype=np.int64).sum()), np.int64)
    _expand(boxes, grid.shape, places)
    places.sort()
    return np.stack(np.unravel_index(places, grid.shape), axis=1).astype(np.int32)


def all_part_cells(grid: VoxelGrid) -> list[NDArray[np.int32]]:
    """Return all cells that each part meets: per part (N, 3) int32, ascending."""
    return [part_cells(grid, index) for index in range(len(grid.parts))]


@dataclass(frozen=True, slots=True, eq=False)
class PartFaces:
    """The closed surface of one part's cells. Rectangles may meet along an edge without sharing all its vertices.

    Attributes:
        part: Index of the part in the grid's table.
        corners: (V, 3) int32, corners of cells: (i, j, k) is the lowest corner of that cell.
        quads: (Q, 4) int32 indices into ``corners``, counter-clockwise seen from outside.
    """

    part: int
    corners: NDArray[np.int32]
    quads: NDArray[np.int32]

    @property
    def triangles(self) -> NDArray[np.int32]:
        """(2 Q, 3) int32 indices into ``corners``, two for each rectangle."""
        return self.quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)


def outer_faces(grid: VoxelGrid) -> Iterator[PartFaces]:
    """Yield the outer faces of every part, in the order of the table.

    A part is drawn by the cells that it owns, so that no two parts overlap. A part that owns no cell, because others
    fill more of each, is drawn by the cells that it meets.
    """
    owners, corners = _rectangles(grid.shape, lambda low, high: grid.owners.box(low, high))
    order = np.argsort(owners, kind="stable")
    ends = np.searchsorted(owners[order], np.arange(len(grid.parts) + 1))
    for part in range(len(grid.parts)):
        rows = order[ends[part] : ends[part + 1]]
        yield _joined(part, corners[rows]) if len(rows) else _met_faces(grid, part)


def _met_faces(grid: VoxelGrid, part: int) -> PartFaces:
    boxes = part_boxes(grid, part)
    if not len(boxes):
        return _joined(part, np.empty((0, 4, 3), np.int32))
    start = boxes[:, :3].min(axis=0)
    cells = np.full(boxes[:, 3:].max(axis=0) - start, NO_OWNER, np.int32)
    for x0, y0, z0, x1, y1, z1 in boxes - np.tile(start, 2):
        cells[x0:x1, y0:y1, z0:z1] = part
    x, y, z = cells.shape
    _, corners = _rectangles((x, y, z), lambda a, b: cells[a[0] : b[0], a[1] : b[1], a[2] : b[2]])
    return _joined(part, corners + start)


def _joined(part: int, corners: NDArray[np.int32]) -> PartFaces:
    """Merge the vertices of rectangles that meet in a corner."""
    if not len(corners):
        return PartFaces(part, np.empty((0, 3), np.int32), np.empty((0, 4), np.int32))
    low = corners.min(axis=(0, 1))
    span = corners.max(axis=(0, 1)) + 1 - low
    places = np.ravel_multi_index(tuple(np.moveaxis(corners - low, -1, 0)), tuple(span)).ravel()
    places, index = np.unique(places, return_inverse=True)
    vertices = (np.stack(np.unravel_index(places, tuple(span)), axis=1) + low).astype(np.int32)
    return PartFaces(part, vertices, index.reshape(-1, 4).astype(np.int32))


def _rectangles(
    shape: tuple[int, int, int],
    read: Callable[[tuple[int, ...], tuple[int, ...]], NDArray[np.int32]],
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Return the owner and the corners of every rectangle: (Q,), (Q, 4, 3) int32, by sweeping the grid's layers."""
    owners, corners = [np.empty(0, np.int32)], [np.empty((0, 4, 3), np.int32)]
    for axis in range(3):
        across = [n for n in range(3) if n != axis]
        flat = [shape[n] for n in across]
        air = np.full(flat, NO_OWNER, np.int32)
        mask = np.empty_like(air)
        before = air
        for plane in range(shape[axis] + 1):
            after = air
            if plane < shape[axis]:
                low, high = [0, 0, 0], list(shape)
                low[axis], high[axis] = plane, plane + 1
                after = read(tuple(low), tuple(high)).reshape(flat)
            for inside, outside, forward in ((before, after, True), (after, before, False)):
                most = _expose(inside, outside, mask)
                if most == 0:
                    continue
                rows = np.empty((most, 5), np.int32)
                rows = rows[: _merge(mask, rows)]
                owners.append(rows[:, 0].copy())
                corners.append(_placed(rows, axis, plane, across, forward))
            before = after
    return np.concatenate(owners), np.concatenate(corners)


def _placed(rows: NDArray[np.int32], axis: int, plane: int, across: list[int], forward: bool) -> NDArray[np.int32]:
    """Return the corners of the rectangles (owner, u0, v0, u1, v1) of a plane, counter-clockwise from outside."""
    corners = np.empty((len(rows), 4, 3), np.int32)
    corners[:, :, axis] = plane
    corners[:, :, across[0]] = rows[:, [1, 3, 3, 1]]
    corners[:, :, across[1]] = rows[:, [2, 2, 4, 4]]
    # x with y and y with z turn about +z and +x, but x with z turns about -y.
    return corners if forward == (axis != 1) else corners[:, ::-1]


@kernel
def _expose(inside: NDArray[np.int32], outside: NDArray[np.int32], mask: NDArray[np.int32]) -> int:
    """Set ``mask`` to the owner inside if a different one is outside, otherwise to -1; return the number of faces."""
    count = 0
    for u in range(inside.shape[0]):
        for v in range(inside.shape[1]):
            owner = inside[u, v]
            if owner == outside[u, v]:
                owner = -1
            mask[u, v] = owner
            count += owner >= 0
    return count


@kernel
def _merge(mask: NDArray[np.int32], rows: NDArray[np.int32]) -> int:
    """Cut ``mask`` into rectangles of one owner, greedily along v, then u; afterwards all of it is -1."""
    count = 0
    for u in range(mask.shape[0]):
        v = 0
        while v < mask.shape[1]:
            owner = mask[u, v]
            if owner < 0:
                v += 1
                continue
            v1 = v + 1
            while v1 < mask.shape[1] and mask[u, v1] == owner:
                v1 += 1
            u1 = u + 1
            grows = True
            while grows and u1 < mask.shape[0]:
                for n in range(v, v1):
                    if mask[u1, n] != owner:
                        grows = False
                        break
                u1 += grows
            for x in range(u, u1):
                for y in range(v, v1):
                    mask[x, y] = -1
            rows[count, 0], rows[count, 1], rows[count, 2], rows[count, 3], rows[count, 4] = owner, u, v, u1, v1
            count += 1
            v = v1
    return count
