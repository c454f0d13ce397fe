"""Raw cells for the proof of a motion: the positions of a load between samples, and what occupies its cells.

This module does not use the summed-area table, a hook floor or the swept check, which make the motions. Positions come
from the crane's forward kinematics, and occupancy is counted cell by cell.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.crane.kinematics import hook_of
from bimvox.crane.tower_crane import TowerCrane
from bimvox.grid.frame import GridFrame
from bimvox.proof.marks import Marks
from bimvox.proof.placements import Placements
from bimvox.records.lift import Lift
from bimvox.records.motion import Trajectory
from bimvox.site.component import IntVec

Line = tuple[float, float, float]

SPACING_VOX = 0.125
_MOST_BETWEEN = 4096
_AT_SAMPLE_VOX = 1e-5
BETWEEN_VOX = 0.05
"""How far into a cell a position between two samples may reach. If one axis accelerates while another decelerates, the
motion is curved, and the chord between two samples cuts off this much (a t^2 / 8; measured up to 0.05)."""
ALWAYS_NS = (-(2**62), 2**62)
"""A time span that contains every motion."""


class Way(NamedTuple):
    """Positions along a trajectory, an eighth of a cell apart or less: its samples, and points on the chords between.

    Attributes:
        axes: (N, 3) float64 slew (rad), radius (m), height (m).
        sample: (N,) int64 index of the sample at or before each.
        slack_vox: (N,) float64 how far each may reach into a cell.
    """

    axes: NDArray[np.float64]
    sample: NDArray[np.int64]
    slack_vox: NDArray[np.float64]


def within(trajectory: Trajectory, way: Way, start_ns: int, window_ns: tuple[int, int]) -> NDArray[np.bool_]:
    """Return (N,) which positions of a trajectory, of a lift that starts at ``start_ns``, belong to a time span.

    A position belongs to the whole time between the samples around it, so a span's border is on the safe side.
    """
    time_ns = trajectory.time_ns + np.int64(start_ns)
    next_ns = np.append(time_ns[1:], time_ns[-1])
    inside: NDArray[np.bool_] = (next_ns[way.sample] >= window_ns[0]) & (time_ns[way.sample] <= window_ns[1])
    return inside


class Positions(NamedTuple):
    """Where a load is along a trajectory.

    Attributes:
        way: The positions as axes of the crane.
        cells: (N, 3) float64 the reference cells there.
        placements: Whole placements around them.
    """

    way: Way
    cells: NDArray[np.float64]
    placements: Placements


@lru_cache(maxsize=64)  # a proof and the footprints after it ask for the same trajectories, about 20 lifts at a time
def positions_of(
    crane: TowerCrane, frame: GridFrame, trajectory: Trajectory, hook_line_vox: Line = (0.0, 0.0, 0.0)
) -> Positions:
    """Return where a load is along a trajectory of a crane that is rigged for it (by default the empty hook)."""
    way = way_of(crane, trajectory.axes, frame.voxel_size_m)
    cells = reference_cells(crane, frame, way.axes, hook_line_vox)
    return Positions(way, cells, Placements(cells, way.slack_vox))


def whole_cells(distance_m: float, frame: GridFrame) -> int:
    """Return a distance rounded up to whole cells."""
    return int(np.ceil(distance_m / frame.voxel_size_m - 1e-9))


def way_of(crane: TowerCrane, axes: NDArray[np.float64], voxel_size_m: float) -> Way:
    """Return the positions between samples ((N, 3) slew, radius, height), straight in the axes."""
    axes = np.ascontiguousarray(axes, np.float64)
    return Way(*_between(axes, hook_of(crane, *axes.T), SPACING_VOX * voxel_size_m))


@kernel
def _between(
    axes: NDArray[np.float64], hook_m: NDArray[np.float64], spacing_m: float
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64]]:
    """Return the samples, and points on the chords between them if the hook moves further than a spacing."""
    count = axes.shape[0]
    parts, total = np.empty(count, np.int64), 0
    for n in range(count):
        m = min(n + 1, count - 1)
        x, y, z = hook_m[m, 0] - hook_m[n, 0], hook_m[m, 1] - hook_m[n, 1], hook_m[m, 2] - hook_m[n, 2]
        parts[n] = min(max(np.ceil(np.sqrt(x * x + y * y + z * z) / spacing_m), 1), _MOST_BETWEEN)
        total += parts[n]
    between, sample, slack = np.empty((total, 3)), np.empty(total, np.int64), np.empty(total)
    at = 0
    for n in range(count):
        for part in range(parts[n]):
            share = part / parts[n]
            for k in range(3):
                between[at, k] = axes[n, k]
                if part > 0:
                    between[at, k] += share * (axes[n + 1, k] - axes[n, k])
            sample[at] = n
            slack[at] = _AT_SAMPLE_VOX if part == 0 else BETWEEN_VOX
            at += 1
    return between, sample, slack


def reference_cells(
    crane: TowerCrane, frame: GridFrame, axes: NDArray[np.float64], hook_line_vox: Line
) -> NDArray[np.float64]:
    """Return the continuous reference cells ((N, 3)) of a load at hook poses ((N, 3) slew, radius, height).

    The hook is one sling's length above the load's top, half a cell in x and y from ``hook_line_vox``, which counts
    from the reference cell (zero for the empty hook).
    """
    return cells_below(crane, frame, hook_of(crane, *axes.T), hook_line_vox)


def cells_below(
    crane: TowerCrane, frame: GridFrame, hook_m: NDArray[np.float64], hook_line_vox: Line
) -> NDArray[np.float64]:
    """Return the reference cells of a load at hook positions ((N, 3), metres)."""
    x_m, y_m, z_m = frame.origin_m
    x, y, z = hook_line_vox
    cells: NDArray[np.float64] = hook_m - np.array([x_m, y_m, z_m + crane.sling_m])
    cells /= frame.voxel_size_m
    cells -= np.array([x + 0.5, y + 0.5, z])
    return cells


def tail_of(cells: NDArray[np.float64], lift: Lift | None) -> NDArray[np.bool_]:
    """Return (N,) which positions ((N, 3) reference cells) are on the last moves of a lift.

    These are at the end, on the line through the placements that were in contact.
    """
    if lift is None or lift.path_vox is None or lift.contact_moves <= 0:
        return np.zeros(len(cells), np.bool_)
    placements = lift.path_vox[-1 - min(lift.contact_moves, len(lift.path_vox) - 1) :]
    boxes = np.sort(np.stack([placements[:-1], placements[1:]]), axis=0)
    tail: NDArray[np.bool_] = _last_within(cells, boxes[0] - BETWEEN_VOX, boxes[1] + BETWEEN_VOX)
    return tail


@kernel
def _last_within(cells: NDArray[np.float64], low: NDArray[np.float64], high: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return (N,) which positions are in any of some boxes ((B, 3)) and stay in them until the end."""
    last = np.zeros(cells.shape[0], np.bool_)
    for n in range(cells.shape[0] - 1, -1, -1):
        x, y, z = cells[n, 0], cells[n, 1], cells[n, 2]
        for b in range(low.shape[0]):
            inside = low[b, 0] <= x <= high[b, 0] and low[b, 1] <= y <= high[b, 1]
            if inside and low[b, 2] <= z <= high[b, 2]:
                last[n] = True
                break
        if not last[n]:
            return last
    return last


@kernel
def _within(cells: NDArray[np.int64], low: NDArray[np.int64], high: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return (N,) which cells are in a box, both ends inclusive."""
    within = np.empty(cells.shape[0], np.bool_)
    for n in range(cells.shape[0]):
        within[n] = True
        for k in range(3):
            if not low[k] <= cells[n, k] <= high[k]:
                within[n] = False
    return within


class RawCells(Marks):
    """Counts of things in each cell, with queries for the placements of a load."""

    def holds(self, placements: Placements, own: NDArray[np.int32]) -> NDArray[np.bool_]:
        """Return (U,) whether all cells ((C, 3) relative to the reference cell) are inside the grid at a placement."""
        first, last = own.min(axis=0), np.array(self.counts.shape) - 1 - own.max(axis=0)
        inside: NDArray[np.bool_] = _within(placements.cells, -first.astype(np.int64), last)
        return inside

    def meets(self, placements: Placements, own: NDArray[np.int32]) -> NDArray[np.bool_]:
        """Return (U,) whether any cell is occupied at a placement; False if it is not inside the grid."""
        met: NDArray[np.bool_] = self.hits(own, placements.cells) & self.holds(placements, own)
        return met

    def line_meets(self, placements: Placements, hook_offset: IntVec) -> NDArray[np.bool_]:
        """Return (U,) whether anything is in the hook's column, from the hook cell up; False outside the grid."""
        return self.over(placements.cells + np.array(hook_offset))
