"""Raw cells for the proof of a motion: the positions of a load between samples, and what occupies its cells.

This module does not use the summed-area table, a hook floor or the swept check, which make the motions. Positions come
from the crane's forward kinematics, and occupancy is counted cell by cell.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import inline_kernel, kernel
from bimvox.crane.kinematics import hook_of
from bimvox.crane.tower_crane import TowerCrane
from bimvox.grid.frame import GridFrame
from bimvox.proof.moment import Thing
from bimvox.records.lift import Lift
from bimvox.records.motion import Trajectory
from bimvox.site.component import IntVec

_ROOM = 4096
"""Initial size of the cell table, a power of two."""


class Placements:
    """The whole placements whose cells together cover a load at continuous reference cells: up to eight per position.

    Args:
        positions: (N, 3) float64 reference cells.
        slack_vox: (N,) positions this close to a whole cell are snapped to it.

    Attributes:
        cells: (U, 3) int64 unique reference cells of the placements.
    """

    def __init__(self, positions: NDArray[np.float64], slack_vox: NDArray[np.float64]) -> None:
        self._positions = np.ascontiguousarray(positions, np.float64)
        self._slack_vox = np.ascontiguousarray(slack_vox, np.float64)
        self.cells: NDArray[np.int64] = _numbered(self._positions, self._slack_vox, False)[0]

    @cached_property
    def around(self) -> NDArray[np.int64]:
        """(8, N) int64 rows of ``cells`` around each position; some may be equal."""
        around: NDArray[np.int64] = _numbered(self._positions, self._slack_vox, True)[1]
        return around

    def at_positions(self, found: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return (N,) whether ``found`` ((U,) bool) holds for any placement around each position."""
        if not found.any():
            return np.zeros(len(self._positions), np.bool_)
        at: NDArray[np.bool_] = _any_around(found, self.around)
        return at

    def at(self, position: int) -> NDArray[np.int64]:
        """Return (M, 3) the placements around one position."""
        placements: NDArray[np.int64] = self.cells[np.unique(self.around[:, position])]
        return placements


@kernel
def _numbered(
    cells: NDArray[np.float64], slack_vox: NDArray[np.float64], with_numbers: bool
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Number the whole cells around positions in order of appearance; optionally list those around each position.

    Most positions are between the same whole cells as the previous one; the cells of others are found in a hash table.
    """
    count = cells.shape[0]
    at = np.empty((8, count if with_numbers else 0), np.int64)
    whole, table, total = np.empty((_ROOM // 2, 3), np.int64), np.zeros(_ROOM, np.int32), 0
    ends, before = np.zeros((2, 3), np.int64), np.zeros((2, 3), np.int64)
    for n in range(count):
        anew = n == 0
        for k in range(3):
            ends[0, k] = int(np.floor(cells[n, k] + slack_vox[n]))
            ends[1, k] = int(np.ceil(cells[n, k] - slack_vox[n]))
            anew |= ends[0, k] != before[0, k] or ends[1, k] != before[1, k]
            before[0, k], before[1, k] = ends[0, k], ends[1, k]
        if not anew:
            for c in range(8 if with_numbers else 0):
                at[c, n] = at[c, n - 1]
            continue
        if total + 8 > whole.shape[0]:
            whole, table = _with_more_room(whole, total)
        for c in range(8):
            x, y, z = ends[c // 4, 0], ends[c // 2 % 2, 1], ends[c % 2, 2]
            slot = _slot(table, whole, x, y, z)
            if table[slot] == 0:
                whole[total, 0], whole[total, 1], whole[total, 2] = x, y, z
                total += 1
                table[slot] = total
            if with_numbers:
                at[c, n] = table[slot] - 1
    return whole[:total].copy(), at


@inline_kernel
def _slot(table: NDArray[np.int32], whole: NDArray[np.int64], x: int, y: int, z: int) -> int:
    """Return the slot of a cell's number plus one in a hash table that is at least half empty; a free slot if absent.

    Open addressing; the hash is that of Teschner et al., Optimized Spatial Hashing for Collision Detection of
    Deformable Objects (2003).
    """
    last = table.shape[0] - 1
    slot: int = (x * 73856093 ^ y * 19349663 ^ z * 83492791) & last
    while table[slot] > 0:
        number = table[slot] - 1
        if whole[number, 0] == x and whole[number, 1] == y and whole[number, 2] == z:
            break
        slot = (slot + 1) & last
    return slot


@kernel
def _with_more_room(whole: NDArray[np.int64], total: int) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Return arrays for four times as many cells, with the table of the existing ones."""
    more = np.empty((4 * whole.shape[0], 3), np.int64)
    table = np.zeros(2 * more.shape[0], np.int32)
    for n in range(total):
        more[n] = whole[n]
        table[_slot(table, more, more[n, 0], more[n, 1], more[n, 2])] = n + 1
    return more, table


@kernel
def _any_around(found: NDArray[np.bool_], around: NDArray[np.int64]) -> NDArray[np.bool_]:
    at = np.zeros(around.shape[1], np.bool_)
    for c in range(around.shape[0]):
        for n in range(around.shape[1]):
            at[n] |= found[around[c, n]]
    return at


class Marks:
    """Counts of things by cell.

    Cells that an invalid plan puts outside the grid are ignored; other checks report them.

    Args:
        shape: (X, Y, Z) of the site.
        present: What is there initially.

    Attributes:
        counts: (X, Y, Z) uint16.
    """

    def __init__(self, shape: IntVec, present: Sequence[Thing] = ()) -> None:
        self.counts = np.zeros(shape, np.uint16)
        self._given: Sequence[Thing] = ()
        self._present: set[Thing] = set()
        self.move_to(present)

    def move_to(self, present: Sequence[Thing]) -> None:
        """Update the counts so that exactly these things are present."""
        if present is self._given:
            return
        wanted = set(present)
        for thing in self._present - wanted:
            self._mark(thing, -1)
        for thing in wanted - self._present:
            self._mark(thing, 1)
        self._given, self._present = present, wanted

    @contextmanager
    def without(self, things: Sequence[Thing]) -> Iterator[None]:
        """Remove some of the things temporarily; nothing else may change meanwhile."""
        gone = self._present.intersection(things)
        self._present -= gone
        for thing in gone:
            self._mark(thing, -1)
        try:
            yield
        finally:
            for thing in gone:
                self._mark(thing, 1)
            self._present |= gone

    def _mark(self, thing: Thing, number: int) -> None:
        """Add a number to the counts of the cells that count for a thing."""
        _count(self.counts, thing.cells, number)

    def hits(self, own: NDArray[np.int32], placements: NDArray[np.int32] | NDArray[np.int64]) -> NDArray[np.bool_]:
        """Return (N,) whether any of a part's cells ((C, 3)) is occupied at each placement ((N, 3))."""
        hit: NDArray[np.bool_] = hits(self.counts, own, np.ascontiguousarray(placements, np.int64))
        return hit

    def over(self, hooks: NDArray[np.int32] | NDArray[np.int64]) -> NDArray[np.bool_]:
        """Return (N,) whether anything is in or above each cell ((N, 3)); False outside the grid."""
        hit: NDArray[np.bool_] = over(self.counts, np.ascontiguousarray(hooks, np.int64))
        return hit


@kernel
def _count(counts: NDArray[np.uint16], cells: NDArray[np.int32], number: int) -> None:
    nx, ny, nz = counts.shape
    for n in range(cells.shape[0]):
        x, y, z = cells[n, 0], cells[n, 1], cells[n, 2]
        if 0 <= x < nx and 0 <= y < ny and 0 <= z < nz:
            counts[x, y, z] += number


@kernel
def hits(counts: NDArray[np.uint16], own: NDArray[np.int32], placements: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return (N,) whether any of a part's cells ((C, 3)) is counted at each placement; False outside the grid."""
    nx, ny, nz = counts.shape
    hit = np.zeros(placements.shape[0], np.bool_)
    for n in range(placements.shape[0]):
        for c in range(own.shape[0]):
            x, y, z = placements[n, 0] + own[c, 0], placements[n, 1] + own[c, 1], placements[n, 2] + own[c, 2]
            if 0 <= x < nx and 0 <= y < ny and 0 <= z < nz and counts[x, y, z]:
                hit[n] = True
                break
    return hit


@kernel
def over(counts: NDArray[np.uint16], hooks: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Find the top of each column once, and keep it for later placements."""
    nx, ny, nz = counts.shape
    hit = np.zeros(hooks.shape[0], np.bool_)
    column_x, column_y, top = np.int64(-1), np.int64(-1), 0
    for n in range(hooks.shape[0]):
        x, y = hooks[n, 0], hooks[n, 1]
        if not (0 <= x < nx and 0 <= y < ny):
            continue
        if x != column_x or y != column_y:
            column_x, column_y, top = x, y, nz
            while top > 0 and counts[x, y, top - 1] == 0:
                top -= 1
        hit[n] = top > hooks[n, 2]
    return hit


Line = tuple[float, float, float]

SPACING_VOX = 0.125
_MOST_BETWEEN = 4096
_AT_SAMPLE_VOX = 1e-5
BETWEEN_VOX = 0.05
"""How far into a cell a position between two samples may reach. If one axis accelerates while another decelerates, the
motion is curved, and the chord between two samples cuts off this much (a t^2 / 8; measured up to 0.05)."""
ALWAYS_NS = (-(2**62), 2**62)
"""A time span that contains every motion."""


class _Way(NamedTuple):
    """Positions along a trajectory, an eighth of a cell apart or less: its samples, and points on the chords between.

    Attributes:
        axes: (N, 3) float64 slew (rad), radius (m), height (m).
        sample: (N,) int64 index of the sample at or before each.
        slack_vox: (N,) float64 how far each may reach into a cell.
    """

    axes: NDArray[np.float64]
    sample: NDArray[np.int64]
    slack_vox: NDArray[np.float64]


def within(trajectory: Trajectory, way: _Way, start_ns: int, window_ns: tuple[int, int]) -> NDArray[np.bool_]:
    """Return (N,) which positions of a trajectory, of a lift that starts at ``start_ns``, belong to a time span.

    A position belongs to the whole time between the samples around it, so a span's border is on the safe side.
    """
    time_ns = trajectory.time_ns + np.int64(start_ns)
    next_ns = np.append(time_ns[1:], time_ns[-1])
    inside: NDArray[np.bool_] = (next_ns[way.sample] >= window_ns[0]) & (time_ns[way.sample] <= window_ns[1])
    return inside


class _Positions(NamedTuple):
    """Where a load is along a trajectory.

    Attributes:
        way: The positions as axes of the crane.
        cells: (N, 3) float64 the reference cells there.
        placements: Whole placements around them.
    """

    way: _Way
    cells: NDArray[np.float64]
    placements: Placements


@lru_cache(maxsize=64)  # a proof and the footprints after it ask for the same trajectories, about 20 lifts at a time
def positions_of(
    crane: TowerCrane, frame: GridFrame, trajectory: Trajectory, hook_line_vox: Line = (0.0, 0.0, 0.0)
) -> _Positions:
    """Return where a load is along a trajectory of a crane that is rigged for it (by default the empty hook)."""
    way = way_of(crane, trajectory.axes, frame.voxel_size_m)
    cells = reference_cells(crane, frame, way.axes, hook_line_vox)
    return _Positions(way, cells, Placements(cells, way.slack_vox))


def whole_cells(distance_m: float, frame: GridFrame) -> int:
    """Return a distance rounded up to whole cells."""
    return int(np.ceil(distance_m / frame.voxel_size_m - 1e-9))


def way_of(crane: TowerCrane, axes: NDArray[np.float64], voxel_size_m: float) -> _Way:
    """Return the positions between samples ((N, 3) slew, radius, height), straight in the axes."""
    axes = np.ascontiguousarray(axes, np.float64)
    return _Way(*_between(axes, hook_of(crane, *axes.T), SPACING_VOX * voxel_size_m))


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
