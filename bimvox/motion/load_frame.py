"""From hook poses to (continuous) reference cells of the load and back.

The load keeps its heading while the crane slews, by tag line: it is only translated, as on the voxel path.
The hook is above the load's centre of mass, one sling length above its top.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.crane.kinematics import nearest_turn
from bimvox.crane.reach import ColumnFrame
from bimvox.crane.tower_crane import CranePose, TowerCrane

HookEnd = NDArray[np.int32] | NDArray[np.float64]
"""(3,) where a move of the empty hook begins or ends, in cells; above a centre of mass, aside of a whole cell."""

_THERE_M = 1e-9


class LoadFrame(NamedTuple):
    """How hook poses and reference cells correspond; a plain tuple, so that kernels take it.

    Attributes:
        axis_x: Reference cell coordinate at which the hook would be on the slewing axis.
        axis_y: The same in y.
        zero_height_m: Hook height at which the reference cell's z is 0.
        voxel_size_m: Edge of a cell.
    """

    axis_x: float
    axis_y: float
    zero_height_m: float
    voxel_size_m: float


def load_frame(crane: TowerCrane, frame: ColumnFrame, hook_line_vox: ArrayLike) -> LoadFrame:
    """Return the correspondence for a load whose hook line and top are at ``hook_line_vox`` ((3,) cells)."""
    x, y, z = np.asarray(hook_line_vox, np.float64).tolist()
    size = frame.voxel_size_m
    return LoadFrame(
        (crane.base_m[0] - frame.origin_m[0]) / size - (x + 0.5),
        (crane.base_m[1] - frame.origin_m[1]) / size - (y + 0.5),
        frame.origin_m[2] + z * size + crane.sling_m,
        size,
    )


def axes_of_cells(load: LoadFrame, cells: ArrayLike) -> NDArray[np.float64]:
    """Return the hook poses over reference cells: (..., 3) -> (..., 3) slew in (-pi, pi], radius, height."""
    at = np.asarray(cells, dtype=np.float64)
    dx = (at[..., 0] - load.axis_x) * load.voxel_size_m
    dy = (at[..., 1] - load.axis_y) * load.voxel_size_m
    height = load.zero_height_m + at[..., 2] * load.voxel_size_m
    return np.stack([np.arctan2(dy + 0.0, dx), np.hypot(dx, dy), height], axis=-1)


def in_cell(end_vox: HookEnd) -> tuple[int, int, int]:
    """Return the whole cell in which the empty hook is at an end."""
    x, y, z = np.rint(end_vox).astype(np.int64).tolist()
    return (x, y, z)


def pose_next_to(load: LoadFrame, cell: ArrayLike, pose: CranePose) -> CranePose:
    """Return the hook pose over a reference cell ((3,)), slewed by less than half a turn from a pose.

    It is the pose itself if the hook is there already.
    """
    slew, radius, height = axes_of_cells(load, cell).tolist()
    there = CranePose(nearest_turn(slew, pose.slew_rad), radius, height)
    gaps = (there.slew_rad - pose.slew_rad) * radius, radius - pose.radius_m, height - pose.height_m
    return pose if max(abs(gap) for gap in gaps) <= _THERE_M else there


def cells_of_axes(load: LoadFrame, axes: ArrayLike) -> NDArray[np.float64]:
    """Return the continuous reference cells under hook poses: (..., 3) slew, radius, height -> (..., 3) float64."""
    at = np.asarray(axes, dtype=np.float64)
    radius = at[..., 1] / load.voxel_size_m
    x = load.axis_x + radius * np.cos(at[..., 0])
    y = load.axis_y + radius * np.sin(at[..., 0])
    return np.stack([x, y, (at[..., 2] - load.zero_height_m) / load.voxel_size_m], axis=-1)
