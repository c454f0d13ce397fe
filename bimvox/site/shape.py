"""Shapes from cells, and shapes turned for the yard."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.grid.summed_area import boxes_of
from bimvox.site.component import Component, IntVec, Shape, StoredPose


def shape_of(cells: ArrayLike) -> tuple[Shape, IntVec]:
    """Return the shape of a set of cells and its reference cell.

    Args:
        cells: (N, 3) integer cells, N >= 1, in any order.

    Returns:
        The shape relative to the lowest corner of the bounding box, and that corner.
    """
    absolute = np.unique(np.asarray(cells, dtype=np.int32), axis=0)
    low = absolute.min(axis=0)
    relative = absolute - low
    dense = np.zeros(relative.max(axis=0) + 1, np.bool_)
    dense[tuple(relative.T)] = True
    return Shape(_frozen(relative), _frozen(boxes_of(dense))), (int(low[0]), int(low[1]), int(low[2]))


def turned_shape(shape: Shape, turn: int) -> Shape:
    """Return a shape turned by quarters about z, counter-clockwise."""
    x, y, z = shape.cells.T
    for _ in range(turn % 4):
        x, y = y.max() - y, x
    return shape if turn % 4 == 0 else shape_of(np.stack([x, y, z], axis=1))[0]


def turned_hook(shape: Shape, hook_offset_vox: IntVec, turn: int) -> IntVec:
    """Return the hook's cell, relative to the reference cell, of a shape turned by quarters about z."""
    x, y, z = hook_offset_vox
    size_x, size_y, _ = shape.size_vox
    for _ in range(turn % 4):
        x, y, size_x, size_y = size_y - 1 - y, x, size_y, size_x
    return (x, y, z)


def turned_aside(aside_vox: tuple[float, float], turn: int) -> tuple[float, float]:
    """Return how far the hook is from the middle of its cell when its part is turned by quarters about z."""
    x, y = aside_vox
    for _ in range(turn % 4):
        x, y = -y, x
    return (x, y)


def turning_columns(shape: Shape, hook_line_vox: tuple[float, float, float], turn: int) -> NDArray[np.int32]:
    """Return the (N, 2) columns, relative to the reference cell, that a part sweeps turning about its hook: a disc.

    Turned by ``turn`` quarters, the part lies on whole cells, and its hook need not be where it is with the part not
    turned: before it turns, it moves by the difference. The disc is wider by as much.
    """
    x, y, _ = hook_line_vox
    column = np.rint([x, y]).astype(np.int32)
    aside = (x - float(column[0]), y - float(column[1]))
    corners = shape.boxes[:, [0, 1, 3, 1, 0, 4, 3, 4]].reshape(-1, 2) - np.array([x + 0.5, y + 0.5])
    moves = float(np.hypot(*np.subtract(turned_aside(aside, turn), aside)))
    radius = float(np.hypot(*corners.T).max()) + moves
    reach = int(np.ceil(radius + 1.0))
    offsets = np.stack(np.meshgrid(*[np.arange(-reach, reach + 1)] * 2, indexing="ij"), axis=-1).reshape(-1, 2)
    nearest = np.maximum(np.abs(offsets - np.array(aside)) - 0.5, 0.0)
    inside: NDArray[np.int32] = offsets[np.hypot(*nearest.T) < radius - 1e-9].astype(np.int32)
    return inside + column


def turned_cells(component: Component, angle_rad: float) -> NDArray[np.int32]:
    """Return (N, 3) the cells, relative to its reference cell, whose middles a part covers when it is turned.

    It turns by an angle about its hook line, counter-clockwise.
    """
    line, shape = np.array(component.hook_line_vox[:2]) + 0.5, component.shape
    reach = int(np.ceil(np.hypot(*shape.size_vox[:2]))) + 1
    at = np.stack(np.meshgrid(*[np.arange(-reach, reach + 1)] * 2, indexing="ij"), axis=-1).reshape(-1, 2)
    at = at + np.floor(line).astype(int)
    (x, y), cos, sin = (at + 0.5 - line).T, np.cos(angle_rad), np.sin(angle_rad)
    before = np.floor(np.stack([cos * x + sin * y, cos * y - sin * x], axis=1) + line + 1e-9).astype(int)
    inside = ((before >= 0) & (before < shape.size_vox[:2])).all(axis=1)
    dense = np.zeros(shape.size_vox, np.bool_)
    dense[tuple(shape.cells.T)] = True
    column, height = np.nonzero(dense[tuple(before[inside].T)])
    cells: NDArray[np.int32] = np.column_stack([at[inside][column], height]).astype(np.int32)
    return cells


def stored_shape(shape: Shape, pose: StoredPose, turn: int = 0) -> Shape:
    """Return the shape in its pose in the yard.

    A lying component has its foot (lowest z in the building) at the lowest-index end of the axis it lies along. Quarter
    turns apply to the upright part, before it is laid down.
    """
    shape = turned_shape(shape, turn)
    if pose is StoredPose.AS_BUILT:
        return shape
    x, y, z = shape.cells.T
    size_x, size_y, _ = shape.size_vox
    turned = (z, y, size_x - 1 - x) if pose is StoredPose.LYING_X else (x, z, size_y - 1 - y)
    return shape_of(np.stack(turned, axis=1))[0]


def erection_size_vox(shape: Shape, pose: StoredPose) -> IntVec:
    """Return the box, from the stored reference cell up, that a component sweeps while it is upended and raised.

    A rectangle of L by w that turns through a quarter about its lowest corner at the foot stays within
    sqrt(L^2 + w^2) in both directions. One more cell in z allows for the raise by one voxel before transit.
    """
    size_x, size_y, size_z = shape.size_vox
    if pose is StoredPose.AS_BUILT:
        return (size_x, size_y, size_z + 1)
    width = size_x if pose is StoredPose.LYING_X else size_y
    reach = int(np.ceil(np.hypot(size_z, width) - 1e-9)) if width > 1 else size_z
    return (reach, size_y, reach + 1) if pose is StoredPose.LYING_X else (size_x, reach, reach + 1)


def _frozen(array: NDArray[np.int32]) -> NDArray[np.int32]:
    array.flags.writeable = False
    return array
