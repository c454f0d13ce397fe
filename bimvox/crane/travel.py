"""The least time of a motion without obstacles, from point to point, and a table of it.

Obstacles are ignored: the search for an order needs millions of travel times, and the height to which loads are raised
over the building is nearly the same for all orders.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import inline_kernel, leaf_kernel
from bimvox.crane.kinematics import Axes, pose_of
from bimvox.crane.tower_crane import AxisLimits, CranePose, TowerCrane, luff_of_radius

# The point-to-point bound: the least time of a motion without obstacles.
#
# Closed form, no sampling: fast enough for millions of calls during the search for an order.


def rest_to_rest_s(distance: float, limits: AxisLimits) -> float:
    """Return the shortest time of one axis from rest to rest under rate, acceleration and jerk limits.

    The double-S profile: Biagiotti & Melchiorri, "Trajectory Planning for Automatic Machines and Robots" (2008), 3.4.

    ``distance``: travel of the axis, in its unit; the sign does not matter.
    """
    return float(least_time_s(abs(distance), limits.rate, limits.acceleration, limits.jerk))


@inline_kernel
def least_time_s(travel: float, v: float, a: float, j: float) -> float:
    """Return the same for a travel that is not negative, a rate, an acceleration and a jerk."""
    reaches_acceleration = v * j >= a * a
    run_up = v / a + a / j if reaches_acceleration else 2.0 * math.sqrt(v / j)
    if travel >= v * run_up:
        return travel / v + run_up
    if reaches_acceleration and travel >= 2.0 * a**3 / j**2:
        ramp = a / j
        return ramp + math.sqrt(ramp * ramp + 4.0 * travel / a)
    return float(np.cbrt(travel / (2.0 * j)) * 4.0)


def point_to_point_s(
    crane: TowerCrane, start: CranePose, end: CranePose, clearance_height_m: float, shaping_s: float = 0.0
) -> float:
    """Return the synchronised point-to-point time: a lower bound for a motion that reaches a clearance height.

    Each axis moves on its own from rest to rest. The hoist moves from the start up to the clearance height, stops, and
    moves down to the end (a clearance height below the higher end costs nothing). The bound is the slowest axis,
    because hoisting, slewing and trolleying may overlap. Slewing takes the shorter direction. Obstacles are ignored.

    Args:
        crane: The crane.
        start: Hook pose at rest.
        end: Hook pose at rest.
        clearance_height_m: Height of the hook above the site's z = 0 that the motion must reach.
        shaping_s: Extra time of slewing and trolleying for shaping against swing: half a period.
    """
    turn = math.remainder(end.slew_rad - start.slew_rad, 2.0 * math.pi)
    low, high = sorted((start.height_m, end.height_m))
    if clearance_height_m <= high:
        hoist_s = rest_to_rest_s(high - low, crane.hoist)
    else:
        hoist_s = rest_to_rest_s(clearance_height_m - low, crane.hoist)
        hoist_s += rest_to_rest_s(clearance_height_m - high, crane.hoist)
    across_s = max(rest_to_rest_s(turn, crane.slewing), _radial_s(crane, start.radius_m, end.radius_m))
    return max(across_s + shaping_s if across_s > 0.0 else 0.0, hoist_s)


def _radial_s(crane: TowerCrane, start_m: float, end_m: float) -> float:
    """Return the time of the axis that changes the radius: the trolley or the luffing axis."""
    if crane.luffing is None:
        return rest_to_rest_s(end_m - start_m, crane.trolley)
    start, end = luff_of_radius(crane.luffing, np.array([start_m, end_m])).tolist()
    return rest_to_rest_s(end - start, crane.luffing.limits)


_STEPS = 1024


class AcrossTables(NamedTuple):
    """What kernels look up: (1025,) seconds of slewing up to half a turn, and of the trolley up to ``longest_m``."""

    slewing_s: NDArray[np.float64]
    trolley_s: NDArray[np.float64]
    longest_m: float


class Travel:
    """Travel times of a crane.

    Args:
        crane: The crane.
        longest_m: The longest travel of the trolley and the hoist that will be asked for.
    """

    def __init__(self, crane: TowerCrane, longest_m: float) -> None:
        self._crane = crane
        self.across = AcrossTables(_table(crane.slewing, math.pi), _table(crane.trolley, longest_m), longest_m)
        self._hoist = _table(crane.hoist, longest_m)
        self._longest_m = longest_m

    def with_hoist(self, limits: AxisLimits) -> Travel:
        """Return the travel times with other limits of the hoist."""
        return Travel(replace(self._crane, hoist=limits), self._longest_m)

    def axes_of(self, points_m: NDArray[np.float64]) -> Axes:
        """Return slew (rad), radius and height (m) of the hook at points, (..., 3) metres."""
        return pose_of(self._crane, points_m)

    def between_s(self, start: Axes, end: Axes) -> NDArray[np.float64]:
        """Return seconds between hook poses, broadcast against each other: the slowest axis (``crane.bound``)."""
        across_s = self.across_s(end[0] - start[0], end[1] - start[1])
        longer: NDArray[np.float64] = np.maximum(across_s, self.hoisting_s(end[2] - start[2]))
        return longer

    def across_s(self, turn_rad: NDArray[np.float64], radial_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return seconds of slewing, the shorter way around, and trolleying at the same time."""
        turn, radial = (np.array(one, np.float64, order="C") for one in np.broadcast_arrays(turn_rad, radial_m))
        seconds = np.empty(turn.size)
        _write_across(seconds, self.across, turn.ravel(), radial.ravel())
        return seconds.reshape(turn.shape)

    def hoisting_s(self, height_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return seconds of hoisting or lowering."""
        share = np.abs(height_m) / self._longest_m
        result: NDArray[np.float64] = self._hoist[np.clip(share * _STEPS, 0, _STEPS).astype(np.int64)]
        return result


@inline_kernel
def across_of(tables: AcrossTables, turn_rad: float, radial_m: float) -> float:
    """Return seconds as ``Travel.across_s`` does."""
    turn_rad = abs(turn_rad)
    turned = min(turn_rad, 2.0 * math.pi - turn_rad) / math.pi * _STEPS
    moved = abs(radial_m) / tables.longest_m * _STEPS
    seconds: float = max(
        tables.slewing_s[int(min(turned, _STEPS))],
        tables.trolley_s[int(min(moved, _STEPS))],
    )
    return seconds


@leaf_kernel
def _write_across(
    seconds: NDArray[np.float64], tables: AcrossTables, turn_rad: NDArray[np.float64], radial_m: NDArray[np.float64]
) -> None:
    for n in range(len(seconds)):
        seconds[n] = across_of(tables, turn_rad[n], radial_m[n])


@lru_cache(maxsize=256)
def _table(limits: AxisLimits, longest: float) -> NDArray[np.float64]:
    seconds = np.empty(_STEPS + 1)
    _write_least(seconds, longest, limits.rate, limits.acceleration, limits.jerk)
    return seconds


@leaf_kernel
def _write_least(seconds: NDArray[np.float64], longest: float, rate: float, acceleration: float, jerk: float) -> None:
    for n in range(len(seconds)):
        seconds[n] = least_time_s(longest * n / _STEPS, rate, acceleration, jerk)
