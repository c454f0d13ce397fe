"""A building as one labelled grid, streamed part by part."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.bim.building import Building, Element, Role
from bimvox.errors import InputError, SelectionError
from bimvox.grid.frame import GridFrame
from bimvox.grid.labels import Label
from bimvox.grid.limits import CELL_LIMIT
from bimvox.grid.voxel_grid import Part, VoxelGrid
from bimvox.voxelize.lattice import cell_range
from bimvox.voxelize.limits import require_fit
from bimvox.voxelize.ownership import Ownership
from bimvox.voxelize.part import PartVoxels, lattice_bounds, voxelize_mesh

LABEL_OF_ROLE = {
    Role.COMPONENT: Label.COMPONENT,
    Role.STRUCTURE: Label.STRUCTURE,
    Role.FITTING: Label.STRUCTURE,
    Role.GROUND: Label.GROUND,
}
"""The label of an element's cells."""

_ANCHOR = np.zeros(3)

_Voxels = tuple[PartVoxels, NDArray[np.int32]]
"""A part's voxels, and its boxes in cells of the grid."""


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

    The lattice is anchored at 0 of the building's frame: the grid's origin is a whole number of cells from it. The
    result does not depend on the number of threads.

    Args:
        building: Its elements become the grid's parts, in the same order.
        voxel_size_m: Edge of a cell.
        low_vox: (3,) lowest lattice cell of the grid; default: it covers the building.
        high_vox: (3,) one past the highest lattice cell; parts are clipped to the grid.
        threads: Parts voxelized at the same time.
        progress: Called with ``"voxelize"``, parts done, parts in all.
        cell_limit: Largest number of cells of the grid.

    Raises:
        SelectionError: If the building has no elements.
        GridTooLargeError: If the grid would have more cells than ``cell_limit``; raised before it is allocated.
        InputError: If a mesh or the cell size cannot be used.
    """
    if not building.elements:
        raise SelectionError("the building has no elements to voxelize", hint="check the selection")
    low, high = building_range(building, voxel_size_m)
    clip = None
    if low_vox is not None or high_vox is not None:
        low = low if low_vox is None else np.asarray(low_vox, dtype=np.int64)
        high = high if high_vox is None else np.asarray(high_vox, dtype=np.int64)
        clip = (low, high)
    if np.any(high <= low):
        raise SelectionError(f"the grid from cell {low.tolist()} to cell {high.tolist()} is empty")
    require_fit(low, high, voxel_size_m, cell_limit)
    # A part's box reaches one cell beyond the grid.
    part_limit = int(np.prod((high - low + 2).astype(object)))

    def voxelize(element: Element) -> _Voxels:
        voxels = voxelize_mesh(element.mesh, voxel_size_m, _ANCHOR, clip=clip, cell_limit=part_limit)
        return voxels, voxels.boxes() + np.tile(voxels.low - low, 2).astype(np.int32)

    ownership = Ownership(low, high, len(building.elements))
    parts: list[Part] = []
    boxes: list[NDArray[np.int32]] = []
    for index, (voxels, part_boxes) in enumerate(_in_order(voxelize, building.elements, threads)):
        ownership.add(index, voxels)
        parts.append(_part_of(building.elements[index], voxels))
        boxes.append(part_boxes)
        if progress is not None:
            progress("voxelize", index + 1, len(building.elements))
    cells, sharers, fractions = ownership.shared()
    source = building.source
    return VoxelGrid(
        frame=GridFrame(_metres(low, voxel_size_m), voxel_size_m),
        owners=ownership.owners(),
        parts=tuple(parts),
        shared_cells=cells,
        shared_parts=sharers,
        shared_fractions=fractions,
        boxes=np.concatenate(boxes),
        box_parts=np.repeat(np.arange(len(boxes), dtype=np.int32), [len(rows) for rows in boxes]),
        source={
            "name": source.name,
            "sha256": source.sha256,
            "format": source.format,
            "unit": source.unit,
            "unit_assumed": source.unit_assumed,
        },
        origin_m=(float(building.origin_m[0]), float(building.origin_m[1]), float(building.origin_m[2])),
        georeference=building.georeference,
    )


def building_range(building: Building, voxel_size_m: float) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the half-open range of lattice cells that covers every element: two (3,) int64.

    Raises:
        InputError: Naming the element whose mesh cannot be used.
    """
    bounds = np.stack([_bounds_of(element, voxel_size_m) for element in building.elements])
    low, high = cell_range(bounds[:, 0], bounds[:, 1], voxel_size_m)
    return low.min(axis=0), high.max(axis=0)


def _bounds_of(element: Element, voxel_size_m: float) -> NDArray[np.float64]:
    try:
        return lattice_bounds(element.mesh, voxel_size_m, _ANCHOR)
    except InputError as error:
        raise InputError(f"element {element.id}: {error.message}", hint=error.hint) from error


def _metres(cell: NDArray[np.int64], voxel_size_m: float) -> tuple[float, float, float]:
    x, y, z = (float(n) * voxel_size_m for n in cell)
    return (x, y, z)


def _part_of(element: Element, voxels: PartVoxels) -> Part:
    return Part(
        id=element.id,
        global_id=element.global_id,
        ifc_class=element.ifc_class,
        name=element.name,
        role=element.role.value,
        label=LABEL_OF_ROLE[element.role],
        cells=voxels.count,
        solid_volume_m3=voxels.solid_volume_m3,
        mass_kg=element.mass_kg,
        mass_source=element.mass_source,
        fill=voxels.fill,
        type_name=element.type_name,
        storey=element.storey,
        material=element.material,
    )


def _in_order(voxelize: Callable[[Element], _Voxels], elements: tuple[Element, ...], threads: int) -> Iterator[_Voxels]:
    """Yield the voxels of each element in order; at most two parts a thread wait in memory."""
    if threads <= 1:
        yield from map(voxelize, elements)
        return
    with ThreadPoolExecutor(threads) as pool:
        waiting: deque[Future[_Voxels]] = deque()
        try:
            for element in elements:
                waiting.append(pool.submit(voxelize, element))
                if len(waiting) >= 2 * threads:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            for future in waiting:
                future.cancel()
