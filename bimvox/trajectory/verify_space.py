"""Raw cells for the proof of a motion: where a load is between its samples, and what occupies those cells.

Nothing here asks the summed-area table, a hook floor or the swept check, by which motions are made: positions come from
the crane's forward kinematics, and what stands where is counted cell by cell.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.crane.kinematics import hook_of
from bimvox.crane.tower_crane import TowerCrane
from bimvox.grid.frame import GridFrame
from bimvox.planning.lift import Lift
from bimvox.planning.moment import Thing
from bimvox.site.component import IntVec
from bimvox.trajectory.trajectory import Trajectory

_SPACING_VOX = 0.125
_MOST_BETWEEN = 4096
_AT_SAMPLE_VOX = 1e-5
BETWEEN_VOX = 0.05
"""How far into a cell a position between two samples may reach: where one axis speeds up while another slows down the
motion is curved, and the chord between two of its samples cuts that much off (a t^2 / 8; measured up to 0.05)."""
_CHUNK = 4_000_000
ALWAYS_NS = (-(2**62), 2**62)
"""A span of time that holds every motion."""


class Way(NamedTuple):
    """Positions along a trajectory, an eighth of a cell apart or less: its samples, and points on the chords between.

    Attributes:
        axes: (N, 3) float64 slew (rad), radius (m), height (m).
        sample: (N,) int64 index of the sample that each is at or comes after.
        slack_vox: (N,) float64 how far each may reach into a cell.
    """

    axes: NDArray[np.float64]
    sample: NDArray[np.int64]
    slack_vox: NDArray[np.float64]


def within(trajectory: Trajectory, way: Way, start_ns: int, window_ns: tuple[int, int]) -> NDArray[np.bool_]:
    """Return (N,) which positions of a way belong to a span of time.

    A position belongs to all of the time between the samples around it, so that a span's border is on the safe side.

    Args:
        trajectory: Whose positions they are.
        way: The positions.
        start_ns: When its lift starts, on the site's clock.
        window_ns: From when until when.
    """
    time_ns = trajectory.time_ns + np.int64(start_ns)
    next_ns = np.append(time_ns[1:], time_ns[-1])
    inside: NDArray[np.bool_] = (next_ns[way.sample] >= window_ns[0]) & (time_ns[way.sample] <= window_ns[1])
    return inside


def way_of(crane: TowerCrane, axes: NDArray[np.float64], voxel_size_m: float) -> Way:
    """Return the positions between samples ((N, 3) slew, radius, height), straight in the axes."""
    steps_m = np.linalg.norm(np.diff(hook_of(crane, *axes.T), axis=0), axis=1)
    parts = np.clip(np.ceil(steps_m / (_SPACING_VOX * voxel_size_m)), 1, _MOST_BETWEEN).astype(np.int64)
    sample = np.repeat(np.arange(len(parts)), parts)
    first = np.cumsum(parts) - parts
    share = (np.arange(len(sample)) - first[sample]) / parts[sample]
    between = axes[sample] + share[:, None] * np.diff(axes, axis=0)[sample]
    slack = np.where(share == 0.0, _AT_SAMPLE_VOX, BETWEEN_VOX)
    return Way(
        np.concatenate([between, axes[-1:]]),
        np.append(sample, len(axes) - 1),
        np.append(slack, _AT_SAMPLE_VOX),
    )


def reference_cells(
    crane: TowerCrane, frame: GridFrame, axes: NDArray[np.float64], hook_offset_vox: IntVec
) -> NDArray[np.float64]:
    """Return the continuous reference cells of a load under hook poses.

    The hook is one sling's length above the middle of the lower face of the load's hook cell.

    Args:
        crane: The crane.
        frame: Metres to cells.
        axes: (N, 3) slew (rad), radius (m), height (m).
        hook_offset_vox: Hook cell relative to the reference cell; zeros for the empty hook.

    Returns:
        (N, 3) float64.
    """
    foot_m = hook_of(crane, *axes.T) - [0.0, 0.0, crane.sling_m]
    hook = (foot_m - np.array(frame.origin_m)) / frame.voxel_size_m
    cells: NDArray[np.float64] = hook - [0.5, 0.5, 0.0] - np.array(hook_offset_vox, np.float64)
    return cells


def tail_of(cells: NDArray[np.float64], lift: Lift | None) -> NDArray[np.bool_]:
    """Return (N,) which positions ((N, 3) reference cells) are on the last moves of a lift.

    They are at the end, and within the placements that were in contact.
    """
    if lift is None or lift.path_vox is None or lift.contact_moves <= 0:
        return np.zeros(len(cells), np.bool_)
    placements = lift.path_vox[-1 - min(lift.contact_moves, len(lift.path_vox) - 1) :]
    low, high = placements.min(axis=0) - BETWEEN_VOX, placements.max(axis=0) + BETWEEN_VOX
    within = ((cells >= low) & (cells <= high)).all(axis=1)
    tail: NDArray[np.bool_] = np.logical_and.accumulate(within[::-1])[::-1]
    return tail


@dataclass(frozen=True, slots=True, eq=False)
class Placements:
    """The whole placements around continuous positions: up to eight each.

    Attributes:
        cells: (U, 3) int64 reference cells, each once.
        around: (8, N) int64 per position the rows of ``cells`` around it, some of them the same.
    """

    cells: NDArray[np.int64]
    around: NDArray[np.int64]

    def at_positions(self, found: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return (N,) whether any placement around each position has what ((U,) bool) was found."""
        return np.asarray(found[self.around].any(axis=0), np.bool_)

    def at(self, position: int) -> NDArray[np.int64]:
        """Return (M, 3) the placements around one position."""
        placements: NDArray[np.int64] = self.cells[np.unique(self.around[:, position])]
        return placements


def placements_around(cells: NDArray[np.float64], slack_vox: NDArray[np.float64]) -> Placements:
    """Return the whole placements whose cells together cover the load at continuous reference cells.

    Args:
        cells: (N, 3) float64.
        slack_vox: (N,) positions this close to a whole cell are taken to be at it.
    """
    cells, slack_vox = np.ascontiguousarray(cells, np.float64), np.ascontiguousarray(slack_vox, np.float64)
    base, size = _box_around(cells, slack_vox)
    if int(size.prod()) > _CHUNK:  # a way through this many cells is sorted instead
        corners = _corners(cells, slack_vox)
        keys = np.ravel_multi_index(tuple((corners - base).T), tuple(int(n) for n in size))
        unique, around = np.unique(keys, return_inverse=True)
        whole = np.stack(np.unravel_index(unique, tuple(int(n) for n in size)), axis=1) + base
        return Placements(whole.astype(np.int64), around.reshape(8, -1))
    return Placements(*_numbered(cells, slack_vox, base, size))


def _corners(cells: NDArray[np.float64], slack_vox: NDArray[np.float64]) -> NDArray[np.int64]:
    low = np.floor(cells + slack_vox[:, None]).astype(np.int64)
    high = np.ceil(cells - slack_vox[:, None]).astype(np.int64)
    return np.stack([np.where(corner, high, low) for corner in np.ndindex(2, 2, 2)]).reshape(-1, 3)


@kernel
def _box_around(
    cells: NDArray[np.float64], slack_vox: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Lowest whole cell around positions, and how many there are along each axis."""
    low, high = np.zeros(3, np.int64), np.zeros(3, np.int64)
    for n in range(cells.shape[0]):
        for k in range(3):
            down = int(np.floor(cells[n, k] + slack_vox[n]))
            up = int(np.ceil(cells[n, k] - slack_vox[n]))
            if n == 0:
                low[k], high[k] = min(down, up), max(down, up)
            low[k], high[k] = min(low[k], down, up), max(high[k], down, up)
    return low, high - low + 1


@kernel
def _numbered(
    cells: NDArray[np.float64], slack_vox: NDArray[np.float64], base: NDArray[np.int64], size: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Mark every whole cell in the box, number the marked ones in order, and look the numbers up."""
    count = cells.shape[0]
    at = np.empty((8, count), np.int64)
    numbers = np.zeros(size[0] * size[1] * size[2], np.int32)
    for n in range(count):
        ends = np.empty((3, 2), np.int64)
        for k in range(3):
            ends[k, 0] = int(np.floor(cells[n, k] + slack_vox[n])) - base[k]
            ends[k, 1] = int(np.ceil(cells[n, k] - slack_vox[n])) - base[k]
        for c in range(8):
            x, y, z = ends[0, c // 4], ends[1, c // 2 % 2], ends[2, c % 2]
            key = (x * size[1] + y) * size[2] + z
            at[c, n] = key
            numbers[key] = 1
    total = 0
    for key in range(numbers.shape[0]):
        if numbers[key]:
            numbers[key] = total
            total += 1
    whole = np.empty((total, 3), np.int64)
    for c in range(8):
        for n in range(count):
            key = at[c, n]
            number = numbers[key]
            at[c, n] = number
            whole[number, 0] = base[0] + key // (size[1] * size[2])
            whole[number, 1] = base[1] + key // size[2] % size[1]
            whole[number, 2] = base[2] + key % size[2]
    return whole, at


class RawCells:
    """How many things occupy each cell.

    Args:
        shape: (X, Y, Z) of the site.
    """

    def __init__(self, shape: IntVec) -> None:
        self._counts = np.zeros(shape, np.uint16)
        self._present: dict[int, Thing] = {}

    def move_to(self, present: Sequence[Thing]) -> None:
        """Make it so that just these things are there."""
        wanted = {id(thing): thing for thing in present}
        for key in self._present.keys() - wanted.keys():
            self._add(self._present[key], -1)
        for key in wanted.keys() - self._present.keys():
            self._add(wanted[key], 1)
        self._present = wanted

    def _add(self, thing: Thing, number: int) -> None:
        """Count a thing; what a spoiled plan puts outside the grid is in nobody's way, and other checks say so."""
        cells, shape = thing.cells, np.array(self._counts.shape)
        if min(thing.low) < 0 or (np.array(thing.high) >= shape).any():
            cells = cells[((cells >= 0) & (cells < shape)).all(axis=1)]
        self._counts[tuple(cells.T)] += np.array(number).astype(np.uint16)

    def without(self, things: Sequence[Thing]) -> RawCells:
        """Return the same without some things."""
        left = RawCells((0, 0, 0))
        left._counts = self._counts.copy()
        for thing in things:
            left._add(thing, -1)
        return left

    def holds(self, placements: Placements, own: NDArray[np.int32]) -> NDArray[np.bool_]:
        """Return (U,) whether all cells ((C, 3) relative to the reference cell) are inside the grid at a placement."""
        low, high = placements.cells + own.min(axis=0), placements.cells + own.max(axis=0)
        inside: NDArray[np.bool_] = ((low >= 0) & (high < self._counts.shape)).all(axis=1)
        return inside

    def meets(self, placements: Placements, own: NDArray[np.int32]) -> NDArray[np.bool_]:
        """Return (U,) whether any cell is occupied at a placement; False where it is not inside the grid."""
        _, ny, nz = self._counts.shape
        stride = np.array([ny * nz, nz, 1])
        offsets = own.astype(np.int64) @ stride
        flat = self._counts.ravel()
        hit = np.zeros(len(placements.cells), np.bool_)
        rows = np.flatnonzero(self.holds(placements, own))
        step = max(1, _CHUNK // len(own))
        for n in range(0, len(rows), step):
            some = rows[n : n + step]
            hit[some] = flat[(placements.cells[some] @ stride)[:, None] + offsets].any(axis=1)
        return hit

    def over(self, placements: Placements, hook_offset: IntVec) -> NDArray[np.bool_]:
        """Return (U,) whether anything is in the hook's column, from the hook cell up; False outside the grid."""
        nx, ny, nz = self._counts.shape
        hook = placements.cells + np.array(hook_offset)
        inside = ((hook[:, :2] >= 0) & (hook[:, :2] < [nx, ny])).all(axis=1)
        columns, column_of = np.unique(hook[inside, 0] * ny + hook[inside, 1], return_inverse=True)
        occupied = self._counts.reshape(-1, nz)[columns] > 0
        top = np.where(occupied.any(axis=1), nz - np.argmax(occupied[:, ::-1], axis=1), 0)
        hit = np.zeros(len(hook), np.bool_)
        hit[inside] = top[column_of] > hook[inside, 2]
        return hit
