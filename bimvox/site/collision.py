"""The one definition of collision: whether a component's reference cell may be at a cell.

Environment, search, policy and trajectory check all call :func:`placement_is_free`. A placement is free if

* every box of the shape lies inside the grid and contains no occupied cell (summed-area table), and
* the hook line above it is free and the hook is allowed there (one map of the lowest admissible hook cell per column:
  rope, reach, capacity and zones constrain the hook, not the boxes),

or if the narrow phase has cleared it: in the last moves, where the broad phase hits only parts that the component
touches in the finished building (see ``bimvox.planning.contact.pairs``).
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import inline_kernel, leaf_kernel
from bimvox.crane.reach import HOOK_FORBIDDEN as HOOK_FORBIDDEN
from bimvox.crane.reach import Rectangle, counted_kg
from bimvox.crane.reach import hook_floor as floor_of_hook
from bimvox.crane.reach import hook_top as top_of_hook
from bimvox.crane.tower_crane import TowerCrane
from bimvox.grid.frame import whole_cells
from bimvox.grid.summed_area import box_sum
from bimvox.kept import kept
from bimvox.site.areas import hooks_with_load_over
from bimvox.site.component import Component, IntVec, Shape, turned_aside, turning_columns
from bimvox.site.default_rules import ALL_KEPT, SMALLER_CLEARANCES_M, Kept
from bimvox.site.lifting import crane_for, permitted_share
from bimvox.site.site import Site
from bimvox.site.tandem import halves, jibs_apart, over_both, tandem_rules

NO_CEILING = np.zeros((0, 0), np.int32)
"""``hook_ceiling`` if only the grid's top limits the height."""


class CollisionSpace(NamedTuple):
    """Everything that decides whether a placement is free; a named tuple, so that kernels accept it.

    Attributes:
        table: (X + 1, Y + 1, Z + 1) int32 summed-area table of the occupied cells.
        boxes: (B, 6) int32 half-open boxes of the shape, relative to the reference cell.
        hook_offset: (3,) int32 cell of the hook line's foot relative to the reference cell.
        hook_floor: (X, Y) int32 lowest cell at which the hook line's foot may be; ``HOOK_FORBIDDEN`` where it may not
            be; zeros without the rope rule.
        cleared_low: (3,) int32 lowest corner of the window of placements that the narrow phase checked.
        cleared: (A, B, C) bool placements that it cleared; size 0 if there are none.
        hook_ceiling: (X, Y) int32 highest cell at which the hook line's foot may be (limiters, long slings, a luffing
            jib); size 0 if the jib is above the whole grid.
    """

    table: NDArray[np.int32]
    boxes: NDArray[np.int32]
    hook_offset: NDArray[np.int32]
    hook_floor: NDArray[np.int32]
    cleared_low: NDArray[np.int32]
    cleared: NDArray[np.bool_]
    hook_ceiling: NDArray[np.int32] = NO_CEILING


NOTHING_CLEARED = (np.zeros(3, np.int32), np.zeros((0, 0, 0), np.bool_))
"""``cleared_low`` and ``cleared`` if the narrow phase cleared nothing."""


@inline_kernel
def _boxes_are_free_over(space: CollisionSpace, x: int, y: int, z: int, last_x: int, last_y: int, last_z: int) -> bool:
    """Return whether the shape's swept boxes from one reference cell to another are free and inside the grid."""
    table, boxes = space.table, space.boxes
    for b in range(boxes.shape[0]):
        x0, y0, z0 = x + boxes[b, 0], y + boxes[b, 1], z + boxes[b, 2]
        x1, y1, z1 = last_x + boxes[b, 3], last_y + boxes[b, 4], last_z + boxes[b, 5]
        if x0 < 0 or y0 < 0 or z0 < 0 or x1 >= table.shape[0] or y1 >= table.shape[1] or z1 >= table.shape[2]:
            return False
        if box_sum(table, x0, y0, z0, x1, y1, z1) != 0:
            return False
    return True


@leaf_kernel
def boxes_are_free(space: CollisionSpace, x: int, y: int, z: int) -> bool:
    """Return whether the shape at reference cell (x, y, z) lies inside the grid and meets no occupied cell."""
    return _boxes_are_free_over(space, x, y, z, x, y, z)


@leaf_kernel
def hook_is_free(space: CollisionSpace, x: int, y: int, z: int) -> bool:
    """Return whether the hook line above a component at reference cell (x, y, z) is free and allowed."""
    hook_x, hook_y = x + space.hook_offset[0], y + space.hook_offset[1]
    floor = space.hook_floor
    if hook_x < 0 or hook_y < 0 or hook_x >= floor.shape[0] or hook_y >= floor.shape[1]:
        return False
    foot = z + space.hook_offset[2]
    if space.hook_ceiling.size > 0 and foot > space.hook_ceiling[hook_x, hook_y]:
        return False
    return bool(foot >= floor[hook_x, hook_y])


@leaf_kernel
def placement_is_free(space: CollisionSpace, x: int, y: int, z: int) -> bool:
    """Return whether the component may be at reference cell (x, y, z)."""
    i, j, k = x - space.cleared_low[0], y - space.cleared_low[1], z - space.cleared_low[2]
    cleared = space.cleared
    if 0 <= i < cleared.shape[0] and 0 <= j < cleared.shape[1] and 0 <= k < cleared.shape[2] and cleared[i, j, k]:
        return True
    return boxes_are_free(space, x, y, z) and hook_is_free(space, x, y, z)


@leaf_kernel
def range_is_free(space: CollisionSpace, around: tuple[int, int, int, int, int, int]) -> bool:
    """Return whether the union of a component's boxes over a range of placements is free.

    If it is not, single placements may still be free.

    ``around``: first and last placement, both inclusive; the first no higher than the last.
    """
    x, y, z, last_x, last_y, last_z = around
    if not _boxes_are_free_over(space, x, y, z, last_x, last_y, last_z):
        return False
    for i in range(x, last_x + 1):
        for j in range(y, last_y + 1):
            if not (hook_is_free(space, i, j, z) and hook_is_free(space, i, j, last_z)):
                return False
    return True


@leaf_kernel
def free_up_to(space: CollisionSpace, x: int, y: int, z: int) -> int:
    """Return the lowest z, from the given one up, at which a placement in this column is not free."""
    while z < space.table.shape[2] and placement_is_free(space, x, y, z):
        z += 1
    return z


# Where the hook may be, as one map over the columns: rope, reach, capacity, zones, limiters and the jib itself.
#
# The only place that combines them, for a load and for the empty hook.


class _HookRoom(NamedTuple):
    """Lowest and highest cell at which the hook line's foot may be.

    Attributes:
        floor: (X, Y) int32; ``HOOK_FORBIDDEN`` where the hook may not be.
        ceiling: (X, Y) int32; size 0 if only the grid's top limits the height.
    """

    floor: NDArray[np.int32]
    ceiling: NDArray[np.int32]


def hook_room(
    site: Site,
    crane: TowerCrane | None,
    top: NDArray[np.int32],
    component: Component | None,
    turn: int = 0,
    slack_m: float = 0.0,
    most_used: float | None = None,
) -> _HookRoom:
    """Return the lowest and highest hook cell per column.

    Args:
        site: The site.
        crane: The crane of the hook; None on a site without a crane.
        top: (X, Y) int32, one above the highest occupied cell of each column.
        component: The load; None for the empty hook.
        turn: By how many quarters the load is turned. It is turned back there, so it may have any heading.
        slack_m: By how much a radius may be out of the crane's limits.
        most_used: Share of the load chart that the load may use; None: that of the rules, or what its place needs. Of a
            load on two cranes, that of the rules for it counts.
    """
    if component is not None and component.tandem is not None:
        return _room_of_two(site, top, component, slack_m)
    if crane is not None:
        if most_used is None:
            most_used = _share(site, crane, component)
        crane = crane_for(site, crane, component)
    load_kg, aside_m = 0.0, (0.0, 0.0)
    if component is not None:
        x, y = turned_aside(component.hook_aside_vox, turn)
        load_kg, aside_m = component.mass_kg, (x * site.frame.voxel_size_m, y * site.frame.voxel_size_m)
    if crane is not None:
        load_kg = counted_kg(crane, load_kg, 1.0 if most_used is None else most_used)
    floor = floor_of_hook(crane, site.frame, top, load_kg, site.rules.rope, site.rules.clearance_m, aside_m, slack_m)
    forbidden = np.zeros(top.shape, np.bool_)
    if site.prohibited is not None:
        forbidden |= site.prohibited
    if site.no_load is not None and component is not None:
        forbidden |= hooks_with_load_over(site.no_load, component)
    ceiling = (
        NO_CEILING if crane is None else top_of_hook(crane, site.frame, site.shape, _on_plan_m(site, component, turn))
    )
    if crane is not None and site.hook_heights is not None:
        floor, ceiling = _between(site, crane, floor, ceiling)
    if ceiling.size:
        forbidden |= floor > ceiling
    if forbidden.any():
        floor = np.where(forbidden, HOOK_FORBIDDEN, floor)
    return _HookRoom(floor, ceiling)


def _room_of_two(site: Site, top: NDArray[np.int32], component: Component, slack_m: float) -> _HookRoom:
    """Return the lowest and highest cell of the hook line of a part that two cranes hold: where both hooks may be."""
    most_used = tandem_rules(site.rules).most_share
    rooms = [
        hook_room(site, site.cranes[half.crane], top, half, slack_m=slack_m, most_used=most_used)
        for half in halves(site, component)
    ]
    floor = over_both(site, component, [room.floor for room in rooms], int(HOOK_FORBIDDEN)).max(axis=0)
    highest = np.full(top.shape, site.shape[2], np.int32)
    ceilings = [room.ceiling if room.ceiling.size else highest for room in rooms]
    ceiling = over_both(site, component, ceilings, -1).min(axis=0)
    forbidden = (floor > ceiling) | ~jibs_apart(site, component)
    return _HookRoom(np.where(forbidden, HOOK_FORBIDDEN, floor).astype(np.int32), ceiling.astype(np.int32))


def _share(site: Site, crane: TowerCrane, component: Component | None) -> float:
    return site.rules.highest_utilisation if component is None else permitted_share(site, crane, component)


def _on_plan_m(site: Site, component: Component | None, turn: int) -> Rectangle | float:
    """Return what a load covers on plan, from its hook, metres; its radius if it is turned."""
    if component is None:
        return 0.0
    corners = component.shape.boxes[:, [0, 1, 3, 4]] - np.tile(np.array(component.hook_line_vox[:2]) + 0.5, 2)
    if turn:
        x, y = np.abs(corners[:, [0, 2]]).max(axis=1), np.abs(corners[:, [1, 3]]).max(axis=1)
        return float(np.hypot(x, y).max()) * site.frame.voxel_size_m
    low, high = corners[:, :2].min(axis=0), corners[:, 2:].max(axis=0)
    x0, y0, x1, y1 = (np.concatenate([low, high]) * site.frame.voxel_size_m).tolist()
    return (x0, y0, x1, y1)


def _between(
    site: Site, crane: TowerCrane, floor: NDArray[np.int32], ceiling: NDArray[np.int32]
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Return floor and ceiling within the limiters."""
    assert site.hook_heights is not None
    below_m = crane.sling_m + site.frame.origin_m[2]
    nz = site.shape[2]
    low = np.ceil((site.hook_heights.low_m - below_m) / site.frame.voxel_size_m - 1e-6)
    high = np.floor((site.hook_heights.high_m - below_m) / site.frame.voxel_size_m + 1e-6)
    lowest = np.clip(low, 0, nz + 1).astype(np.int32)
    highest = np.clip(high, -1, nz).astype(np.int32)
    raised = np.where(floor == HOOK_FORBIDDEN, floor, np.maximum(floor, lowest)).astype(np.int32)
    return raised, np.minimum(ceiling, highest).astype(np.int32) if ceiling.size else highest


# The transit clearance of a part, as whole cells on every side.
#
# Between its departure, straight up from the yard, and its gate a part keeps this distance from everything, including
# the ground and the site boundary. Its rope keeps ``rope_clearance_m`` from everything higher than its lower end. Where
# these rules are defaults, a lift may keep less.

CLEARANCES = Kept._fields
"""The clearances that can give way, each by itself."""
_IN_TRANSIT = CLEARANCES[:2]
"""Those on which the way of a transit depends; the others follow from where a part lies, or from its last moves."""
IN_THE_YARD = ("departure_clearance_m", "upending_clearance_m", "turning_clearance_m")


def margin_vox(site: Site, kept: Kept = ALL_KEPT) -> int:
    """Return the transit clearance in whole cells, for a lift that keeps less if the rule gives way."""
    return _whole(site, site.rules.kept_m("transit_clearance_m", kept))


def rope_margin_vox(site: Site, kept: Kept = ALL_KEPT) -> int:
    """Return the transit clearance of hook and rope in whole cells; the arguments are those of ``margin_vox``."""
    return _whole(site, site.rules.kept_m("rope_clearance_m", kept))


def smaller_clearances(site: Site) -> tuple[tuple[Kept, ...], ...]:
    """Return what a lift may keep instead of the rules' clearances; none if they do not give way.

    Each row has one clearance of the load, and in it the rope's. The larger ones come first in both.
    """
    loads_m, ropes_m = (levels_m(site, rule) for rule in _IN_TRANSIT)
    rows = (tuple(Kept(load_m, rope_m) for rope_m in ropes_m if Kept(load_m, rope_m) != ALL_KEPT) for load_m in loads_m)
    return tuple(row for row in rows if row)


def clearance_vox(site: Site, rule: str, level_m: float | None = None) -> int:
    """Return a clearance of the rules in whole cells, or what a lift keeps of it instead."""
    return _whole(site, getattr(site.rules, rule) if level_m is None else level_m)


def levels_vox(site: Site, rule: str) -> tuple[int, ...]:
    """Return a clearance of the rules in whole cells and, if it gives way, the smaller ones, the largest first."""
    return tuple(clearance_vox(site, rule, level_m) for level_m in levels_m(site, rule))


def levels_m(site: Site, rule: str) -> tuple[float | None, ...]:
    """Return None, which is the rule's clearance, and the smaller ones if it gives way, each of fewer cells."""
    levels: list[float | None] = [None]
    cells = _whole(site, getattr(site.rules, rule))
    for smaller_m in SMALLER_CLEARANCES_M if rule in site.rules.gives_way else ():
        if _whole(site, smaller_m) < cells:
            levels.append(smaller_m)
            cells = _whole(site, smaller_m)
    return tuple(levels)


def _whole(site: Site, distance_m: float) -> int:
    return whole_cells(distance_m, site.frame.voxel_size_m)


def in_transit(space: CollisionSpace, margin: int) -> CollisionSpace:
    """Return a collision rule whose boxes are grown on every side by ``margin`` cells."""
    if margin == 0:
        return space
    grown = space.boxes + np.array([-margin] * 3 + [margin] * 3, np.int32)
    return space._replace(boxes=grown)


def grown_cells(cells: NDArray[np.int32], margin: int) -> NDArray[np.int32]:
    """Return (N, 3) int32 cells and all cells up to ``margin`` cells away on each axis, in ascending order."""
    if margin == 0 or len(cells) == 0:
        return cells
    low = cells.min(axis=0) - margin
    dense = np.zeros(cells.max(axis=0) - low + margin + 1, np.bool_)
    dense[tuple((cells - low).T)] = True
    for axis in range(3):
        lines = np.moveaxis(dense, axis, 0)
        before = lines.copy()
        for step in range(1, margin + 1):
            lines[step:] |= before[:-step]
            lines[:-step] |= before[step:]
    grown: NDArray[np.int32] = (np.argwhere(dense) + low).astype(np.int32)
    return grown


_MOST_BANDS = 24


@kept
def turning_shape(component: Component) -> Shape:
    """Return the cells around a part at every heading, relative to its reference cell: a cylinder about its hook line.

    Its boxes overlap none of each other and reach a little further, so that there are few of them.
    """
    columns = turning_columns(component.shape, component.hook_line_vox, 0)
    height = component.shape.size_vox[2]
    rows = np.unique(columns[:, 1])
    boxes = []
    for band in np.array_split(rows, min(len(rows), _MOST_BANDS)):
        own = columns[(columns[:, 1] >= band[0]) & (columns[:, 1] <= band[-1]), 0]
        boxes.append((own.min(), band[0], 0, own.max() + 1, band[-1] + 1, height))
    layers = [np.column_stack([columns, np.full(len(columns), k)]) for k in range(height)]
    return Shape(np.concatenate(layers).astype(np.int32), np.array(boxes, np.int32))


def any_heading_space(site: Site, component: Component, space: CollisionSpace, margin: int) -> CollisionSpace:
    """Return the collision rule for a load at any heading, its boxes grown by a margin, nothing cleared."""
    shape = turning_shape(component)
    floor = space.hook_floor
    if site.no_load is not None:
        floor = np.where(hooks_with_load_over(site.no_load, replace(component, shape=shape)), HOOK_FORBIDDEN, floor)
    low, cleared = NOTHING_CLEARED
    bare = space._replace(boxes=shape.boxes, hook_floor=floor, cleared_low=low, cleared=cleared)
    crane = site.crane_of(component)
    if crane is not None and crane.luffing is not None:
        # The jib descends towards its mast: at another heading the load may reach under a lower part of it.
        on_plan_m = _on_plan_m(site, component, 1)
        top = top_of_hook(crane_for(site, crane, component), site.frame, site.shape, on_plan_m)
        bare = bare._replace(hook_ceiling=np.minimum(space.hook_ceiling, top))
    return in_transit(bare, margin)


def turning_space(
    site: Site, component: Component, space: CollisionSpace, start_vox: IntVec, margin: int
) -> CollisionSpace | None:
    """Return the collision rule of a transit in which a load turns with the jib.

    From the start the load goes straight up in the heading that it has there, until it may turn: this column is
    cleared, and its hook may leave it only above.

    Args:
        site: The site.
        component: The part.
        space: The rule for its transit in its final heading.
        start_vox: Where the transit starts.
        margin: The clearance that it keeps, in whole cells.

    Returns:
        The rule; None if the load can turn nowhere above its start.
    """
    turning = any_heading_space(site, component, space, margin)
    x, y, z = start_vox
    while not placement_is_free(turning, x, y, z):
        if z >= site.shape[2] or not placement_is_free(space, x, y, z):
            return None
        z += 1
    hook = np.array((x, y, z)) + component.hook_offset_vox
    around = tuple(slice(max(0, n - 1), n + 2) for n in hook[:2].tolist())
    floor: NDArray[np.int32] = np.array(turning.hook_floor)
    floor[around] = np.maximum(floor[around], hook[2])
    low, cleared = np.array(start_vox, np.int32), np.ones((1, 1, z - start_vox[2]), np.bool_)
    return turning._replace(hook_floor=floor, cleared_low=low, cleared=cleared)
