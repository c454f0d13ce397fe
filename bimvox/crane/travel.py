"""Travel times of the hook between two places: the point-to-point bound, from a table.

Obstacles are ignored: the search for an order needs millions of travel times, and the height to which loads are raised
over the building is nearly the same for all orders.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.axis_limits import AxisLimits
from bimvox.crane.bound import rest_to_rest_s
from bimvox.crane.kinematics import Axes, pose_of
from bimvox.crane.tower_crane import TowerCrane

_STEPS = 1024


class Travel:
    """Travel times of a crane.

    Args:
        crane: The crane.
        longest_m: The longest travel of the trolley and the hoist that will be asked for.
    """

    def __init__(self, crane: TowerCrane, longest_m: float) -> None:
        self._crane = crane
        self._slewing = _table(crane.slewing, math.pi)
        self._trolley = _table(crane.trolley, longest_m)
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
        turn = np.abs(turn_rad)
        turn = np.minimum(turn, 2.0 * math.pi - turn)
        slewing = _looked_up(self._slewing, turn / math.pi)
        longer: NDArray[np.float64] = np.maximum(slewing, _looked_up(self._trolley, np.abs(radial_m) / self._longest_m))
        return longer

    def hoisting_s(self, height_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return seconds of hoisting or lowering."""
        return _looked_up(self._hoist, np.abs(height_m) / self._longest_m)


def _looked_up(table: NDArray[np.float64], share: NDArray[np.float64]) -> NDArray[np.float64]:
    found: NDArray[np.float64] = table[np.clip(share * _STEPS, 0, _STEPS).astype(np.int64)]
    return found


@lru_cache(maxsize=256)
def _table(limits: AxisLimits, longest: float) -> NDArray[np.float64]:
    return np.array([rest_to_rest_s(longest * n / _STEPS, limits) for n in range(_STEPS + 1)])
