"""A load at continuous positions: from hook poses to reference cells and back, and the collision check of a motion.

At a continuous position the load lies within the cells of the up to eight placements around it (floor and ceiling of
each coordinate). A position is free if all of them are. A line is free if every position on it is; this is proven, not
sampled: the line is cut into pieces, each inside a box of positions (its ends, widened by the most that the line can
bulge between them), and a piece is free if every placement around its box is. Other pieces are halved, down to a
sixteenth of a cell.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.compiled import inline_kernel, kernel, leaf_kernel
from bimvox.crane.kinematics import nearest_turn
from bimvox.crane.reach import ColumnFrame
from bimvox.crane.tower_crane import CranePose, TowerCrane
from bimvox.site.collision import CollisionSpace, placement_is_free, range_is_free

# From hook poses to (continuous) reference cells of the load and back.
#
# The load keeps its heading while the crane slews, by tag line: it is only translated, as on the voxel path. The hook
# is above the load's centre of mass, one sling length above its top.

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


SNAP_VOX = 1e-6
"""Rounding noise: a coordinate this close to a whole cell counts as that cell."""

_FINEST_VOX = 1.0 / 16.0
_NOWHERE = (0, 0, 0, -1, -1, -1)
_STRETCHES = (64, 8)
"""Samples that are checked together first; where they may meet something, in fewer, and then one by one."""
_ROUNDING_VOX = 1e-9


@leaf_kernel
def box_is_free(space: CollisionSpace, x0: float, y0: float, z0: float, x1: float, y1: float, z1: float) -> bool:
    """Return whether every placement around the positions [x0, x1] x [y0, y1] x [z0, z1] (reference cells) is free."""
    return _all_free(space, _around(x0, y0, z0, x1, y1, z1))


@inline_kernel
def _around(x0: float, y0: float, z0: float, x1: float, y1: float, z1: float) -> tuple[int, int, int, int, int, int]:
    """First and last placement around positions, both inclusive."""
    return (
        int(np.floor(x0 + SNAP_VOX)),
        int(np.floor(y0 + SNAP_VOX)),
        int(np.floor(z0 + SNAP_VOX)),
        int(np.ceil(x1 - SNAP_VOX)),
        int(np.ceil(y1 - SNAP_VOX)),
        int(np.ceil(z1 - SNAP_VOX)),
    )


@leaf_kernel
def _all_free(space: CollisionSpace, around: tuple[int, int, int, int, int, int]) -> bool:
    if range_is_free(space, around):
        return True
    for x in range(around[0], around[3] + 1):
        for y in range(around[1], around[4] + 1):
            for z in range(around[2], around[5] + 1):
                if not placement_is_free(space, x, y, z):
                    return False
    return True


@leaf_kernel
def _at(
    load: LoadFrame, start: NDArray[np.float64], end: NDArray[np.float64], straight: bool, u: float
) -> tuple[float, float, float]:
    """Reference cell coordinates at share ``u`` of a line."""
    size = load.voxel_size_m
    z = (start[2] + u * (end[2] - start[2]) - load.zero_height_m) / size
    if straight:
        x0, y0 = start[1] * np.cos(start[0]), start[1] * np.sin(start[0])
        x1, y1 = end[1] * np.cos(end[0]), end[1] * np.sin(end[0])
        return load.axis_x + (x0 + u * (x1 - x0)) / size, load.axis_y + (y0 + u * (y1 - y0)) / size, z
    slew = start[0] + u * (end[0] - start[0])
    radius = (start[1] + u * (end[1] - start[1])) / size
    return load.axis_x + radius * np.cos(slew), load.axis_y + radius * np.sin(slew), z


@kernel
def line_is_free(
    space: CollisionSpace, load: LoadFrame, start: NDArray[np.float64], end: NDArray[np.float64], straight: bool
) -> bool:
    """Return whether every position on a line is free.

    Args:
        space: The collision rule.
        load: How hook poses and reference cells correspond.
        start: (3,) slew, radius, height at the start.
        end: (3,) at the end; slew unwrapped.
        straight: Whether the line is straight in the site's frame; otherwise it is straight in the axes.
    """
    size = load.voxel_size_m
    turn, run, rise = abs(end[0] - start[0]), abs(end[1] - start[1]), abs(end[2] - start[2])
    widest = max(start[1], end[1])
    length = np.sqrt((widest * turn) ** 2 + run**2 + rise**2) / size
    # |p''| of the spiral r(u) (cos, sin)(theta(u)); between two points a curve bulges at most |p''| du^2 / 8.
    bend = 0.0 if straight else (2.0 * run * turn + widest * turn**2) / size
    pieces = max(1, int(np.ceil(length)))
    stack = np.empty((64, 2), np.float64)
    for piece in range(pieces):
        stack[0, 0], stack[0, 1] = piece / pieces, (piece + 1) / pieces
        depth = 1
        while depth > 0:
            depth -= 1
            u0, u1 = stack[depth, 0], stack[depth, 1]
            x0, y0, z0 = _at(load, start, end, straight, u0)
            x1, y1, z1 = _at(load, start, end, straight, u1)
            bulge = bend * (u1 - u0) ** 2 / 8.0
            if box_is_free(
                space,
                min(x0, x1) - bulge,
                min(y0, y1) - bulge,
                min(z0, z1),
                max(x0, x1) + bulge,
                max(y0, y1) + bulge,
                max(z0, z1),
            ):
                continue
            middle = 0.5 * (u0 + u1)
            x, y, z = _at(load, start, end, straight, middle)
            if (u1 - u0) * length < _FINEST_VOX or not box_is_free(space, x, y, z, x, y, z):
                return False
            stack[depth, 0], stack[depth, 1] = middle, u1
            stack[depth + 1, 0], stack[depth + 1, 1] = u0, middle
            depth += 2
    return True


@leaf_kernel
def _stretch_is_free(
    space: CollisionSpace,
    load: LoadFrame,
    axes: NDArray[np.float64],
    first: int,
    last: int,
    sway_x_vox: float,
    sway_y_vox: float,
) -> bool:
    """Return whether the box around samples, both ends included, and a swing to either side is free as a whole.

    Then each sample is, and what is between them. Otherwise they may still be.
    """
    size = load.voxel_size_m
    slew0, slew1 = axes[first, 0], axes[first, 0]
    r0, r1 = axes[first, 1], axes[first, 1]
    z0, z1 = axes[first, 2], axes[first, 2]
    for i in range(first + 1, last + 1):
        slew0, slew1 = min(slew0, axes[i, 0]), max(slew1, axes[i, 0])
        r0, r1 = min(r0, axes[i, 1]), max(r1, axes[i, 1])
        z0, z1 = min(z0, axes[i, 2]), max(z1, axes[i, 2])
    r0, r1 = r0 / size, r1 / size
    c0, s0 = np.cos(slew0), np.sin(slew0)
    c1, s1 = (c0, s0) if slew1 == slew0 else (np.cos(slew1), np.sin(slew1))
    # Twice the bulge of the outer arc: a patch between two samples inside it has a bulge of its own.
    wider = r1 * (slew1 - slew0) ** 2 / 4.0 + _ROUNDING_VOX
    wider_x, wider_y = wider + sway_x_vox, wider + sway_y_vox
    around = _around(
        load.axis_x + min(r0 * c0, r0 * c1, r1 * c0, r1 * c1) - wider_x,
        load.axis_y + min(r0 * s0, r0 * s1, r1 * s0, r1 * s1) - wider_y,
        (z0 - load.zero_height_m) / size - _ROUNDING_VOX,
        load.axis_x + max(r0 * c0, r0 * c1, r1 * c0, r1 * c1) + wider_x,
        load.axis_y + max(r0 * s0, r0 * s1, r1 * s0, r1 * s1) + wider_y,
        (z1 - load.zero_height_m) / size + _ROUNDING_VOX,
    )
    return range_is_free(space, around)


@leaf_kernel
def samples_are_free(space: CollisionSpace, load: LoadFrame, axes: NDArray[np.float64]) -> bool:
    """Return whether a motion is free between its samples, as long as no axis reverses between two of them.

    Between two samples the hook is inside the sector patch that their slews and radii span. The patch lies inside the
    box of its four corners, widened by the bulge of its outer arc.

    Args:
        space: The collision rule.
        load: How hook poses and reference cells correspond.
        axes: (N, 3) slew, radius, height; close together, each axis monotone from sample to sample.
    """
    last = axes.shape[0] - 1
    for begin in range(0, last, _STRETCHES[0]):
        end = min(begin + _STRETCHES[0], last)
        if _stretch_is_free(space, load, axes, begin, end, 0.0, 0.0):
            continue
        for first in range(begin, end, _STRETCHES[1]):
            until = min(first + _STRETCHES[1], end)
            if _stretch_is_free(space, load, axes, first, until, 0.0, 0.0):
                continue
            if not _each_is_free(space, load, axes, first, until):
                return False
    return True


@leaf_kernel
def _each_is_free(
    space: CollisionSpace, load: LoadFrame, axes: NDArray[np.float64], first_sample: int, last_sample: int
) -> bool:
    """Return the same between each two neighbours of the samples from one to another."""
    size = load.voxel_size_m
    last = _NOWHERE
    c1, s1 = np.cos(axes[first_sample, 0]), np.sin(axes[first_sample, 0])
    for i in range(first_sample + 1, last_sample + 1):
        slew0, slew1 = axes[i - 1, 0], axes[i, 0]
        r0, r1 = axes[i - 1, 1] / size, axes[i, 1] / size
        z0, z1 = (axes[i - 1, 2] - load.zero_height_m) / size, (axes[i, 2] - load.zero_height_m) / size
        c0, s0 = c1, s1
        if slew1 != slew0:
            c1, s1 = np.cos(slew1), np.sin(slew1)
        bulge = max(r0, r1) * (slew1 - slew0) ** 2 / 8.0
        around = _around(
            load.axis_x + min(r0 * c0, r0 * c1, r1 * c0, r1 * c1) - bulge,
            load.axis_y + min(r0 * s0, r0 * s1, r1 * s0, r1 * s1) - bulge,
            min(z0, z1),
            load.axis_x + max(r0 * c0, r0 * c1, r1 * c0, r1 * c1) + bulge,
            load.axis_y + max(r0 * s0, r0 * s1, r1 * s0, r1 * s1) + bulge,
            max(z0, z1),
        )
        # Samples are close together: most have the same placements as the one before.
        if around != last:
            if not _all_free(space, around):
                return False
            last = around
    return True


@kernel
def swaying_is_free(
    space: CollisionSpace,
    load: LoadFrame,
    axes: NDArray[np.float64],
    sway_vox: NDArray[np.float64],
    looked_at: NDArray[np.bool_],
    both_sides: bool,
) -> int:
    """Return the first sample at which a swinging load may meet something; -1 if it never does.

    At a sample the load is in the box between its rest position and its swing, to that side or to either; between two
    samples it is in the box around both.

    Args:
        space: The collision rule.
        load: How hook poses and reference cells correspond.
        axes: (N, 3) slew, radius, height; close together.
        sway_vox: (N, 2) its swing on the plan, cells.
        looked_at: (N,) which samples are checked.
        both_sides: Whether it may be on the other side as well.
    """
    count = axes.shape[0]
    for begin in range(0, count, _STRETCHES[0]):
        end = min(begin + _STRETCHES[0], count)
        if _stretch_sways_free(space, load, axes, sway_vox, looked_at, begin, end):
            continue
        for first in range(begin, end, _STRETCHES[1]):
            until = min(first + _STRETCHES[1], end)
            if _stretch_sways_free(space, load, axes, sway_vox, looked_at, first, until):
                continue
            hit = _first_hit(space, load, axes, sway_vox, looked_at, both_sides, first, until)
            if hit >= 0:
                return hit
    return -1


@leaf_kernel
def _stretch_sways_free(
    space: CollisionSpace,
    load: LoadFrame,
    axes: NDArray[np.float64],
    sway_vox: NDArray[np.float64],
    looked_at: NDArray[np.bool_],
    begin: int,
    end: int,
) -> bool:
    """Return whether the box around the samples from one to the one before another, and their swings, is free.

    The sample before them counts too; if none of them is looked at, the answer is yes.
    """
    first, last = end, begin
    widest_x, widest_y = 0.0, 0.0
    for i in range(max(begin - 1, 0), end):
        if looked_at[i]:
            first, last = min(first, i), i
            widest_x, widest_y = max(widest_x, abs(sway_vox[i, 0])), max(widest_y, abs(sway_vox[i, 1]))
    return last < first or _stretch_is_free(space, load, axes, first, last, widest_x, widest_y)


@leaf_kernel
def _first_hit(
    space: CollisionSpace,
    load: LoadFrame,
    axes: NDArray[np.float64],
    sway_vox: NDArray[np.float64],
    looked_at: NDArray[np.bool_],
    both_sides: bool,
    begin: int,
    end: int,
) -> int:
    """Return the first sample from one to the one before another at which a swinging load may meet something, or -1."""
    size = load.voxel_size_m
    last = _NOWHERE
    was_x, was_y, was_z = 0.0, 0.0, 0.0
    slew, cos, sin = np.nan, 1.0, 0.0
    for i in range(max(begin - 1, 0), end):
        if not looked_at[i]:
            continue
        if axes[i, 0] != slew:
            slew = axes[i, 0]
            cos, sin = np.cos(slew), np.sin(slew)
        x = load.axis_x + axes[i, 1] / size * cos
        y = load.axis_y + axes[i, 1] / size * sin
        z = (axes[i, 2] - load.zero_height_m) / size
        x0, y0, z0, x1, y1, z1 = _swung(x, y, z, sway_vox[i, 0], sway_vox[i, 1], both_sides)
        if i > 0 and looked_at[i - 1]:
            a0, b0, c0, a1, b1, c1 = _swung(was_x, was_y, was_z, sway_vox[i - 1, 0], sway_vox[i - 1, 1], both_sides)
            x0, y0, z0 = min(x0, a0), min(y0, b0), min(z0, c0)
            x1, y1, z1 = max(x1, a1), max(y1, b1), max(z1, c1)
        was_x, was_y, was_z = x, y, z
        around = _around(x0, y0, z0, x1, y1, z1)
        if i >= begin and around != last:
            if not _all_free(space, around):
                return i
            last = around
    return -1


@inline_kernel
def _swung(
    x: float, y: float, z: float, dx: float, dy: float, both_sides: bool
) -> tuple[float, float, float, float, float, float]:
    """Return the lowest and the highest position of a load with this swing, to that side or to either."""
    if both_sides:
        return x - abs(dx), y - abs(dy), z, x + abs(dx), y + abs(dy), z
    return min(x, x + dx), min(y, y + dy), z, max(x, x + dx), max(y, y + dy), z
