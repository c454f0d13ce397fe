"""The cells that the proof of a lift checked: the lift's footprint.

For every placement on a lift's path and around its motion, the verifier checks the load's cells and the column above
the hook, in transit with their clearances, the box in which the part is raised, and the column above the empty hook.
All of these cells together are the footprint, stored as one bit mask of heights for each non-empty column.

Why this re-proves a lift after a change of the obstructions: Every check of ``verify_plan`` and ``verify_motions``
that concerns an obstruction is of the form "no cell of it is among these cells", and all of these cells are in the
footprint. (The only exception is the jib, which turns above everything and has its own test.) Obstructions have no
triangles that a part may touch, so no contact with them is permitted. A proof that passed with the old cells therefore
passes with the new ones if no added cell is in the footprint. Removed cells can make it fail in one way: if nothing is
above a part's place any more, its last moves begin later (``gate_of``), and sideways ones before that must keep the
clearances. Its other inputs (path, motion, structure, the parts in place and in the yard) are unchanged, or tracked by
their own cells.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from bimvox.compiled import kernel
from bimvox.crane.tower_crane import TowerCrane
from bimvox.kept import kept
from bimvox.proof.clearance import reach_vox
from bimvox.proof.guided import cells_at_any_heading, guided_box_vox, turning_placements
from bimvox.proof.hook import jib_cell, swept_by_jib, tallest_met
from bimvox.proof.space import Line, positions_of, whole_cells
from bimvox.proof.swing import swung_placements
from bimvox.records.lift import Lift, YardPlace
from bimvox.records.motion import LiftMotion, Trajectory
from bimvox.site.component import Component, IntVec, StoredPose
from bimvox.site.lifting import crane_for
from bimvox.site.site import Site

_WORD = 64
_SLINGS_END = (0, 0, 0)


@dataclass(frozen=True, slots=True, eq=False)
class Footprint:
    """Cells of a grid, column by column.

    Attributes:
        columns: (N,) int32 flat indices x * Y + y of the non-empty columns, ascending.
        heights: (N, W) uint64 the heights in each: bit k % 64 of word k // 64 is cell k.
    """

    columns: NDArray[np.int32]
    heights: NDArray[np.uint64]

    @property
    def nbytes(self) -> int:
        """Memory of its arrays in bytes."""
        return self.columns.nbytes + self.heights.nbytes


@dataclass(frozen=True, slots=True, eq=False)
class MotionFootprint:
    """Cells that a motion sweeps.

    Attributes:
        approach: Those of the empty hook on its way to the part.
        carrying: Those of load and hook after that.
    """

    approach: Footprint
    carrying: Footprint


class CellMask:
    """A set of cells of a grid of a shape (X, Y, Z), as bits."""

    def __init__(self, shape: IntVec) -> None:
        self._shape = shape
        self._words = np.zeros((shape[0] * shape[1], -(-shape[2] // _WORD)), np.uint64)
        self.empty = True

    def add(self, cells: NDArray[np.int32]) -> None:
        """Add cells ((N, 3) int32); cells outside the grid are ignored."""
        if len(cells):
            self.empty = False
            _mark_cells(self._words, self._shape, cells)

    def add_placements(self, placements: NDArray[np.int64], own: NDArray[np.int64]) -> None:
        """Add the cells of a part (runs relative to its reference cell, see ``_as_runs``) at placements ((N, 3))."""
        if len(placements):
            self.empty = False
            _mark_boxes(self._words, self._shape, np.ascontiguousarray(placements, np.int64), own)

    def add_columns_above(self, cells: NDArray[np.int64]) -> None:
        """Add cells ((N, 3)) and everything above them."""
        if len(cells):
            self.empty = False
            _mark_above(self._words, self._shape, np.ascontiguousarray(cells, np.int64))

    def add_box(self, low: NDArray[np.int64], size: NDArray[np.int64]) -> None:
        """Add a box of cells."""
        x, y, z = (int(n) for n in size)
        if min(x, y, z) <= 0:
            return
        runs = np.stack([*(axis.ravel() for axis in np.indices((x, y))), np.zeros(x * y), np.full(x * y, z)], axis=1)
        self.empty = False
        _mark_boxes(self._words, self._shape, np.asarray(low, np.int64)[None], runs.astype(np.int64))

    def meets(self, footprint: Footprint | MotionFootprint) -> bool:
        """Return whether any cell is in both."""
        if self.empty:
            return False
        if isinstance(footprint, MotionFootprint):
            return self.meets(footprint.approach) or self.meets(footprint.carrying)
        return bool(_meet(self._words, footprint.columns, footprint.heights))

    def without(self, other: CellMask) -> CellMask:
        """Return the cells that are not in another set."""
        left = CellMask(self._shape)
        left._words = self._words & ~other._words
        left.empty = not left._words.any()
        return left

    def union(self, other: CellMask) -> CellMask:
        """Return the cells that are in either set."""
        both = CellMask(self._shape)
        both._words, both.empty = self._words | other._words, self.empty and other.empty
        return both

    def around(self) -> NDArray[np.int32]:
        """Return two opposite corners (2, 3) of a box around the set, from the ground up; (0, 3) if it is empty."""
        columns = np.flatnonzero(self._words.any(axis=1))
        if not len(columns):
            return np.zeros((0, 3), np.int32)
        heights = np.unpackbits(np.bitwise_or.reduce(self._words[columns]).view(np.uint8), bitorder="little")
        x, y = np.divmod(columns, self._shape[1])
        highest = [int(x.max()), int(y.max()), int(np.flatnonzero(heights)[-1])]
        return np.array([[int(x.min()), int(y.min()), 0], highest], np.int32)

    def cells(self) -> NDArray[np.int32]:
        """Return the (N, 3) cells of the set."""
        columns = np.flatnonzero(self._words.any(axis=1))
        bits = np.unpackbits(self._words[columns].view(np.uint8), axis=1, bitorder="little")
        row, z = np.nonzero(bits)
        return np.stack([*np.divmod(columns[row], self._shape[1]), z], axis=1).astype(np.int32)

    def footprint(self) -> Footprint:
        """Return the footprint of the set."""
        columns = np.flatnonzero(self._words.any(axis=1)).astype(np.int32)
        return Footprint(columns, self._words[columns])


def path_footprint(site: Site, lift: Lift) -> Footprint:
    """Return the cells that ``verify_plan`` checks for a planned lift: raising, path, hook line."""
    component, place = site.components[lift.component], lift.place
    assert lift.path_vox is not None
    assert place is not None
    mask = CellMask(site.shape)
    # Also around a lift that keeps less: it is planned again as if from scratch if something comes so near.
    _add_raising(mask, site, component, place)
    reaches = (_load_reach(site), whole_cells(site.rules.rope_clearance_m, site.frame))
    path = lift.path_vox.astype(np.int64)
    _add_load(mask, site, component, path, reaches)
    _add_load(mask, site, component, path[turning_placements(lift)], reaches, any_heading=True)
    _add_guide(mask, site, lift)
    return mask.footprint()


def motion_footprint(site: Site, lift: Lift, motion: LiftMotion, since_ns: int | None = None) -> MotionFootprint:
    """Return the cells that ``verify_motions`` checks for a lift: what load, hook line and empty hook sweep.

    With ``since_ns``, a time on the site's clock, only what is swept after it.
    """
    mask, approach = CellMask(site.shape), CellMask(site.shape).footprint()
    rest_ns = 0 if since_ns is None else since_ns - motion.start_ns
    _add_carrying(mask, site, lift, motion, rest_ns)
    if rest_ns <= motion.loaded.time_ns[-1]:
        _add_guide(mask, site, lift)
    if motion.approach is not None:
        approach = hook_footprint(site, motion, motion.approach, motion.start_ns + rest_ns)
    return MotionFootprint(approach, mask.footprint())


def hook_footprint(site: Site, motion: LiftMotion, way: Trajectory, since_ns: int) -> Footprint:
    """Return the cells that ``verify_motions`` checks for an empty hook move after a time on the site's clock."""
    crane, mask, rest_ns = site.cranes[motion.crane], CellMask(site.shape), since_ns - motion.start_ns
    rest = _rest_of(way, rest_ns)
    if rest is not None and site.rules.rope:
        mask.add_columns_above(_placements(site, crane, rest, _SLINGS_END))
        mask.add_columns_above(swung_placements(site, crane, motion, way, None, rest_ns))
    return mask.footprint()


def jib_meets(site: Site, motion: LiftMotion, cells: NDArray[np.int32]) -> bool:
    """Return whether the jib turns into any of the cells ((N, 3)) during a lift."""
    crane = site.cranes[motion.crane]
    if crane.luffing is not None:
        swept = swept_by_jib(site, crane, crane.luffing, motion.samples()[1])
        return bool(swept[tuple(cells.T)].any())
    if not _reaches_jib(site, crane, cells):
        return False
    return bool(tallest_met(site, crane, cells, motion.samples()[1][:, 0]))


def examined_by(site: Site, component: Component, place: YardPlace, sideways_vox: int) -> Footprint:
    """Return the cells that decide whether a lift can start and has last moves, whatever lies between.

    Args:
        site: The site.
        component: The part.
        place: Where it waits.
        sideways_vox: How far around its place the last moves are searched for.
    """
    mask = CellMask(site.shape)
    size = np.array(component.shape.size_vox)
    _add_raising(mask, site, component, place)
    start = np.array(place.transit_start_vox, np.int64)[None]
    margin = _load_reach(site)
    mask.add_placements(start, _runs_around(component, margin, False))
    mask.add_columns_above(start + np.array(component.hook_offset_vox))
    around = np.array([sideways_vox + margin, sideways_vox + margin, 0])
    bottom = np.array(component.target_vox) * [1, 1, 0] - around
    mask.add_box(bottom, np.array([size[0], size[1], site.shape[2]]) + 2 * around)
    return mask.footprint()


def _load_reach(site: Site) -> int:
    """Return how far from a load on its way something may matter, cells."""
    rules = site.rules
    most_m = max(rules.transit_clearance_m, rules.departure_clearance_m, rules.approach_clearance_m)
    return whole_cells(most_m, site.frame)


def _add_raising(mask: CellMask, site: Site, component: Component, place: YardPlace) -> None:
    """Add what is within the clearances of a part while it is upended, raised and turned in the yard."""
    rules, low, size = site.rules, np.array(place.cell_vox), np.array(place.raising_size_vox(component))
    reach_m = rules.upending_clearance_m if place.is_upended else rules.departure_clearance_m
    around = whole_cells(reach_m, site.frame) * np.array([1, 1, int(place.is_upended)])
    mask.add_box(low - around * [1, 1, 0], size + around * [2, 2, 1])
    turning, reach = place.turning_cells(component), whole_cells(rules.turning_clearance_m, site.frame)
    if len(turning):
        first = turning.min(axis=0) - reach
        mask.add_box(first, turning.max(axis=0) + 1 + reach - first)


def _add_carrying(mask: CellMask, site: Site, lift: Lift, motion: LiftMotion, rest_ns: int) -> None:
    """Add what the load and its hook line sweep, as the verifier defines it."""
    crane, component, place = site.cranes[motion.crane], site.components[motion.component], lift.place
    assert place is not None
    line, rigged = component.hook_line_vox, crane_for(site, crane, component)
    raising, loaded = (_rest_of(way, rest_ns) for way in (motion.raising, motion.loaded))
    if raising is not None:
        upright = place.pose is StoredPose.AS_BUILT and not place.turn
        raised = _placements(site, rigged, raising, line)
        _add_load(mask, site, component, raised, (0, 0), with_cells=upright)
    if loaded is not None:
        # The clearances are those that the lift keeps; a load that swings keeps none.
        clearances = tuple(reach_vox(site, rule, lift) for rule in ("transit_clearance_m", "rope_clearance_m"))
        turns = lift.ever_with_jib  # on its last moves it takes less than at any heading
        _add_load(mask, site, component, _placements(site, rigged, loaded, line), clearances, any_heading=turns)
        swung = swung_placements(site, crane, motion, motion.loaded, component, rest_ns)
        _add_load(mask, site, component, swung, (0, 0), any_heading=turns)


def _add_guide(mask: CellMask, site: Site, lift: Lift) -> None:
    """Add the box that a guided load sweeps on its last moves."""
    if lift.guide is not None:
        low, high = guided_box_vox(site, site.components[lift.component], lift.guide)
        mask.add_box(low, high + 1 - low)


def _rest_of(trajectory: Trajectory, rest_ns: int) -> Trajectory | None:
    """Return the rest of a trajectory from the sample before a time; None if it has ended."""
    time_ns = trajectory.time_ns
    if rest_ns <= time_ns[0]:
        return trajectory
    if rest_ns > time_ns[-1]:
        return None
    first = min(max(int(np.searchsorted(time_ns, rest_ns)) - 1, 0), len(time_ns) - 2)
    return replace(
        trajectory,
        time_ns=time_ns[first:],
        slew_rad=trajectory.slew_rad[first:],
        radius_m=trajectory.radius_m[first:],
        height_m=trajectory.height_m[first:],
    )


def _placements(site: Site, crane: TowerCrane, trajectory: Trajectory, hook_line: Line) -> NDArray[np.int64]:
    return positions_of(crane, site.frame, trajectory, hook_line).placements.cells


def _add_load(
    mask: CellMask,
    site: Site,
    component: Component,
    placements: NDArray[np.int64],
    clearances_vox: tuple[int, ...],
    *,
    with_cells: bool = True,
    any_heading: bool = False,
) -> None:
    """Add what is within the clearances of load, if wanted, and rope at (N, 3) placements."""
    load, rope = clearances_vox
    if with_cells:
        mask.add_placements(placements, _runs_around(component, load, any_heading))
    if site.cranes and site.rules.rope:
        hooks = placements + np.array(component.hook_offset_vox)
        mask.add_columns_above((hooks[:, None] + _around(rope)[None]).reshape(-1, 3))


@kept
def _runs_around(component: Component, reach: int, any_heading: bool) -> NDArray[np.int64]:
    cells = cells_at_any_heading(component) if any_heading else component.shape.cells
    if not reach:
        return _as_runs(cells)
    low = cells.min(axis=0) - reach
    dense = np.zeros(cells.max(axis=0) + reach - low + 1, np.bool_)
    dense[tuple((cells - low).T)] = True
    return _as_runs((np.argwhere(maximum_filter(dense, size=2 * reach + 1)) + low).astype(np.int32))


def _around(reach: int) -> NDArray[np.int64]:
    """Return ((2 R + 1)^2, 3) int64 columns up to ``reach`` away, in plan."""
    x, y = (axis.ravel() - reach for axis in np.indices((2 * reach + 1, 2 * reach + 1)))
    return np.stack([x, y, np.zeros_like(x)], axis=1).astype(np.int64)


def _as_runs(cells: NDArray[np.int32]) -> NDArray[np.int64]:
    """Return cells ((N, 3)) as (R, 4) int64 upright runs: x, y, first z, one after the last z."""
    order = np.lexsort(cells.T[::-1])
    sorted_cells = cells[order].astype(np.int64)
    step = np.diff(sorted_cells, axis=0)
    starts = np.flatnonzero(np.r_[True, (step[:, :2] != 0).any(axis=1) | (step[:, 2] > 1)])
    ends = np.r_[starts[1:], len(sorted_cells)] - 1
    return np.column_stack([sorted_cells[starts], sorted_cells[ends, 2] + 1])


@kernel
def _mark_cells(words: NDArray[np.uint64], shape: tuple[int, int, int], cells: NDArray[np.int32]) -> None:
    for n in range(cells.shape[0]):
        x, y, z = cells[n, 0], cells[n, 1], cells[n, 2]
        if 0 <= x < shape[0] and 0 <= y < shape[1] and 0 <= z < shape[2]:
            words[x * shape[1] + y, z // 64] |= np.uint64(1) << np.uint64(z % 64)


@kernel
def _mark_boxes(
    words: NDArray[np.uint64], shape: tuple[int, int, int], placements: NDArray[np.int64], runs: NDArray[np.int64]
) -> None:
    for p in range(placements.shape[0]):
        for r in range(runs.shape[0]):
            x, y = placements[p, 0] + runs[r, 0], placements[p, 1] + runs[r, 1]
            if 0 <= x < shape[0] and 0 <= y < shape[1]:
                low, high = max(placements[p, 2] + runs[r, 2], 0), min(placements[p, 2] + runs[r, 3], shape[2])
                _mark_run(words, x * shape[1] + y, low, high)


@kernel
def _mark_above(words: NDArray[np.uint64], shape: tuple[int, int, int], cells: NDArray[np.int64]) -> None:
    for n in range(cells.shape[0]):
        x, y = cells[n, 0], cells[n, 1]
        if 0 <= x < shape[0] and 0 <= y < shape[1]:
            _mark_run(words, x * shape[1] + y, max(cells[n, 2], 0), shape[2])


@kernel
def _mark_run(words: NDArray[np.uint64], column: int, low: int, high: int) -> None:
    while low < high:
        word = low // 64
        end = min(high, (word + 1) * 64)
        bits = np.uint64(0xFFFFFFFFFFFFFFFF) >> np.uint64(64 - (end - low))
        words[column, word] |= bits << np.uint64(low - word * 64)
        low = end


@kernel
def _meet(words: NDArray[np.uint64], columns: NDArray[np.int32], heights: NDArray[np.uint64]) -> bool:
    for n in range(columns.shape[0]):
        for w in range(heights.shape[1]):
            if words[columns[n], w] & heights[n, w]:
                return True
    return False


def _reaches_jib(site: Site, crane: TowerCrane, cells: NDArray[np.int32]) -> bool:
    """Return whether any of the cells ((N, 3)) is as high as the jib."""
    return bool((cells[:, 2] >= jib_cell(site, crane)).any())
