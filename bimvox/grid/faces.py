"""The outer faces of a grid's parts, as large rectangles."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.grid.bricks import NO_OWNER
from bimvox.grid.part_cells import part_boxes
from bimvox.grid.voxel_grid import VoxelGrid


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
