"""How long the hook is on its way between two places in plan: the point-to-point bound, looked up.

An order and its yard places decide how far the crane slews and trolleys; hoisting is nearly the same for all of them,
and is left out.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.bound import rest_to_rest_s
from bimvox.crane.kinematics import pose_of
from bimvox.crane.tower_crane import AxisLimits, TowerCrane

_STEPS = 1024


class Travel:
    """Travel times of a crane in plan.

    Args:
        crane: The crane.
        longest_m: The longest way of the trolley that is asked for.
    """

    def __init__(self, crane: TowerCrane, longest_m: float) -> None:
        self._crane = crane
        self._slewing = _table(crane.slewing, math.pi)
        self._trolley = _table(crane.trolley, longest_m)
        self._longest_m = longest_m

    def axes_of(self, points_m: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Slew (rad) and radius (m) of the hook over points, (..., 2) metres."""
        slew, radius, _ = pose_of(self._crane, np.concatenate([points_m, np.zeros((*points_m.shape[:-1], 1))], axis=-1))
        return slew, radius

    def between_s(
        self,
        start: tuple[NDArray[np.float64], NDArray[np.float64]],
        end: tuple[NDArray[np.float64], NDArray[np.float64]],
    ) -> NDArray[np.float64]:
        """Return seconds between slew and radius pairs, broadcast against each other."""
        turn = np.abs(end[0] - start[0])
        turn = np.minimum(turn, 2.0 * math.pi - turn)
        slewing = self._slewing[np.clip(turn * (_STEPS / math.pi), 0, _STEPS).astype(np.int64)]
        way = np.abs(end[1] - start[1]) * (_STEPS / self._longest_m)
        trolley = self._trolley[np.clip(way, 0, _STEPS).astype(np.int64)]
        longer: NDArray[np.float64] = np.maximum(slewing, trolley)
        return longer


def _table(limits: AxisLimits, longest: float) -> NDArray[np.float64]:
    return np.array([rest_to_rest_s(longest * n / _STEPS, limits) for n in range(_STEPS + 1)])
