"""The point-to-point bound: the least time of a motion without obstacles.

Closed form, no sampling: fast enough for millions of calls during the search for an order.
"""

from __future__ import annotations

import math

import numpy as np

from bimvox.compiled import inline_kernel
from bimvox.crane.axis_limits import AxisLimits
from bimvox.crane.luffing import luff_of_radius
from bimvox.crane.tower_crane import CranePose, TowerCrane


def rest_to_rest_s(distance: float, limits: AxisLimits) -> float:
    """Return the shortest time of one axis from rest to rest under rate, acceleration and jerk limits.

    The double-S profile: Biagiotti & Melchiorri, "Trajectory Planning for Automatic Machines and Robots" (2008), 3.4.

    Args:
        distance: Travel of the axis, in its unit; the sign does not matter.
        limits: Limits of the axis.
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
