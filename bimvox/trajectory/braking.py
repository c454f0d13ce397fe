"""Braking one axis: from any rate and acceleration to rest, as fast as its acceleration and jerk allow.

The velocity half of the double-S profile (Biagiotti & Melchiorri, "Trajectory Planning for Automatic Machines and
Robots", 2008, 3.4): jerk to the braking acceleration, hold it, jerk back to none. Where the axis ends is what comes of
it; a stop is not a move to somewhere.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import copysign, sqrt

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.tower_crane import AxisLimits


@dataclass(frozen=True, slots=True, eq=False)
class AxisBraking:
    """One axis coming to rest, as pieces of constant jerk.

    Attributes:
        start_s: (P,) float64 start of each piece, from 0.
        state: (P, 4) float64 position, rate, acceleration and jerk at the start of each piece.
        duration_s: When it is at rest.
        end: Where it is then.
    """

    start_s: NDArray[np.float64]
    state: NDArray[np.float64]
    duration_s: float
    end: float

    @property
    def distance(self) -> float:
        """Way from where braking began to where the axis rests, with its sign."""
        return self.end - float(self.state[0, 0])

    def at(self, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the position at times ((N,)): held at the start before 0 and at the end after the axis rests."""
        piece = np.clip(np.searchsorted(self.start_s, time_s, side="right") - 1, 0, None)
        t = np.maximum(time_s - self.start_s[piece], 0.0)
        p, v, a, j = self.state[piece].T
        return np.where(time_s >= self.duration_s, self.end, p + t * (v + t * (a / 2.0 + t * j / 6.0)))


def brake(position: float, rate: float, acceleration: float, limits: AxisLimits) -> AxisBraking:
    """Return the fastest way of an axis to rest.

    Args:
        position: Where it is, in the axis's unit.
        rate: How fast it goes, unit/s.
        acceleration: Its acceleration, unit/s^2; one beyond the limit is taken to be at it.
        limits: The axis's limits.
    """
    most, jerk = limits.acceleration, limits.jerk
    acceleration = min(max(acceleration, -most), most)
    # The rate that is left when only the acceleration is taken away says which way to brake.
    left = rate + acceleration * abs(acceleration) / (2.0 * jerk)
    way = -copysign(1.0, left)
    now, needed = way * acceleration, -way * rate
    peak = min(most, sqrt(max(0.0, jerk * needed + now * now / 2.0)))
    peak = max(peak, now)
    held = max(0.0, (needed - (2.0 * peak * peak - now * now) / (2.0 * jerk)) / peak) if peak > 0.0 else 0.0
    pieces = (((peak - now) / jerk, way * jerk), (held, 0.0), (peak / jerk, -way * jerk))
    starts, states, at = [], [], 0.0
    p, v, a = position, rate, acceleration
    for length, j in pieces:
        if length <= 0.0:
            continue
        starts.append(at)
        states.append((p, v, a, j))
        p += length * (v + length * (a / 2.0 + length * j / 6.0))
        v += length * (a + length * j / 2.0)
        a += length * j
        at += length
    if not states:
        starts, states = [0.0], [(position, 0.0, 0.0, 0.0)]
    return AxisBraking(np.array(starts), np.array(states), at, p)
