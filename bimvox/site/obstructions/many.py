"""Cells of very many obstructions, computed for a thousand of them at once."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bimvox.errors import InputError
from bimvox.grid.frame import GridFrame
from bimvox.site.component import IntVec, frozen
from bimvox.site.obstructions.cells import FAR_M, TOLERANCE_M, Rasterise, Where, obstruction_cells
from bimvox.site.obstructions.obstruction_set import BOX, CYLINDER, VOXELS, Obstruction, Rows
from bimvox.site.site import Blocker

_AT_ONCE = 1000
"""Obstructions of which the cells are computed at once."""
_MOST_AT_ONCE = 500_000
"""If they have more cells than this, each is computed by itself, which takes less memory."""

Found = tuple[NDArray[np.int32], Where]


def cells_of_all(
    obstructions: Sequence[Obstruction],
    frame: GridFrame,
    shape: IntVec,
    rasterise: Rasterise,
    *,
    grow_vox: int = 0,
    ground_vox: NDArray[np.int32] | None = None,
) -> Iterator[Found]:
    """Yield what ``obstruction_cells`` returns for each obstruction; a million of them take seconds."""
    lowest, highest = (-1, -1) if ground_vox is None else (int(ground_vox.min()), int(ground_vox.max()))
    rows, grid = Rows.of(obstructions), _Grid(frame, shape, grow_vox, lowest if grow_vox else -1)
    # On uneven ground, what reaches below its highest place is looked at by itself.
    alone_below_m = frame.corner_of([0, 0, highest + 1])[2] if grow_vox and lowest < highest else -np.inf
    for first in range(0, len(rows), _AT_ONCE):
        kinds = rows.kinds[first : first + _AT_ONCE]
        found: dict[int, Found] = {}
        for kind, cells_of in _CELLS_OF.items():
            numbers = np.flatnonzero(kinds == kind) + first
            if np.isfinite(alone_below_m):
                numbers = numbers[_lowest_m(rows, numbers, kind, frame) >= alone_below_m - TOLERANCE_M]
            found.update(zip(numbers.tolist(), cells_of(rows, numbers, grid), strict=False))
        for n in range(first, first + len(kinds)):
            own = found.get(n)
            if own is None:
                own = obstruction_cells(rows[n], frame, shape, rasterise, grow_vox=grow_vox, ground_vox=ground_vox)
            yield own


def _lowest_m(rows: Rows, numbers: NDArray[np.int64], kind: int, frame: GridFrame) -> NDArray[np.float64]:
    """Return the (N,) lowest heights of boxes, cylinders or voxels."""
    if kind != VOXELS:
        stated_m: NDArray[np.float64] = rows.numbers_m[numbers, 2]
        return stated_m
    layers = [rows.cells[rows.first[n] : rows.first[n + 1], 2].min() for n in numbers.tolist()]
    lowest_m: NDArray[np.float64] = frame.origin_m[2] + frame.voxel_size_m * np.array(layers, np.float64)
    return lowest_m


@dataclass(frozen=True, slots=True)
class _Grid:
    """The grid and the clearance.

    Attributes:
        frame: Its frame.
        shape: (X, Y, Z).
        grow_vox: The clearance in cells.
        ground_vox: The highest layer of the ground: what is in it needs no clearance; -1: there is none.
    """

    frame: GridFrame
    shape: IntVec
    grow_vox: int
    ground_vox: int

    @property
    def origin_m(self) -> NDArray[np.float64]:
        """Lowest corner of the wide grid, which is larger by the clearance on every side."""
        return np.array(self.frame.origin_m) - self.grow_vox * self.frame.voxel_size_m

    def ranges(
        self, low_m: NDArray[np.float64], high_m: NDArray[np.float64]
    ) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.bool_]]:
        """Return the cells of boxes in the wide grid, as ``obstruction_cells`` finds them.

        Returns:
            (N, 3) first cells, (N, 3) ends, and which boxes leave the wide grid.
        """
        low_m, high_m = np.clip(low_m, -FAR_M, FAR_M), np.clip(high_m, -FAR_M, FAR_M)
        size_m, limit = self.frame.voxel_size_m, np.array(self.shape) + 2 * self.grow_vox
        thin = high_m - low_m < 3 * TOLERANCE_M
        first_m = np.where(thin, (low_m + high_m) / 2, low_m + TOLERANCE_M)
        last_m = np.where(thin, (low_m + high_m) / 2, high_m - TOLERANCE_M)
        start = np.clip(np.floor((first_m - self.origin_m) / size_m), -1, limit).astype(np.int64)
        above = np.ceil((last_m - self.origin_m) / size_m)
        stop = np.clip(np.maximum(above, start + 1), 0, limit + 1).astype(np.int64)
        cut: NDArray[np.bool_] = np.any((start < 0) | (stop > limit), axis=1)
        start, stop = np.maximum(start, 0), np.minimum(stop, limit)
        stop[(stop <= start).any(axis=1)] = 0
        return start, stop, cut

    def meets(self, start: NDArray[np.int64], stop: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Return on which axes ranges in the wide grid reach into the grid."""
        result: NDArray[np.bool_] = (start < np.array(self.shape) + self.grow_vox) & (stop > self.grow_vox)
        return result

    def leaves(self, start: NDArray[np.int64], stop: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Return on which axes ranges in the wide grid reach out of the grid."""
        result: NDArray[np.bool_] = (start < self.grow_vox) | (stop > np.array(self.shape) + self.grow_vox)
        return result

    def grown(self, start: NDArray[np.int64], stop: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return first cells and sizes, in the grid and with the clearance, of ranges in the wide grid."""
        if self.ground_vox >= 0:
            start = start.copy()
            start[:, 2] = np.maximum(start[:, 2], self.ground_vox + 1 + self.grow_vox)
        first = np.maximum(start - 2 * self.grow_vox, 0)
        size = np.maximum(np.minimum(stop, self.shape) - first, 0)
        return first, np.where(np.all(stop > start, axis=1)[:, None], size, 0)


def _boxes(rows: Rows, numbers: NDArray[np.int64], grid: _Grid) -> Iterator[Found]:
    """Yield cells and place of boxes; of none if they have too many cells."""
    corners_m = rows.numbers_m[numbers]
    start, stop, cut = grid.ranges(corners_m[:, :3], corners_m[:, 3:])
    inside, leaves = np.all(grid.meets(start, stop), axis=1), cut | np.any(grid.leaves(start, stop), axis=1)
    first, size = grid.grown(start, stop)
    counts = size.prod(axis=1)
    if counts.sum() <= _MOST_AT_ONCE:
        yield from _each(_cells_of_blocks(first, size), counts, inside, leaves)


def _cylinders(rows: Rows, numbers: NDArray[np.int64], grid: _Grid) -> Iterator[Found]:
    """Yield cells and place of cylinders; of none if they have too many cells."""
    base_m = np.clip(rows.numbers_m[numbers, :3], -FAR_M, FAR_M)
    radius_m, height_m = np.minimum(rows.numbers_m[numbers, 3:5], FAR_M).T
    arm_m = np.stack([radius_m, radius_m, np.zeros(len(numbers))], axis=1)
    high_m = base_m + arm_m + np.stack([np.zeros(len(numbers)), np.zeros(len(numbers)), height_m], axis=1)
    start, stop, cut = grid.ranges(base_m - arm_m, high_m)
    first, size = grid.grown(start, stop)
    if size.prod(axis=1).sum() > _MOST_AT_ONCE:
        return
    grow, cell_m, levels = grid.grow_vox, grid.frame.voxel_size_m, size[:, 2]

    def met(columns: NDArray[np.int32], of: NDArray[np.int64], within: int) -> NDArray[np.bool_]:
        """Return whether a cylinder meets a column of the wide grid, or one within so many cells of it.

        It does if the point nearest to its axis, of a cell shrunk by the tolerance, lies in its circle.
        """
        away_m = np.full((len(of), 2), np.inf)
        for step in range(-within, within + 1):
            cell, centre_m = columns[:, :2] + step, base_m[of, :2]
            corner_m = cell_m * cell + grid.origin_m[:2]
            nearest_m = np.clip(centre_m, corner_m + TOLERANCE_M, corner_m + cell_m - TOLERANCE_M)
            own = (cell >= start[of, :2]) & (cell < stop[of, :2])
            away_m = np.where(own, np.minimum(away_m, np.abs(nearest_m - centre_m)), away_m)
        result: NDArray[np.bool_] = np.hypot(*away_m.T) < np.maximum(radius_m, 2 * TOLERANCE_M)[of]
        return result

    columns, of = _columns(start, stop - start)
    columns, of = columns[hit := met(columns, of, 0)], of[hit]
    within = ((columns >= grow) & (columns < np.array(grid.shape) + grow))[:, :2].all(axis=1)
    in_grid, out_of_it = (np.bincount(of[one], minlength=len(numbers)) > 0 for one in (within, ~within))
    inside = in_grid & grid.meets(start, stop)[:, 2]
    leaves = cut | out_of_it | grid.leaves(start, stop)[:, 2]
    columns, of = _columns(first, size)
    columns, of = columns[hit := met(columns + grow, of, grow)], of[hit]
    ones = np.ones(len(of), np.int64)
    cells = _cells_of_blocks(columns.astype(np.int64), np.stack([ones, ones, levels[of]], axis=1))
    yield from _each(cells, np.bincount(of, minlength=len(numbers)) * levels, inside, leaves)


def _voxels(rows: Rows, numbers: NDArray[np.int64], grid: _Grid) -> Iterator[Found]:
    """Yield cells and place of voxels; of none if they have too many cells."""
    shape, grow, count = np.array(grid.shape), grid.grow_vox, len(numbers)
    counts = rows.first[numbers + 1] - rows.first[numbers]
    of = np.repeat(np.arange(count), counts)
    place = np.arange(len(of)) - (np.cumsum(counts) - counts)[of] + rows.first[numbers][of]
    cells = rows.cells[place]
    within = ((cells >= 0) & (cells < shape)).all(axis=1)
    inside, leaves = (np.bincount(of[one], minlength=count) > 0 for one in (within, ~within))
    near = ((cells >= -grow) & (cells < shape + grow)).all(axis=1)
    if grid.ground_vox >= 0:
        near &= cells[:, 2] > grid.ground_vox
    cells, of = cells[near].astype(np.int64), of[near]
    first = np.maximum(cells - grow, 0)
    size = np.minimum(cells + grow + 1, shape) - first
    if size.prod(axis=1).sum() <= _MOST_AT_ONCE:
        of = np.repeat(of, size.prod(axis=1))
        grown = _cells_of_blocks(first, size)
        if counts.max(initial=0) > 1:  # the cells of one may overlap, or be in another order
            key = np.unique(np.ravel_multi_index((of, *grown.T), (count, *grid.shape)))
            of, x, y, z = np.unravel_index(key, (count, *grid.shape))
            grown = np.stack([x, y, z], axis=1).astype(np.int32)
        yield from _each(grown, np.bincount(of, minlength=count), inside, leaves)


_WHERE = {
    (True, False): Where.INSIDE,
    (True, True): Where.CLIPPED,
    (False, True): Where.OUTSIDE,
    (False, False): Where.OUTSIDE,
}
"""Where an obstruction is: whether it has a cell in the grid, and whether it leaves the grid."""
_CELLS_OF = {BOX: _boxes, CYLINDER: _cylinders, VOXELS: _voxels}


def _columns(first: NDArray[np.int64], size: NDArray[np.int64]) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
    """Return the lowest cell of each column of blocks of cells, and the number of its block."""
    flat = np.where(np.all(size > 0, axis=1)[:, None], size, 0)
    flat[:, 2] = np.minimum(flat[:, 2], 1)
    return _cells_of_blocks(first, flat), np.repeat(np.arange(len(flat)), flat.prod(axis=1))


def _each(
    cells: NDArray[np.int32], counts: NDArray[np.int64], inside: NDArray[np.bool_], leaves: NDArray[np.bool_]
) -> Iterator[Found]:
    """Yield the cells of each, of which there are so many, and its place."""
    at = 0
    for count, is_inside, does_leave in zip(counts.tolist(), inside.tolist(), leaves.tolist(), strict=True):
        yield cells[at : at + count], _WHERE[is_inside, does_leave]
        at += count


def _cells_of_blocks(start: NDArray[np.int64], size: NDArray[np.int64]) -> NDArray[np.int32]:
    """Return the (N, 3) cells of blocks of cells, block by block."""
    counts = size.prod(axis=1)
    number = np.repeat(np.arange(len(size)), counts)
    place = np.arange(len(number)) - (np.cumsum(counts) - counts)[number]
    cells = np.empty((len(number), 3), np.int32)
    for axis in (2, 1, 0):
        along = size[number, axis]
        cells[:, axis] = place % along + start[number, axis]
        place //= along
    return cells


MOST_SINGLE = 10_000
"""So many obstructions on the site are objects of their own."""
MOST_CELLS = 20_000_000
"""So many cells they may occupy in total, each counted for every obstruction in it."""
MOST_CELLS_IN_ALL = 2_000_000_000
"""More cells than this take minutes, and no site needs them."""
_CELLS_AT_ONCE = 5_000_000

Cells = NDArray[np.int32]


def blockers_of(found: Iterable[tuple[str, Cells, bool]], shape: IntVec) -> list[Blocker]:
    """Return the obstructions on a site as fixed objects, in the order given.

    Up to ``MOST_SINGLE`` obstructions and ``MOST_CELLS`` cells are one object each. If there are more, neighbours in
    the order share an object, named after the first and the last of them, and a cell belongs to the first object that
    occupies it. Obstructions whose form comes from another file stay single.

    Args:
        found: Id, (N, 3) int32 cells in ascending order, and whether the form comes from another file.
        shape: (X, Y, Z) of the grid.

    Raises:
        InputError: If they occupy more than ``MOST_CELLS_IN_ALL`` cells in total.
    """
    single: list[Blocker] = []
    own: list[Blocker] = []
    count = 0
    crowd: _Crowd | None = None
    for name, cells, is_other_file in found:
        if not len(cells):
            continue
        count += len(cells)
        if count > MOST_CELLS_IN_ALL:
            raise InputError(
                f"the obstructions occupy more than {MOST_CELLS_IN_ALL:,} cells, each counted for every one in it",
                hint="join obstructions that lie in each other, or take larger cells",
            )
        if crowd is not None and not is_other_file:
            crowd.add(name, cells)
            continue
        blocker = Blocker(name, "obstruction", frozen(cells))
        single.append(blocker)
        if is_other_file:
            continue
        own.append(blocker)
        if len(own) > MOST_SINGLE or count > MOST_CELLS:
            crowd = _Crowd(shape)
            for one in own:
                crowd.add(one.id, one.cells)
            taken = set(map(id, own))
            single, own = [one for one in single if id(one) not in taken], []
    return single if crowd is None else [*single, *crowd.blockers()]


class _Crowd:
    """Obstructions that share objects.

    Args:
        shape: (X, Y, Z) of the grid.
    """

    def __init__(self, shape: IntVec) -> None:
        self._shape = shape
        self._names: list[str] = []
        self._first = np.full(int(np.prod(shape)), -1, np.int32)  # number of the first obstruction in a cell
        self._waiting: list[Cells] = []
        self._cells = 0

    def add(self, name: str, cells: Cells) -> None:
        """Add an obstruction."""
        self._names.append(name)
        self._waiting.append(cells)
        self._cells += len(cells)
        if self._cells > _CELLS_AT_ONCE:
            self._settle()

    def _settle(self) -> None:
        if not self._waiting:
            return
        counts = [len(cells) for cells in self._waiting]
        numbers = np.repeat(np.arange(len(self._names) - len(counts), len(self._names), dtype=np.int32), counts)
        flat = np.ravel_multi_index(tuple(np.concatenate(self._waiting).T), self._shape)
        free = np.flatnonzero(self._first[flat] < 0)[::-1]  # of equal indices the last one counts
        self._first[flat[free]] = numbers[free]
        self._waiting.clear()
        self._cells = 0

    def blockers(self) -> list[Blocker]:
        """Return the objects."""
        self._settle()
        size = -(-len(self._names) // MOST_SINGLE)
        occupied = np.flatnonzero(self._first >= 0)
        group = self._first[occupied] // size
        order = np.argsort(group, kind="stable")
        cells = np.stack(np.unravel_index(occupied[order], self._shape), axis=1).astype(np.int32)
        groups, starts = np.unique(group[order], return_index=True)
        parts = np.split(cells, starts[1:])
        return [
            Blocker(self._name(number * size, size), "obstruction", frozen(part))
            for number, part in zip(groups.tolist(), parts, strict=True)
        ]

    def _name(self, first: int, size: int) -> str:
        names = self._names[first : first + size]
        return names[0] if len(names) == 1 else f"{names[0]} to {names[-1]} ({len(names):,} obstructions)"
