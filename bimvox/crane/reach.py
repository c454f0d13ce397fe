"""Reach: where the hook may be, as a map over the site's columns.

Rope, reach and capacity constrain the hook, not the load's boxes. A column is admissible if its centre lies between the
smallest and the largest radius, and within the radius at which the load chart carries the mass. For a load, the hook's
own place within its column counts instead of the centre.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.crane.jib_map import jib_blocked
from bimvox.crane.load_chart import max_radius_m
from bimvox.crane.luffing import LuffingJib, luff_of_radius, tip_height_m
from bimvox.crane.tower_crane import TowerCrane
from bimvox.crane.working_range import columns_in_range

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
    low_m, high_m = allowed_radii_m(crane, mass_kg)
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
    given = crane.working_range
    if given.slew_rad is not None or given.radius_m is not None:
        shape = (floor.shape[0], floor.shape[1])
        origin_m = (frame.origin_m[0] + aside_m[0], frame.origin_m[1] + aside_m[1], frame.origin_m[2])
        outside = ~columns_in_range(given, crane.base_m, origin_m, frame.voxel_size_m, shape)
        floor[outside] = HOOK_FORBIDDEN
    return floor


def hook_top(
    crane: TowerCrane, frame: ColumnFrame, shape: tuple[int, int, int], half_m: float = 0.0
) -> NDArray[np.int32]:
    """Return the highest cell at which the foot of the hook line may be, per column.

    Args:
        crane: The crane, with the slings of the load.
        frame: Metres to cells.
        shape: (X, Y, Z) of the grid.
        half_m: How far the load reaches from its hook on plan: a luffing jib descends towards the mast, and the whole
            load must stay below it.

    Returns:
        (X, Y) int32, or an array of size 0 if the hook can reach the top of the grid.
    """
    if crane.luffing is not None:
        return _below_the_jib(crane, crane.luffing, frame, shape, half_m)
    highest = int(np.floor((crane.highest_hook_m - crane.sling_m - frame.origin_m[2]) / frame.voxel_size_m + 1e-6))
    if highest >= shape[2]:
        return np.zeros((0, 0), np.int32)
    return np.full(shape[:2], highest, np.int32)


def _below_the_jib(
    crane: TowerCrane, jib: LuffingJib, frame: ColumnFrame, shape: tuple[int, int, int], half_m: float
) -> NDArray[np.int32]:
    """Return the highest load top under a luffing jib: the hook below the tip, the load's inner edge below the jib.

    A column represents hooks up to one cell away: the tip is taken at the radius where it is lowest.
    """
    size = frame.voxel_size_m
    x = frame.origin_m[0] - crane.base_m[0] + size * (np.arange(shape[0]) + 0.5)
    y = frame.origin_m[1] - crane.base_m[1] + size * (np.arange(shape[1]) + 0.5)
    radius = np.minimum(np.hypot(x[:, None], y[None, :]) + size, crane.jib_length_m)
    luff = np.clip(luff_of_radius(jib, radius), *jib.luff_rad)
    inner = np.maximum(radius - half_m - 2.0 * size - jib.pivot_offset_m, 0.0)
    tip_m = np.minimum(tip_height_m(jib, radius) - LUFFING_HOOK_ROOM_M, crane.highest_hook_m) - crane.sling_m
    jib_m = jib.pivot_height_m + inner * np.tan(luff) - jib.width_m / 2.0
    highest = np.floor((np.minimum(tip_m, jib_m) - frame.origin_m[2]) / size + 1e-6)
    ceiling: NDArray[np.int32] = np.clip(highest, -1, shape[2]).astype(np.int32)
    return ceiling


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
