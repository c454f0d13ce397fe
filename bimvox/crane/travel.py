"""Travel times of the hook between two places: the point-to-point bound, from a table.

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
from bimvox.crane.axis_limits import AxisLimits
from bimvox.crane.bound import least_time_s
from bimvox.crane.kinematics import Axes, pose_of
from bimvox.crane.tower_crane import TowerCrane

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
        found: NDArray[np.float64] = self._hoist[np.clip(share * _STEPS, 0, _STEPS).astype(np.int64)]
        return found


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
