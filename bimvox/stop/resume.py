"""The motion of a stopped load, or of a stopped empty hook, from where it rests to its place."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.tower_crane import CranePose
from bimvox.errors import PlanningError
from bimvox.motion.drive import drive_path
from bimvox.motion.load_frame import HookEnd, LoadFrame, axes_of_cells, cells_of_axes, pose_next_to
from bimvox.motion.move import Line, Move, axes_of
from bimvox.motion.rigged_crane import RiggedCrane
from bimvox.motion.shortcut import move_is_free
from bimvox.motion.timeline import Timeline, followed, in_sequence
from bimvox.records.guide import Guide
from bimvox.site.collision import CollisionSpace, placement_is_free


def resume_cells(space: CollisionSpace, load: LoadFrame, pose: CranePose) -> list[tuple[int, int, int]]:
    """Return the whole placements around a pose that a load can reach in a straight line, the nearest first.

    A path from one of them can be driven from the pose (:func:`resume`). Empty if the load is stuck.
    """
    at = cells_of_axes(load, axes_of(pose))
    cells = sorted(_around(at), key=lambda cell: (round(float(np.linalg.norm(np.subtract(cell, at))), 9), cell))
    return [
        cell
        for cell in cells
        if placement_is_free(space, *cell) and move_is_free(space, load, move_to_cell(load, pose, cell))
    ]


def resume(
    rigged: RiggedCrane,
    space: CollisionSpace,
    pose: CranePose,
    path_vox: NDArray[np.int32],
    contact_moves: int,
    guide: Guide | None = None,
    end_vox: HookEnd | None = None,
) -> tuple[Timeline, float]:
    """Return the motion of a load from rest at any pose to the end of a voxel path that begins next to it.

    Args:
        rigged: The crane with its load.
        space: The collision rule.
        pose: Where the crane rests.
        path_vox: (N, 3) int32 reference cells, N >= 2, the first one of :func:`resume_cells`.
        contact_moves: How many of the last placements were cleared by the narrow phase.
        guide: How a crew guides the load on its last moves.
        end_vox: Where the hook stops within the path's last cell; None: in the middle.

    Returns:
        The motion, and the height that the hook has to reach.

    Raises:
        PlanningError: If the first cell cannot be reached, the path is not free, or takes the hook above the jib.
    """
    load = rigged.load
    first = move_to_cell(load, pose, (int(path_vox[0, 0]), int(path_vox[0, 1]), int(path_vox[0, 2])))
    if not move_is_free(space, load, first):
        raise PlanningError(
            f"cell {path_vox[0].tolist()} cannot be reached from where the crane rests",
            hint="begin the path at one of the free cells around the load",
        )
    onward, needed_m = drive_path(rigged, space, path_vox, contact_moves, first.end.slew_rad, guide)
    if any(first.moving):
        onward = followed(in_sequence(rigged.crane, [first], rigged.pendulum), onward)
        needed_m = max(needed_m, pose.height_m)
    arrived = onward.moves[-1].end
    end = arrived if end_vox is None else pose_next_to(load, end_vox, arrived)
    if end != arrived:
        onward = followed(onward, in_sequence(rigged.crane, [Move(arrived, end, Line.SITE)], rigged.pendulum))
    return onward, needed_m


def _around(at: NDArray[np.float64]) -> Iterator[tuple[int, int, int]]:
    """Yield the up to eight whole placements around a continuous one."""
    low, high = np.floor(at + 1e-6).astype(int), np.ceil(at - 1e-6).astype(int)
    for x in range(low[0], high[0] + 1):
        for y in range(low[1], high[1] + 1):
            for z in range(low[2], high[2] + 1):
                yield (x, y, z)


def move_to_cell(load: LoadFrame, pose: CranePose, cell: tuple[int, int, int]) -> Move:
    """Return the straight move in the axes from a pose to a whole placement next to it."""
    slew, radius, height = axes_of_cells(load, np.array(cell)).tolist()
    turned = pose.slew_rad + float(np.remainder(slew - pose.slew_rad + np.pi, 2.0 * np.pi)) - np.pi
    return Move(pose, CranePose(turned, radius, height))
