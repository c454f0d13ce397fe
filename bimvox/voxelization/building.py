"""Voxelize a building into one labelled grid, batch by batch."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.bim.building import Building, Element, Role
from bimvox.errors import InputError, SelectionError
from bimvox.grid.bricks import BRICK, Bricks
from bimvox.grid.frame import CELL_LIMIT, GridFrame, Label
from bimvox.grid.storage import in_order
from bimvox.grid.voxel_grid import Part, VoxelGrid
from bimvox.voxelization.lattice import cell_range, lattice_triangles, require_fit, require_size
from bimvox.voxelization.meshes import Meshes, batches_of, grouped, kinds_of, part_keys
from bimvox.voxelization.owner_kernels import (
    AIR,
    EnterScratch,
    OwnerBricks,
    PartQueue,
    PartRuns,
    SharedRows,
    enter,
    enter_batch,
    settle,
    sorted_rows,
)
from bimvox.voxelization.part import Batch, PartVoxels, voxelize_mesh, wind_batch
from bimvox.voxelization.solid import Fill

# The owner of a cell that several parts meet: the part that fills most of it. Parts are entered in the order of their
# indices, straight into bricks of 8 x 8 x 8 cells. A brick that lies wholly inside one part takes no memory. For the
# other bricks, each owner's share is kept until all parts are entered.

# Initial room, in bricks and in rows of the list of shared cells.
_RESERVED = 1 << 20


class Ownership:
    """Collects parts, in the order of their indices, into owners and a list of shared cells.

    Args:
        low: (3,) lattice cell of the grid's cell (0, 0, 0).
        high: (3,) one past its highest cell.
        parts: Number of parts that will be added.
    """

    def __init__(self, low: NDArray[np.int64], high: NDArray[np.int64], parts: int) -> None:
        x, y, z = (int(n) for n in high - low)
        self._low = low
        self._shape = (x, y, z)
        self._parts = parts
        self._index = np.full((-(-x // BRICK), -(-y // BRICK), -(-z // BRICK)), AIR, np.int32)
        # Zeros take no memory until they are first written to.
        reserved = min(self._index.size, _RESERVED) * BRICK**3
        self._cells: NDArray[Any] = np.zeros(reserved, np.uint16 if parts < 1 << 16 else np.uint32)
        self._marks = np.zeros(reserved, np.uint16)
        self._row_ranks = np.empty(_RESERVED, np.int64)
        self._row_parts = np.empty(_RESERVED, np.int32)
        self._row_shares = np.empty(_RESERVED, np.uint16)
        self._own = np.empty((2, BRICK), self._cells.dtype)
        self._held = np.empty(BRICK, np.uint16)
        self._used = 0
        self._rows = 0

    def add(self, index: int, voxels: PartVoxels) -> None:
        """Add the next part: it takes air, and cells of which it fills more than their owner so far."""
        if voxels.count == 0:
            return
        x, y, z = (int(n) for n in voxels.low - self._low)
        a, b, c = voxels.shape
        stacks = ((x + a - 1) // BRICK - x // BRICK + 1) * ((y + b - 1) // BRICK - y // BRICK + 1)
        stack = 0
        scratch = self._scratch(c)
        runs = PartRuns((x, y, z), voxels.shape, voxels.columns, voxels.runs, voxels.shares)
        while stack < stacks:
            stack, self._used, self._rows = enter(
                self._bricks(), self._shared_rows(), scratch, runs, index, stack, self._used, self._rows
            )
            if stack < stacks:
                self._make_room(c)

    def add_batch(
        self,
        first_index: int,
        batch: Batch,
        places: NDArray[np.int64],
        lows: NDArray[np.int64],
        first: int,
        stop: int,
    ) -> None:
        """Add some parts of a batch, or repeats of them, in their order.

        Args:
            first_index: Index of the part with number 0.
            batch: The voxels of the parts.
            places: (P,) for each part, the part of the batch that it is like.
            lows: (P, 3) lattice cell of the lowest corner of each part's box.
            first: Number of the first part to add.
            stop: One past the last.
        """
        heights = batch.shapes[places[first:stop], 2]
        scratch = self._scratch(int(heights.max(initial=0)))
        queue = PartQueue(first_index, stop, self._low, places, lows, batch)
        part, stack = first, 0
        while part < stop:
            part, stack, self._used, self._rows = enter_batch(
                self._bricks(), self._shared_rows(), scratch, queue, part, stack, self._used, self._rows
            )
            if part < stop:
                self._make_room(int(heights[part - first]))

    def _bricks(self) -> OwnerBricks:
        words, mark_words = self._cells.view(np.uint64), self._marks.view(np.uint64)
        return OwnerBricks(self._index, self._cells, words, self._marks, mark_words, self._shape)

    def _shared_rows(self) -> SharedRows:
        return SharedRows(self._row_ranks, self._row_parts, self._row_shares)

    def _scratch(self, height: int) -> EnterScratch:
        """Return scratch for parts of up to this many cells along z."""
        whole = np.empty(height // BRICK + 3, np.int32)
        return EnterScratch(whole, self._own, self._own.view(np.uint64), self._held, self._held.view(np.uint64))

    def _make_room(self, height: int) -> None:
        """Make room for at least one more stack of bricks of a part of this height."""
        # In place: a copy would need the memory twice.
        bricks = self._used + height // BRICK + 2
        if bricks * BRICK**3 > self._cells.size:
            bricks = max(bricks, self._used + self._used // 2) * BRICK**3
            self._cells.resize(bricks, refcheck=False)
            self._marks.resize(bricks, refcheck=False)
        rows = self._rows + 2 * BRICK * BRICK * height
        if rows > self._row_ranks.size:
            rows = max(rows, self._rows + self._rows // 2)
            self._row_ranks.resize(rows, refcheck=False)
            self._row_parts.resize(rows, refcheck=False)
            self._row_shares.resize(rows, refcheck=False)

    def owners(self) -> Bricks:
        """Return the owners. No part can be added afterwards."""
        dtype = np.min_scalar_type(self._parts)
        # Writing never overtakes reading, and the marks are no longer needed.
        if dtype.itemsize <= self._marks.itemsize:
            out = self._marks.view(dtype)
        else:
            out = np.empty(self._used * BRICK**3, dtype)
        same = dtype == self._cells.dtype
        words, out_words = (a.view(np.uint64) if same else np.empty(0, np.uint64) for a in (self._cells, out))
        used = settle(self._index, self._cells, self._shape, out, words, out_words)
        del words, out_words
        self._cells = np.zeros(0, self._cells.dtype)
        if dtype.itemsize <= self._marks.itemsize:
            del out
            kept, self._marks = self._marks, np.zeros(0, np.uint16)
            kept.resize(used * BRICK**3 * dtype.itemsize // kept.itemsize, refcheck=False)
            out = kept.view(dtype)
        else:
            out.resize(used * BRICK**3, refcheck=False)
        return Bricks(self._shape, self._index, out.reshape(used, BRICK, BRICK, BRICK))

    def shared(self) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.float32]]:
        """Return the rows of the cells that several parts meet, by cell, then part: cells, parts, fractions."""
        # The rows of a cell are in the order of the parts already.
        return sorted_rows(
            self._row_ranks[: self._rows], self._row_parts[: self._rows], self._row_shares[: self._rows], self._shape
        )


LABEL_OF_ROLE = {
    Role.COMPONENT: Label.COMPONENT,
    Role.STRUCTURE: Label.STRUCTURE,
    Role.FITTING: Label.STRUCTURE,
    Role.GROUND: Label.GROUND,
}
"""The label of an element's cells."""

_ANCHOR = np.zeros(3)


@dataclass(frozen=True, slots=True, eq=False)
class _Voxels:
    """The voxels of a batch of parts.

    Attributes:
        batch: The parts that winding fills, without repeats.
        places: (P,) int64, the part of ``batch`` that each part is, or repeats.
        lows: (P, 3) int64 lattice cell of the lowest corner of each part's box.
        left: The parts that need more than winding, by their number among the P.
    """

    batch: Batch
    places: NDArray[np.int64]
    lows: NDArray[np.int64]
    left: dict[int, PartVoxels]


@dataclass(frozen=True, slots=True)
class _Voxelizer:
    """Voxelizes batches of the parts of a building.

    Attributes:
        elements: The parts.
        bounds: (P, 2, 3) float64, the box around each part in cells.
        lows: (P, 3) int64 lowest lattice cell of each part.
        kinds: Of each part; parts of the same kind are repeats of one.
        voxel_size_m: Edge of a cell.
        clip: Lowest lattice cell of the grid, and one past the highest.
    """

    elements: tuple[Element, ...]
    bounds: NDArray[np.float64]
    lows: NDArray[np.int64]
    kinds: list[int]
    voxel_size_m: float
    clip: tuple[NDArray[np.int64], NDArray[np.int64]]

    def voxels_of(self, numbers: range) -> _Voxels:
        """Return the voxels of the parts with these numbers; repeats are voxelized once."""
        low, high = self.clip
        # A part's box reaches up to one cell beyond the grid.
        limit = int(np.prod((high - low + 2).astype(object)))
        distinct, places = grouped(self.kinds[numbers.start : numbers.stop])
        firsts = [numbers[n] for n in distinct]
        meshes = [self.elements[n].mesh for n in firsts]
        batch = wind_batch(
            Meshes.of(meshes), self.bounds[firsts], self.voxel_size_m, _ANCHOR, clip=self.clip, cell_limit=limit
        )
        moved = self.lows[numbers.start : numbers.stop] - self.lows[firsts][places]
        found = {
            place: voxelize_mesh(meshes[place], self.voxel_size_m, clip=self.clip, cell_limit=limit)
            for place in np.flatnonzero(~batch.done).tolist()
        }
        left = {}
        for n in np.flatnonzero(~batch.done[places]).tolist():
            voxels = found[int(places[n])]
            left[n] = replace(voxels, low=voxels.low + moved[n])
        return _Voxels(batch, places, batch.lows[places] + moved, left)


def voxelize_building(
    building: Building,
    voxel_size_m: float,
    *,
    low_vox: ArrayLike | None = None,
    high_vox: ArrayLike | None = None,
    threads: int = 1,
    progress: Callable[[str, int, int], None] | None = None,
    cell_limit: int = CELL_LIMIT,
) -> VoxelGrid:
    """Voxelize every element of a building into one labelled grid.

    The lattice is anchored at the origin of the building's frame: the grid's origin is a whole number of cells from it.
    The result does not depend on the number of threads.

    Args:
        building: Its elements become the grid's parts, in the same order.
        voxel_size_m: Edge of a cell.
        low_vox: (3,) lowest lattice cell of the grid; if None, the grid covers the building.
        high_vox: (3,) one past the highest lattice cell; parts are clipped to the grid.
        threads: Batches of parts voxelized in parallel.
        progress: Called with ``"voxelize"``, parts done, number of parts.
        cell_limit: Largest number of cells of the grid.

    Raises:
        SelectionError: If the building has no elements.
        GridTooLargeError: If the grid would have more cells than ``cell_limit``, before it is allocated.
        InputError: If a mesh or the cell size cannot be used.
    """
    if not building.elements:
        raise SelectionError("the building has no elements to voxelize", hint="check the selection")
    bounds, keys = _bounds_of(building, voxel_size_m)
    part_lows, part_highs = cell_range(bounds[:, 0], bounds[:, 1], voxel_size_m)
    low, high = _extent(part_lows, part_highs, low_vox, high_vox)
    require_fit(low, high, voxel_size_m, cell_limit)
    elements = building.elements
    kinds = kinds_of(keys, np.any((part_lows < low) | (part_highs > high), axis=1))
    batches = batches_of([len(element.mesh.faces) for element in elements], part_lows, part_highs, kinds)
    voxelize = _Voxelizer(elements, bounds, part_lows, kinds, voxel_size_m, (low, high))

    ownership = Ownership(low, high, len(elements))
    parts: list[Part] = []
    boxes: list[NDArray[np.int32]] = []
    box_counts: list[NDArray[np.int64]] = []
    for numbers, voxels in zip(batches, in_order(voxelize.voxels_of, batches, threads), strict=True):
        _enter(ownership, numbers.start, voxels)
        parts += _parts_of(elements, numbers, voxels, voxel_size_m)
        rows, counts = _boxes_of(voxels, low)
        boxes.append(rows)
        box_counts.append(counts)
        if progress is not None:
            for n in numbers:
                progress("voxelize", n + 1, len(elements))
    # In this order: owners() frees the memory that shared() needs.
    owners = ownership.owners()
    cells, sharers, fractions = ownership.shared()
    return VoxelGrid(
        frame=GridFrame(_metres(low, voxel_size_m), voxel_size_m),
        owners=owners,
        parts=tuple(parts),
        shared_cells=cells,
        shared_parts=sharers,
        shared_fractions=fractions,
        boxes=np.concatenate(boxes),
        box_parts=np.repeat(np.arange(len(elements), dtype=np.int32), np.concatenate(box_counts)),
        source=asdict(building.source),
        origin_m=(float(building.origin_m[0]), float(building.origin_m[1]), float(building.origin_m[2])),
        georeference=building.georeference,
    )


def _extent(
    part_lows: NDArray[np.int64], part_highs: NDArray[np.int64], low_vox: ArrayLike | None, high_vox: ArrayLike | None
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the lowest lattice cell of the grid, and one past the highest: those given, otherwise of all parts."""
    low = part_lows.min(axis=0) if low_vox is None else np.asarray(low_vox, dtype=np.int64)
    high = part_highs.max(axis=0) if high_vox is None else np.asarray(high_vox, dtype=np.int64)
    if np.any(high <= low):
        raise SelectionError(
            f"the grid from cell {low.tolist()} to cell {high.tolist()} is empty",
            hint="the highest cell must lie beyond the lowest on every axis",
        )
    return low, high


def _bounds_of(building: Building, voxel_size_m: float) -> tuple[NDArray[np.float64], NDArray[np.uint64]]:
    """Return (P, 2, 3) float64, the box around each element in cells; and (P, 2) uint64, the keys of ``part_keys``."""
    require_size(voxel_size_m)
    triangles = [len(element.mesh.faces) for element in building.elements]
    nowhere = np.zeros((len(triangles), 3), np.int64)
    found, keys = [], []
    for numbers in batches_of(triangles, nowhere, nowhere):
        meshes = Meshes.of([building.elements[n].mesh for n in numbers])
        bounds = meshes.bounds(voxel_size_m, _ANCHOR)
        for n in np.flatnonzero(np.isnan(bounds[:, 0, 0])).tolist():
            _refuse(building.elements[numbers[n]], voxel_size_m)
        found.append(bounds)
        lows = cell_range(bounds[:, 0], bounds[:, 1], voxel_size_m)[0]
        keys.append(part_keys(meshes, float(voxel_size_m), _ANCHOR, lows))
    return np.concatenate(found), np.concatenate(keys)


def _refuse(element: Element, voxel_size_m: float) -> None:
    """Raise the error of an unusable mesh, with the element's name."""
    try:
        lattice_triangles(element.mesh.vertices_m, element.mesh.faces, voxel_size_m, _ANCHOR)
    except InputError as error:
        raise InputError(f"element {element.label}: {error.message}", hint=error.hint) from error


def _metres(cell: NDArray[np.int64], voxel_size_m: float) -> tuple[float, float, float]:
    x, y, z = (float(n) * voxel_size_m for n in cell)
    return (x, y, z)


def _enter(ownership: Ownership, first_index: int, voxels: _Voxels) -> None:
    """Add the parts of a batch in their order; ``first_index`` is the index of the first part."""
    start = 0
    for n, alone in voxels.left.items():
        ownership.add_batch(first_index, voxels.batch, voxels.places, voxels.lows, start, n)
        ownership.add(first_index + n, alone)
        start = n + 1
    ownership.add_batch(first_index, voxels.batch, voxels.places, voxels.lows, start, len(voxels.places))


def _boxes_of(voxels: _Voxels, low: NDArray[np.int64]) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
    """Return the (B, 6) boxes of a batch's parts in cells of the grid, and the number of boxes of each part."""
    batch, places = voxels.batch, voxels.places
    counts = np.diff(batch.box_starts)[places]
    stops = np.cumsum(counts)
    rows = batch.boxes[np.repeat(batch.box_starts[places] - stops + counts, counts) + np.arange(stops[-1])]
    shift = (voxels.lows - low).astype(np.int32)
    rows += np.repeat(np.concatenate([shift, shift], axis=1), counts, axis=0)
    if not voxels.left:
        return rows, counts
    pieces = np.split(rows, stops[:-1])
    for n, alone in voxels.left.items():
        pieces[n] = alone.boxes() + np.tile(alone.low - low, 2).astype(np.int32)
        counts[n] = len(pieces[n])
    return np.concatenate(pieces), counts


def _parts_of(elements: tuple[Element, ...], numbers: range, voxels: _Voxels, voxel_size_m: float) -> Iterator[Part]:
    """Yield the rows of the table of parts."""
    volume_m3 = voxel_size_m**3
    winding = Fill.WINDING.value
    counts, volumes = voxels.batch.counts[voxels.places].tolist(), voxels.batch.volumes[voxels.places].tolist()
    for n, cells, volume in zip(numbers, counts, volumes, strict=True):
        alone = voxels.left.get(n - numbers.start)
        element = elements[n]
        yield Part(
            id=element.id,
            global_id=element.global_id,
            ifc_class=element.ifc_class,
            name=element.name,
            role=element.role.value,
            label=LABEL_OF_ROLE[element.role],
            cells=cells if alone is None else alone.count,
            solid_volume_m3=volume * volume_m3 if alone is None else alone.solid_volume_m3,
            mass_kg=element.mass_kg,
            mass_source=element.mass_source,
            fill=winding if alone is None else alone.fill,
            type_name=element.type_name,
            storey=element.storey,
            material=element.material,
        )
