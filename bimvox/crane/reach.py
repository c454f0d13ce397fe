"""Reach: where the hook may be, as a map over the site's columns, and which mast a machine needs there.

Rope, reach and capacity constrain the hook, not the load's boxes. A column is admissible if its centre lies between the
smallest and the largest radius, and within the radius at which the load chart carries the mass. For a load, the hook's
own place within its column counts instead of the centre.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from hashlib import sha256
from typing import NamedTuple, Protocol
from weakref import ref

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import maximum_filter

from bimvox.compiled import kernel
from bimvox.crane.kinematics import with_luffing_jib
from bimvox.crane.load_chart import max_radius_m
from bimvox.crane.sectors import capacities_kg, charts_of, sectors_of
from bimvox.crane.tower_crane import LuffingJib, TowerCrane, columns_in_range, luff_of_radius, tip_height_m

# Hook columns at which a luffing jib and its counterweight are clear of everything.
#
# The hook column determines slew and luff angle, and so the position of the whole jib. So the jib's collisions are one
# more map of hook columns, like reach and rope. Along the ray from the slewing axis to the column, the jib's underside
# must be above everything; on the other side of the axis, so must the counterweight's.


def jib_blocked(
    jib: LuffingJib,
    base_m: tuple[float, float, float],
    origin_m: tuple[float, float, float],
    voxel_size_m: float,
    top: NDArray[np.int32],
    own_m: float,
    reach_m: tuple[float, float],
) -> NDArray[np.bool_]:
    """Return the (X, Y) columns over which the hook may not be because jib or counterweight would hit something.

    Args:
        jib: The jib.
        base_m: Foot of the slewing axis.
        origin_m: Lowest corner of the grid.
        voxel_size_m: Edge of a cell.
        top: (X, Y) int32, one above the highest occupied cell of each column.
        own_m: Half the edge of the mast or the undercarriage; cells there are the crane itself.
        reach_m: Smallest and largest radius that matters.
    """
    key = _Heights(sha256(np.ascontiguousarray(top).data).digest(), ref(top))
    return _jib_blocked(jib, base_m, origin_m, voxel_size_m, key, own_m, reach_m)


@dataclass(frozen=True, slots=True)
class _Heights:
    """A height map as a key.

    Attributes:
        digest: Of its cells.
        cells: The map, which the key does not keep alive.
    """

    digest: bytes
    cells: ref[NDArray[np.int32]] = field(compare=False)


@lru_cache(maxsize=32)  # lift after lift, hook and load, their ways and their ends: few maps are new
def _jib_blocked(
    jib: LuffingJib,
    base_m: tuple[float, float, float],
    origin_m: tuple[float, float, float],
    voxel_size_m: float,
    heights: _Heights,
    own_m: float,
    reach_m: tuple[float, float],
) -> NDArray[np.bool_]:
    top = heights.cells()
    assert top is not None
    # The jib covers the cells around its ray: the map is widened by its half width and one cell.
    wide = 1 + 2 * int(np.ceil((jib.width_m / 2.0) / voxel_size_m + 1.0))
    tail_wide = 1 + 2 * int(np.ceil((jib.tail_width_m / 2.0) / voxel_size_m + 1.0))
    over = _without_own(top, base_m, origin_m, voxel_size_m, own_m)
    blocked: NDArray[np.bool_] = _blocked(
        np.ascontiguousarray(maximum_filter(over, size=wide, mode="constant")).astype(np.int32),
        np.ascontiguousarray(maximum_filter(over, size=tail_wide, mode="constant")).astype(np.int32),
        np.array([*base_m[:2], *origin_m, voxel_size_m]),
        np.array([jib.pivot_offset_m, jib.pivot_height_m, jib.length_m, *jib.luff_rad]),
        np.array([jib.tail_radius_m, jib.tail_low_m]),
        np.array(reach_m),
    )
    blocked.setflags(write=False)
    return blocked


def _without_own(
    top: NDArray[np.int32],
    base_m: tuple[float, float, float],
    origin_m: tuple[float, float, float],
    voxel_size_m: float,
    own_m: float,
) -> NDArray[np.int32]:
    """Return the height map without the crane itself."""
    low = [int(np.floor((base_m[i] - own_m - origin_m[i]) / voxel_size_m)) - 1 for i in (0, 1)]
    high = [int(np.ceil((base_m[i] + own_m - origin_m[i]) / voxel_size_m)) + 1 for i in (0, 1)]
    over = top.copy()
    over[max(0, low[0]) : max(0, high[0]), max(0, low[1]) : max(0, high[1])] = 0
    return over


@kernel
def _blocked(
    top: NDArray[np.int32],
    tail_top: NDArray[np.int32],
    place: NDArray[np.float64],
    jib: NDArray[np.float64],
    tail: NDArray[np.float64],
    reach: NDArray[np.float64],
) -> NDArray[np.bool_]:
    nx, ny = top.shape
    base_x, base_y, origin_x, origin_y, origin_z, size = place
    offset, pivot, length, lowest, highest = jib
    blocked = np.zeros((nx, ny), np.bool_)
    highest_m, highest_tail_m = origin_z + top.max() * size, origin_z + tail_top.max() * size
    for i in range(nx):
        for j in range(ny):
            dx = origin_x + (i + 0.5) * size - base_x
            dy = origin_y + (j + 0.5) * size - base_y
            radius = np.sqrt(dx * dx + dy * dy)
            if radius < reach[0] - size or radius > reach[1] + size or radius < 1e-6:
                continue
            ux, uy = dx / radius, dy / radius
            # A column represents hooks up to one cell further out, where the jib is lower.
            share = min(max((radius + size - offset) / length, np.cos(highest)), np.cos(lowest))
            slope = np.sqrt(1.0 - share * share) / share
            steps = int(np.ceil((radius + size) / (0.5 * size)))
            for n in range(steps + 1):
                at = n * 0.5 * size
                if at < offset:
                    continue
                lowest_m = max(pivot + (at - offset - size) * slope, pivot - size) - size
                if highest_m <= lowest_m:
                    break  # it rises: everything is below it from here on
                x = int(np.floor((base_x + ux * at - origin_x) / size))
                y = int(np.floor((base_y + uy * at - origin_y) / size))
                if x < 0 or y < 0 or x >= nx or y >= ny:
                    continue
                if top[x, y] > 0 and origin_z + top[x, y] * size > lowest_m:
                    blocked[i, j] = True
                    break
            if highest_tail_m <= tail[1]:
                continue
            steps = int(np.ceil(tail[0] / (0.5 * size)))
            for n in range(steps + 1):
                if blocked[i, j]:
                    break
                at = n * 0.5 * size
                x = int(np.floor((base_x - ux * at - origin_x) / size))
                y = int(np.floor((base_y - uy * at - origin_y) / size))
                if x < 0 or y < 0 or x >= nx or y >= ny:
                    continue
                if tail_top[x, y] > 0 and origin_z + tail_top[x, y] * size > tail[1]:
                    blocked[i, j] = True
    return blocked


HOOK_FORBIDDEN = np.int32(2**30)
"""Entry of a hook floor where the hook may not be."""

# Rounding noise of a radius, metres: a column whose centre is exactly at the limit counts as within.
_SLACK_M = 1e-9

LUFFING_HOOK_ROOM_M = 1.5
"""Room between the hook and the tip of a luffing jib: hook block and limit switch."""


class ColumnFrame(Protocol):
    """The part of ``bimvox.grid.frame.GridFrame`` that reach needs (grid and crane do not import each other)."""

    @property
    def origin_m(self) -> tuple[float, float, float]:
        """Lowest corner of cell (0, 0, 0), metres."""

    @property
    def voxel_size_m(self) -> float:
        """Edge of a cell, metres."""


def allowed_radii_m(crane: TowerCrane, mass_kg: float, most_used: float = 1.0) -> tuple[float, float]:
    """Return the smallest and the largest hook radius for a load of ``mass_kg``; largest < smallest if there is none.

    The crane's rigging counts as load. ``most_used`` is the share of the capacity that may be used.
    """
    carried = max_radius_m(crane.chart, (mass_kg + crane.tackle_kg) / most_used)
    return crane.min_radius_m, min(crane.jib_length_m, carried) if carried > 0.0 else -np.inf


def counted_kg(crane: TowerCrane, mass_kg: float, most_used: float) -> float:
    """Return the load that uses the whole capacity where a load of ``mass_kg`` uses the share ``most_used`` of it."""
    return mass_kg if most_used == 1.0 else (mass_kg + crane.tackle_kg) / most_used - crane.tackle_kg


def hook_floor(
    crane: TowerCrane | None,
    frame: ColumnFrame,
    top: NDArray[np.int32],
    mass_kg: float,
    rope: bool,
    mast_clearance_m: float = 0.0,
    aside_m: tuple[float, float] = (0.0, 0.0),
    slack_m: float = 0.0,
) -> NDArray[np.int32]:
    """Return the lowest cell at which the foot of the hook line may be, per column.

    Args:
        crane: The crane; without one nothing is forbidden and the floor is 0 everywhere.
        frame: Metres to cells.
        top: (X, Y) int32 height map: one above the highest occupied cell of each column, 0 if it is empty.
        mass_kg: The load's mass, without rigging, or what counts for it (:func:`counted_kg`).
        rope: Whether the column above the hook must be free: the floor is then ``top``, otherwise 0.
        mast_clearance_m: Clearance by which the mast's cells in ``top`` are wider than the mast.
        aside_m: How far the hook is from the middle of its column.
        slack_m: By how much a radius may be out of the limits.

    Returns:
        (X, Y) int32; ``HOOK_FORBIDDEN`` where the hook may not be: outside the crane's radii for this mass, or if even
        at the floor the slings do not fit under the jib.
    """
    if crane is None:
        return np.zeros(top.shape, np.int32)
    low_m, high_m = _furthest_radii_m(crane, mass_kg)
    highest = (crane.highest_hook_m - crane.sling_m - frame.origin_m[2]) / frame.voxel_size_m
    floor: NDArray[np.int32] = _hook_floor(
        top,
        bool(rope),
        (frame.origin_m[0] + aside_m[0] - crane.base_m[0]) / frame.voxel_size_m,
        (frame.origin_m[1] + aside_m[1] - crane.base_m[1]) / frame.voxel_size_m,
        (low_m - _SLACK_M - slack_m) / frame.voxel_size_m,
        (high_m + _SLACK_M + slack_m) / frame.voxel_size_m,
        int(np.floor(highest + 1e-6)),
        HOOK_FORBIDDEN,
    )
    if crane.luffing is not None:
        own_m, reach_m = crane.mast_size_m / 2.0 + mast_clearance_m, (max(0.0, low_m), high_m)
        floor[jib_blocked(crane.luffing, crane.base_m, frame.origin_m, frame.voxel_size_m, top, own_m, reach_m)] = (
            HOOK_FORBIDDEN
        )
    if sectors_of(crane):
        shape = (floor.shape[0], floor.shape[1])
        floor[_overloaded(crane, frame, shape, mass_kg + crane.tackle_kg, aside_m, slack_m)] = HOOK_FORBIDDEN
    given = crane.working_range
    if given.slew_rad is not None or given.radius_m is not None:
        shape = (floor.shape[0], floor.shape[1])
        origin_m = (frame.origin_m[0] + aside_m[0], frame.origin_m[1] + aside_m[1], frame.origin_m[2])
        outside = ~columns_in_range(given, crane.base_m, origin_m, frame.voxel_size_m, shape)
        floor[outside] = HOOK_FORBIDDEN
    return floor


def _furthest_radii_m(crane: TowerCrane, mass_kg: float) -> tuple[float, float]:
    """Return the smallest and the largest hook radius for a load in any direction."""
    limits = [allowed_radii_m(replace(crane, chart=chart), mass_kg) for chart in charts_of(crane)]
    return limits[0][0], max(high_m for _, high_m in limits)


def _overloaded(
    crane: TowerCrane,
    frame: ColumnFrame,
    shape: tuple[int, int],
    hung_kg: float,
    aside_m: tuple[float, float],
    slack_m: float,
) -> NDArray[np.bool_]:
    """Return (X, Y) whether a mass on the rope is more than the sector's chart lists where the hook is in a column."""
    x, y = (
        frame.origin_m[axis] + aside_m[axis] - crane.base_m[axis] + frame.voxel_size_m * (np.arange(shape[axis]) + 0.5)
        for axis in (0, 1)
    )
    radius_m = np.hypot(x[:, None], y[None, :]) - slack_m
    slew_rad = np.broadcast_to(np.arctan2(y[None, :], x[:, None]), shape)
    overloaded: NDArray[np.bool_] = capacities_kg(crane, slew_rad, radius_m) < hung_kg * (1.0 - 1e-12)
    return overloaded


Rectangle = tuple[float, float, float, float]
"""Lowest x and y, then highest x and y, metres."""


def hook_top(
    crane: TowerCrane, frame: ColumnFrame, shape: tuple[int, int, int], load_m: Rectangle | float = 0.0
) -> NDArray[np.int32]:
    """Return the highest cell at which the foot of the hook line may be, per column.

    Args:
        crane: The crane, with the slings of the load.
        frame: Metres to cells.
        shape: (X, Y, Z) of the grid.
        load_m: What the load covers on plan, from its hook: a luffing jib descends towards the mast, and the whole load
            must stay below it. A rectangle for a load that keeps its heading; for one at any heading, its radius.

    Returns:
        (X, Y) int32, or an array of size 0 if the hook can reach the top of the grid.
    """
    if crane.luffing is not None:
        return _below_the_jib(crane, crane.luffing, frame, shape, load_m)
    highest = int(np.floor((crane.highest_hook_m - crane.sling_m - frame.origin_m[2]) / frame.voxel_size_m + 1e-6))
    if highest >= shape[2]:
        return np.zeros((0, 0), np.int32)
    return np.full(shape[:2], highest, np.int32)


def _below_the_jib(
    crane: TowerCrane, jib: LuffingJib, frame: ColumnFrame, shape: tuple[int, int, int], load_m: Rectangle | float
) -> NDArray[np.int32]:
    """Return the highest load top under a luffing jib: the hook below the tip, the load's inner edge below the jib.

    A column represents hooks up to one cell away: the tip is taken at the radius where it is lowest.
    """
    size = frame.voxel_size_m
    x = (frame.origin_m[0] - crane.base_m[0] + size * (np.arange(shape[0], dtype=np.float64) + 0.5))[:, None]
    y = (frame.origin_m[1] - crane.base_m[1] + size * (np.arange(shape[1], dtype=np.float64) + 0.5))[None, :]
    radius = np.minimum(np.hypot(x, y) + size, crane.jib_length_m)
    luff = np.clip(luff_of_radius(jib, radius), *jib.luff_rad)
    inward_m = load_m if isinstance(load_m, float) else _inward_m(load_m, x, y, jib.width_m / 2.0, size)
    inner = np.maximum(radius - inward_m - 2.0 * size - jib.pivot_offset_m, 0.0)
    tip_m = np.minimum(tip_height_m(jib, radius) - LUFFING_HOOK_ROOM_M, crane.highest_hook_m) - crane.sling_m
    jib_m = jib.pivot_height_m + inner * np.tan(luff) - jib.width_m / 2.0
    highest = np.floor((np.minimum(tip_m, jib_m) - frame.origin_m[2]) / size + 1e-6)
    ceiling: NDArray[np.int32] = np.clip(highest, -1, shape[2]).astype(np.int32)
    return ceiling


def _inward_m(
    load_m: Rectangle | Sequence[NDArray[np.float64]],
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    half_m: float,
    size_m: float,
) -> NDArray[np.float64]:
    """Return how far a load reaches from its hook towards the slewing axis, where it is below the jib.

    Seen along the jib, only the part of the load within its width counts. From a hook elsewhere in the column the jib
    points a little aside, so it counts as so much wider. All arrays have shapes that fit each other.

    Args:
        load_m: The load on plan, from its hook.
        x: Where the hook is, from the axis.
        y: The same.
        half_m: Half the jib's width.
        size_m: Edge of a column.
    """
    radius_m = np.maximum(np.hypot(x, y), max(size_m, 1e-9))
    ux, uy = x / radius_m, y / radius_m
    low_x, low_y, high_x, high_y = load_m
    reach_m = np.hypot(np.maximum(-low_x, high_x), np.maximum(-low_y, high_y))
    turned = np.minimum(2.0**0.5 * size_m / radius_m, 1.0)
    wide_m = np.minimum(half_m + 0.5 * 2.0**0.5 * size_m + reach_m * turned, reach_m)
    # The corner towards the axis; if it is aside of the jib, the end of the line along the jib's edge instead.
    corner_x, corner_y = np.where(ux > 0.0, low_x, high_x), np.where(uy > 0.0, low_y, high_y)
    aside_m = np.clip(corner_y * ux - corner_x * uy, -wide_m, wide_m)
    with np.errstate(divide="ignore", invalid="ignore"):
        along_x = np.where(np.abs(ux) > 1e-9, (corner_x + aside_m * uy) / ux, -np.inf)
        along_y = np.where(np.abs(uy) > 1e-9, (corner_y - aside_m * ux) / uy, -np.inf)
    inward_m: NDArray[np.float64] = -np.maximum(along_x, along_y) + wide_m * turned
    return np.minimum(inward_m, reach_m)


def highest_loads_m(
    jib: LuffingJib,
    from_axis_m: tuple[NDArray[np.float64], NDArray[np.float64]],
    load_m: Rectangle | Sequence[NDArray[np.float64]],
) -> NDArray[np.float64]:
    """Return the highest top of a load that keeps its heading and is below the jib as a whole, not only at its hook.

    Args:
        jib: The jib.
        from_axis_m: x and y of the hook, from the slewing axis.
        load_m: The load on plan, from its hook.
    """
    x, y = from_axis_m
    radius = np.hypot(x, y)
    luff = np.clip(luff_of_radius(jib, radius), *jib.luff_rad)
    inner = np.maximum(radius - _inward_m(load_m, x, y, jib.width_m / 2.0, 0.0) - jib.pivot_offset_m, 0.0)
    high: NDArray[np.float64] = jib.pivot_height_m + inner * np.tan(luff) - jib.width_m / 2.0
    return high


@kernel
def _hook_floor(
    top: NDArray[np.int32],
    rope: bool,
    from_axis_x: float,
    from_axis_y: float,
    low: float,
    high: float,
    highest: int,
    forbidden: np.int32,
) -> NDArray[np.int32]:
    """Return the floor; all lengths in cells, ``from_axis`` is the grid's corner relative to the slewing axis."""
    floor = np.full(top.shape, forbidden, np.int32)
    if high < low:
        return floor
    low_squared = max(low, 0.0) ** 2
    high_squared = high**2
    for i in range(top.shape[0]):
        dx = from_axis_x + i + 0.5
        for j in range(top.shape[1]):
            dy = from_axis_y + j + 0.5
            squared = dx * dx + dy * dy
            lowest = top[i, j] if rope else np.int32(0)
            if low_squared <= squared <= high_squared and lowest <= highest:
                floor[i, j] = lowest
    return floor


class _BuiltHeights(NamedTuple):
    """Height map of the finished building.

    Attributes:
        origin_m: Lowest corner on plan.
        size_m: Edge of a column, and height of a step.
        top: (X, Y) int32 height of each column, in steps above z = 0.
    """

    origin_m: tuple[float, float]
    size_m: float
    top: NDArray[np.int32]


def built_heights(boxes_m: ArrayLike, size_m: float = 0.5) -> _BuiltHeights:
    """Return the height map of boxes ((N, 2, 3) lowest and highest corners)."""
    boxes = np.asarray(boxes_m, np.float64).reshape(-1, 2, 3)
    low = np.floor(boxes[:, 0, :2].min(axis=0) / size_m).astype(int)
    first = np.floor(boxes[:, 0, :2] / size_m + 1e-6).astype(int) - low
    last = np.maximum(np.ceil(boxes[:, 1, :2] / size_m - 1e-6).astype(int) - low, first + 1)
    heights = np.maximum(np.ceil(boxes[:, 1, 2] / size_m - 1e-6), 0).astype(np.int32)
    top = np.zeros(last.max(axis=0), np.int32)
    for (i, j), (k, n), height in zip(first.tolist(), last.tolist(), heights.tolist(), strict=True):
        np.maximum(top[i:k, j:n], height, out=top[i:k, j:n])
    return _BuiltHeights((float(low[0] * size_m), float(low[1] * size_m)), size_m, top)


def pivoted(crane: TowerCrane, jib: LuffingJib, height_under_hook_m: float) -> TowerCrane:
    """Return a luffing tower crane on a mast so high that jib and counterweight slew above everything.

    A mobile crane is returned unchanged.
    """
    if crane.kind == "mobile":
        return crane
    below_m = jib.pivot_height_m - jib.tail_low_m
    low_m = float(np.ceil(2.0 * height_under_hook_m) / 2.0)
    return with_luffing_jib(crane, replace(jib, pivot_height_m=low_m + below_m, tail_low_m=low_m))


def highest_hooks_m(jib: LuffingJib, radii_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the highest hook at radii, metres; -inf beyond the jib's reach."""
    high = tip_height_m(jib, radii_m) - LUFFING_HOOK_ROOM_M
    low_m, far_m = jib.radii_m
    return np.where((radii_m >= low_m) & (radii_m <= far_m), high, -np.inf)


def points_blocked(crane: TowerCrane, jib: LuffingJib, points_m: NDArray[np.float64], built: _BuiltHeights) -> int:
    """Return at how many of (N, 2) points the finished building blocks the jib."""
    size = built.size_m
    blocked = jib_blocked(
        jib,
        crane.base_m,
        (*built.origin_m, 0.0),
        size,
        built.top,
        crane.mast_size_m / 2.0,
        (max(0.0, crane.min_radius_m), crane.jib_length_m),
    )
    cells = np.floor((points_m - np.array(built.origin_m)) / size).astype(int)
    inside = ((cells >= 0) & (cells < blocked.shape)).all(axis=1)
    return int(blocked[tuple(cells[inside].T)].sum())


MAST_CLEARANCE_M = 1.5
"""Free width between the mast and the building or the yard."""
HOOK_BLOCK_M = 2.0
"""Room between the highest hook and the rope exit: hook block and limit switch."""
MARGIN_M = 0.5
"""Distance by which points lie inside the radius limits."""


def radii_for_m(crane: TowerCrane, masses_kg: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (N, 2) the smallest and the largest radius at which a crane carries each mass."""
    different, which = np.unique(masses_kg, return_inverse=True)
    return np.array([allowed_radii_m(crane, float(mass)) for mass in different]).reshape(-1, 2)[which.ravel()]


def distances_m(bases_m: NDArray[np.float64], points_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (B, N) distances on plan."""
    return np.hypot(points_m[:, 0] - bases_m[:, 0, None], points_m[:, 1] - bases_m[:, 1, None])


def standing(machine: TowerCrane, height_under_hook_m: float) -> TowerCrane:
    """Return a machine on a mast so high that its hook reaches a height."""
    if machine.luffing is not None:
        return pivoted(machine, machine.luffing, height_under_hook_m)
    return replace(machine, jib_height_m=float(height_under_hook_m + HOOK_BLOCK_M))


def distance_to_polygon_m(points_m: NDArray[np.float64], polygon_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (N,) distances of (N, 2) points to a simple polygon (K, 2), 0 inside."""
    start, end = polygon_m, np.roll(polygon_m, -1, axis=0)
    edge = end - start
    relative = points_m[:, None, :] - start[None]
    length_squared = np.maximum((edge**2).sum(axis=1), 1e-300)
    along = np.clip((relative * edge).sum(axis=2) / length_squared, 0.0, 1.0)
    nearest = np.sqrt(((relative - along[:, :, None] * edge) ** 2).sum(axis=2)).min(axis=1)
    # Even-odd rule: the ray in +x crosses an edge if the edge's ends lie on both sides of the point's y.
    y = points_m[:, 1, None]
    crosses = (start[:, 1] > y) != (end[:, 1] > y)
    rise = np.where(edge[:, 1] == 0.0, 1.0, edge[:, 1])
    at_x = start[:, 0] + (y - start[:, 1]) / rise * edge[:, 0]
    inside = (crosses & (points_m[:, 0, None] < at_x)).sum(axis=1) % 2 == 1
    distance: NDArray[np.float64] = np.where(inside, 0.0, nearest)
    return distance
