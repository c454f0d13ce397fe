"""The best place of a part in a free yard.

Of all columns where the part fits and the crane may pick it, the one with the least travel time is best, including the
travel from the part before; of equally good ones the first.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.crane.kinematics import Axes
from bimvox.crane.travel import AcrossTables, Travel, across_of
from bimvox.planning.flip import flip_columns
from bimvox.site.collision import HOOK_FORBIDDEN, hook_room
from bimvox.site.component import (
    Component,
    IntVec,
    StoredPose,
    turning_columns,
)
from bimvox.site.flip_box import hook_at_vox, raised_size_vox
from bimvox.site.site import Site

SAME_S = 2.0
"""Travel times that differ by less are equally good, seconds."""
_NOWHERE = -1

Lying = tuple[StoredPose, int]
"""How a part lies: its pose, and its quarter turns."""


class Clearance(NamedTuple):
    """What a part needs around it in transit: so many cells, at its own heading or at every one.

    ``most_used``: the share of the load chart that it may use when it is picked, as in ``hook_room``; ``aside``: how
    many columns around its footprint are clear of structures and the building.
    """

    border: int
    turns: bool
    most_used: float | None = None
    aside: int = 0


class _Rectangle(NamedTuple):
    """Columns from (x0, y0) to before (x1, y1), relative to the lowest corner of a footprint, or of all footprints."""

    x0: int
    y0: int
    x1: int
    y1: int


class _Picks(NamedTuple):
    """Where one crane picks.

    Attributes:
        slew_rad: (X, Y) its axes with the hook above each column; size 0: travel does not count.
        radius_m: (X, Y).
        tables: Its travel times.
    """

    slew_rad: NDArray[np.float64]
    radius_m: NDArray[np.float64]
    tables: AcrossTables


class _Ends(NamedTuple):
    """Where the hook comes from and goes to: (2,) slew, radius, and seconds of hoisting; (1,) without a part before."""

    slew_rad: NDArray[np.float64]
    radius_m: NDArray[np.float64]
    hoist_s: NDArray[np.float64]


class BestPlace:
    """Finds the best place of a part in a free yard.

    Args:
        site: The site.
        tops: (X, Y) the height of what no part gets clear of otherwise, cells.
        travels: The travel times of its cranes; without any, the first free place is best.
    """

    def __init__(self, site: Site, tops: NDArray[np.int32], travels: Sequence[Travel]) -> None:
        self._site, self._tops, self._travels = site, tops, travels
        self._origin_m, self._size_m = np.array(site.frame.origin_m), site.frame.voxel_size_m
        self._flat, self._floor = np.zeros(site.shape[:2], np.int32), site.yard_floor_vox
        self._too_high: dict[int, NDArray[np.int32]] = {}
        standing = tops > self._floor
        for part in site.components:
            cells = part.shape.cells + np.array(part.target_vox)
            standing[tuple(cells[cells[:, 2] >= self._floor, :2].T)] = True
        self._standing = counts(standing)
        columns = np.moveaxis(np.indices(site.shape[:2]), 0, -1)
        hooks = np.concatenate([columns, np.zeros((*site.shape[:2], 1), np.int64)], axis=-1)
        self._picks = []
        for travel in travels:
            slew_rad, radius_m, _ = self._axes(travel, hooks)
            self._picks.append(_Picks(slew_rad, radius_m, travel.across))
        if not travels:
            none = np.empty((0, 0))
            self._picks = [_Picks(none, none, AcrossTables(np.empty(0), np.empty(0), 1.0))] * max(1, len(site.cranes))
        self._nearest = _nearest_cranes(site)

    def of(
        self,
        component: Component,
        free: NDArray[np.bool_],
        lyings: Sequence[Lying],
        clearance: Clearance,
        before: Component | None,
    ) -> tuple[Lying, IntVec] | None:
        """Return how and where a part lies best; None if it fits nowhere.

        Args:
            component: The part.
            free: (X, Y) the free columns.
            lyings: How it may lie, the best first.
            clearance: What it needs in transit.
            before: The part that the same crane lifts before it.
        """
        if not lyings:
            return None
        site, crane = self._site, self._site.crane_of(component)
        share = clearance.most_used
        upright = hook_room(site, crane, self._flat, component, most_used=share).floor < HOOK_FORBIDDEN
        if component.flip_rise_vox and crane is not None:
            upright &= flip_columns(site, crane, component)
        for pose, turn in lyings:
            hook = upright
            if turn:
                turned = hook_room(site, crane, self._flat, component, turn, most_used=share).floor
                hook = upright & (turned < HOOK_FORBIDDEN)
            size_x, size_y, size_z = raised_size_vox(component, pose, turn)
            if self._floor + size_z > site.shape[2]:
                continue
            offset = hook_at_vox(component, pose, turn)
            corners, around = self._room(component, offset, turn, clearance)
            x, y = _best(
                free,
                hook,
                (
                    self._columns_too_high(component, clearance.border),
                    self._standing if clearance.aside else np.empty((0, 0), np.int32),
                    clearance.aside,
                ),
                self._nearest == component.crane if self._nearest.size else np.empty((0, 0), np.bool_),
                (size_x, size_y, *offset),
                (corners, around),
                self._picks[component.crane],
                self._ends(component, before, self._floor + size_z),
            )
            if x != _NOWHERE:
                return (pose, turn), (x, y, self._floor)
        return None

    def _room(
        self, component: Component, offset: tuple[int, int], turn: int, clearance: Clearance
    ) -> tuple[_Rectangle, _Rectangle]:
        """Return where the lowest corner of the footprint may be, and the columns around it that must not be too high.

        The clearance in transit must lie inside the site boundary, and so must the turning circle.
        """
        site, shape, border = self._site, component.shape, clearance.border
        first, last = np.zeros(2, np.int64), np.array(shape.size_vox[:2])
        if clearance.turns:
            columns = turning_columns(shape, component.hook_line_vox, 0)
            first, last = columns.min(axis=0), columns.max(axis=0) + 1
        low, high = border - first, np.array(site.shape[:2]) - border - last
        if turn:
            columns = turning_columns(shape, component.hook_line_vox, turn)
            low = np.maximum(low, -columns.min(axis=0))
            high = np.minimum(high, np.array(site.shape[:2]) - 1 - columns.max(axis=0))
        start = np.array(offset) - np.array(component.hook_offset_vox[:2])  # of its transit, from the corner
        corners = (*(low - start).tolist(), *(high - start + 1).tolist())
        around = (*(start + first - border).tolist(), *(start + last + border).tolist())
        return _Rectangle(*corners), _Rectangle(*around)

    def _columns_too_high(self, component: Component, border: int) -> NDArray[np.int32]:
        """Return the ``counts`` of columns above which a part cannot keep a border; size 0 if it needs none."""
        if not border:
            return np.empty((0, 0), np.int32)
        highest = self._site.shape[2] - component.shape.size_vox[2] - 2 * border
        if highest not in self._too_high:
            self._too_high[highest] = counts(self._tops > highest)
        return self._too_high[highest]

    def _ends(self, component: Component, before: Component | None, top_vox: int) -> _Ends:
        """Return the ends of the hook's ways; ``top_vox`` is the height at which it picks the part."""
        if not self._travels:
            return _Ends(np.empty(0), np.empty(0), np.empty(0))
        travel = self._travels[component.crane]
        parts = [component] if before is None else [component, before]
        over = [np.add(part.target_vox, part.hook_line_vox) for part in parts]
        slew_rad, radius_m, height_m = self._axes(travel, np.array(over))
        pick_m = self._axes(travel, np.array([[0, 0, top_vox]]))[2]
        ways_m = np.array([height_m[0] - pick_m[0], *(pick_m - height_m[1:])])
        return _Ends(slew_rad, radius_m, travel.hoisting_s(ways_m))

    def _axes(self, travel: Travel, cells: NDArray[np.int64] | NDArray[np.float64]) -> Axes:
        return travel.axes_of(self._origin_m + self._size_m * (cells + np.array([0.5, 0.5, 0.0])))


def counts(columns: NDArray[np.bool_]) -> NDArray[np.int32]:
    """Return (X + 1, Y + 1) how many of the marked columns are before each one, along both axes."""
    table = np.zeros((columns.shape[0] + 1, columns.shape[1] + 1), np.int32)
    table[1:, 1:] = columns.cumsum(axis=0).cumsum(axis=1)
    return table


def _nearest_cranes(site: Site) -> NDArray[np.int64]:
    """Return (X, Y) the crane nearest to each column; size 0 with fewer than two cranes."""
    if not site.has_several_cranes:
        return np.empty((0, 0), np.int64)
    columns = np.moveaxis(np.indices(site.shape[:2]), 0, -1)
    hook_m = np.array(site.frame.origin_m[:2]) + site.frame.voxel_size_m * (columns + 0.5)
    apart_m = [np.hypot(*np.moveaxis(hook_m - np.array(crane.base_m[:2]), -1, 0)) for crane in site.cranes]
    nearest: NDArray[np.int64] = np.argmin(np.stack(apart_m), axis=0)
    return nearest


@kernel
def _best(
    free: NDArray[np.bool_],
    hook: NDArray[np.bool_],
    around: tuple[NDArray[np.int32], NDArray[np.int32], int],
    own: NDArray[np.bool_],
    footprint: tuple[int, int, int, int],
    room: tuple[_Rectangle, _Rectangle],
    picks: _Picks,
    ends: _Ends,
) -> tuple[int, int]:
    """Return the lowest corner of the best place; (-1, -1) if there is none.

    A place whose hook is in the crane's own columns is better than any other: so the cranes pick in different areas of
    the yard and do not get in each other's way there.

    ``free``: (X, Y) the free columns; ``hook``: (X, Y) where the hook may be; ``around``: what must not be around the
    place: (X + 1, Y + 1) ``counts`` of columns that are too high, the same of columns with something in them, and how
    many columns around the footprint are clear of the latter; size 0: none counts; ``own``: (X, Y) the columns nearest
    to the part's crane; size 0: all; ``footprint``: its size along x and y, and where in it the hook is; ``room``:
    where the lowest corner may be, and the columns around it, which must not be too high; ``picks``: the crane's axes;
    ``ends``: where the hook comes from and goes to.
    """
    nx, ny = free.shape
    size_x, size_y, hook_x, hook_y = footprint
    corners, high = room
    too_high, standing, aside = around
    taken = np.zeros((nx + 1, ny + 1), np.int32)
    for i in range(nx):
        row = np.int32(0)
        for j in range(ny):
            row += np.int32(not free[i, j])
            taken[i + 1, j + 1] = taken[i, j + 1] + row
    best_x, best_y, least, is_own = _NOWHERE, _NOWHERE, np.inf, False
    for y in range(max(0, corners.y0), min(ny - size_y + 1, corners.y1)):
        for x in range(max(0, corners.x0), min(nx - size_x + 1, corners.x1)):
            i, j = x + hook_x, y + hook_y
            if not hook[i, j] or taken[x + size_x, y + size_y] - taken[x, y + size_y] != (
                taken[x + size_x, y] - taken[x, y]
            ):
                continue
            if too_high.size:
                x0, y0, x1, y1 = x + high.x0, y + high.y0, x + high.x1, y + high.y1
                if too_high[x1, y1] - too_high[x0, y1] - too_high[x1, y0] + too_high[x0, y0]:
                    continue
            if standing.size:
                x0, y0, x1, y1 = max(0, x - aside), max(0, y - aside), x + size_x + aside, y + size_y + aside
                x1, y1 = min(nx, x1), min(ny, y1)
                if standing[x1, y1] - standing[x0, y1] - standing[x1, y0] + standing[x0, y0]:
                    continue
            is_here_own = own.size == 0 or own[i, j]
            if is_own and not is_here_own:
                continue
            seconds = 0.0
            for n in range(len(ends.hoist_s)):
                turn_rad, radial_m = ends.slew_rad[n] - picks.slew_rad[i, j], ends.radius_m[n] - picks.radius_m[i, j]
                seconds += max(across_of(picks.tables, turn_rad, radial_m), ends.hoist_s[n])
            seconds = np.floor(seconds / SAME_S)
            if seconds < least or (is_here_own and not is_own):
                best_x, best_y, least, is_own = x, y, seconds, is_here_own
    return best_x, best_y
