"""What a planner that the caller brings may ask about one lift: where the load may be, and what is in the way."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.grid.frame import GridFrame
from bimvox.grid.summed_area import boxes_of
from bimvox.planning.search import which_free
from bimvox.planning.stage import Transit
from bimvox.site.component import IntVec

Cell = Sequence[int] | NDArray[np.integer[Any]]
"""A placement: x, y and z."""

_LARGEST = 2.0**31


class LiftSpace:
    """Where the load of one lift may be, and what is in its way; nothing of it can be changed.

    A *placement* is the cell of the load's reference cell, its lowest corner; the load does not turn relative to it.
    :attr:`free` is the engine's collision rule at the turn of this lift, for every placement: load and clearances, rope
    and hook, reach and capacity of the crane, zones. A path is a list of free placements; the last moves, from the goal
    down into place, are the engine's. Near the yard, placements straight above the start may be free only for a load
    that rises from it: a path does not come back to them.

    Args:
        transit: The lift.
        frame: The grid of the site.

    Attributes:
        shape: (X, Y, Z) number of placements along each axis; they count from 0.
        cell_m: Edge of a cell, metres.
        start_vox: The placement from which the load starts, above the yard.
        goal_vox: The placement at which it must arrive, next to its place.
        part: Id of the part; empty if it is not known.
        part_size_m: Edges of the part's box, metres.
        free: (X, Y, Z) bool, read-only: whether each placement is free.
    """

    def __init__(self, transit: Transit, frame: GridFrame) -> None:
        self._space, self._frame, part = transit.space, frame, transit.component
        x, y, z = (int(n) - 1 for n in transit.space.table.shape)
        self.shape: IntVec = (x, y, z)
        self.cell_m = frame.voxel_size_m
        self.start_vox, self.goal_vox = transit.start_vox, transit.goal_vox
        self.part = "" if part is None else part.id
        boxes = transit.space.boxes if part is None else part.shape.boxes
        self.part_size_m: NDArray[np.float64] = frame.voxel_size_m * (
            boxes[:, 3:].max(axis=0) - boxes[:, :3].min(axis=0)
        )
        every = np.indices(self.shape, np.int32).reshape(3, -1).T
        self.free: NDArray[np.bool_] = which_free(transit.space, np.ascontiguousarray(every)).reshape(self.shape)
        self.free.flags.writeable = False

    @property
    def bounds_m(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The lowest and the highest corner of the grid, (3,) float64 each, site metres."""
        return self._frame.corner_of((0, 0, 0)), self._frame.corner_of(self.shape)

    @cached_property
    def obstacles_m(self) -> NDArray[np.float64]:
        """(N, 6) float64 boxes ``x0 y0 z0 x1 y1 z1``, site metres: the occupied cells, each in one box.

        What is free also depends on clearances, the hook and the crane: :attr:`free` decides.
        """
        occupied = np.diff(np.diff(np.diff(self._space.table, axis=0), axis=1), axis=2) > 0
        corners = boxes_of(occupied).reshape(-1, 3)
        return self._frame.corner_of(corners).reshape(-1, 6)

    @cached_property
    def _distances_m(self) -> NDArray[np.float64]:
        from scipy.ndimage import distance_transform_edt  # takes long to import, and few planners ask

        padded = np.pad(self.free, 1)
        found: NDArray[np.float64] = self.cell_m * distance_transform_edt(padded)[1:-1, 1:-1, 1:-1]
        return found

    def is_free(self, cell: Cell) -> bool:
        """Return whether the load may be at a placement, three whole numbers; outside the grid it may not."""
        x, y, z = cell
        nx, ny, nz = self.shape
        return bool(0 <= x < nx and 0 <= y < ny and 0 <= z < nz and self.free[x, y, z])

    def are_free(self, cells: ArrayLike) -> NDArray[np.bool_]:
        """Return whether the load may be at placements: (N,) bool of (N, 3)."""
        placements = whole_cells(cells)
        inside = ((placements >= 0) & (placements < self.shape)).all(axis=1)
        free = np.zeros(len(placements), np.bool_)
        free[inside] = self.free[tuple(placements[inside].T)]
        return free

    def distance_m(self, cells: ArrayLike) -> NDArray[np.float64]:
        """Return how far placements are from the nearest one that is not free: (N,) float64 metres of (N, 3).

        The Euclidean distance between the two placements, as points of the grid. It is 0 where the load may not be, and
        at least one cell elsewhere. All placements outside the grid count as not free. So the load may be moved by less
        than this in any direction.
        """
        placements = whole_cells(cells)
        inside = ((placements >= 0) & (placements < self.shape)).all(axis=1)
        found = np.zeros(len(placements))
        found[inside] = self._distances_m[tuple(placements[inside].T)]
        return found

    def line(self, start: Cell, end: Cell) -> NDArray[np.int64]:
        """Return the placements between two, both included, one unit move apart: (N, 3) int64, near the straight line.

        Waypoints of a planner are joined in the same way, so ``are_free(line(a, b)).all()`` is what the engine asks. It
        is the same from either end.
        """
        return joined(whole_cells(np.stack([start, end])))

    def cells_of(self, points_m: ArrayLike) -> NDArray[np.int64]:
        """Return the cells that hold points in site metres: (N, 3) int64 of (N, 3)."""
        return self._frame.cell_of(points_m)

    def metres_of(self, cells: ArrayLike) -> NDArray[np.float64]:
        """Return the lowest corners of cells, site metres: (N, 3) float64 of (N, 3)."""
        return self._frame.corner_of(cells)


def whole_cells(cells: ArrayLike) -> NDArray[np.int64]:
    """Return (N, 3) placements as whole numbers; fractions are rounded.

    Raises:
        ValueError: If they are not (N, 3) finite numbers.
    """
    given = np.asarray(cells)
    if given.ndim != 2 or given.shape[1] != 3 or given.dtype.kind not in "iuf":
        raise ValueError(f"an array of shape {given.shape} of {given.dtype}, not (N, 3) numbers")
    if not np.isfinite(given).all():
        raise ValueError("numbers that are NaN or infinite")
    rounded: NDArray[np.int64] = np.rint(np.clip(given, -_LARGEST, _LARGEST)).astype(np.int64)
    return rounded


def joined(waypoints: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the placements along waypoints, (N, 3) of (M, 3), one unit move apart.

    A waypoint twice in a row counts once. The moves of a leg are spread evenly along each axis, in the same way from
    either end of it.
    """
    legs = [waypoints[:1]]
    for start, end in pairwise(waypoints):
        is_backward = tuple(end) < tuple(start)
        first, way = (end, start - end) if is_backward else (start, end - start)
        counts = np.abs(way)
        axis = np.repeat(np.arange(3), counts)
        share = np.concatenate([(np.arange(n) + 0.5) / max(n, 1) for n in counts])
        moves = np.zeros((1 + len(axis), 3), np.int64)
        moves[0] = first
        order = axis[np.argsort(share, kind="stable")]
        moves[1 + np.arange(len(axis)), order] = np.sign(way)[order]
        cells = moves.cumsum(axis=0)
        legs.append(cells[::-1][1:] if is_backward else cells[1:])
    return np.concatenate(legs)
