"""Braking one axis: from any rate and acceleration to rest, as fast as its acceleration and jerk allow.

The velocity half of the double-S profile (Biagiotti & Melchiorri, "Trajectory Planning for Automatic Machines and
Robots", 2008, 3.4): jerk to the braking acceleration, hold it, jerk back to zero. The end position follows from that; a
stop has no target.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import copysign, sqrt

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.crane.axis_limits import AxisLimits


@dataclass(frozen=True, slots=True, eq=False)
class AxisBraking:
    """One axis coming to rest, as pieces of constant jerk.

    Attributes:
        start_s: (P,) float64 start of each piece, from 0.
        state: (P, 4) float64 position, rate, acceleration and jerk at the start of each piece.
        duration_s: Time at which it is at rest.
        end: Its position at rest.
    """

    start_s: NDArray[np.float64]
    state: NDArray[np.float64]
    duration_s: float
    end: float

    @property
    def top_rate(self) -> float:
        """The highest absolute rate while braking."""
        _, v, a, j = self.state.T
        lengths = np.diff(np.append(self.start_s, self.duration_s))
        # Within a piece the rate has its extreme where the acceleration is zero.
        at = np.clip(np.divide(-a, j, out=np.zeros_like(a), where=j != 0.0), 0.0, lengths)
        rates = [v, v + at * (a + at * j / 2.0), v + lengths * (a + lengths * j / 2.0)]
        return float(np.abs(rates).max())

    @property
    def reach(self) -> tuple[float, float]:
        """The smallest and the largest position while braking: at ends of pieces, or where the axis reverses."""
        found = [self.end]
        lengths = np.diff(np.append(self.start_s, self.duration_s))
        for (p, v, a, j), length in zip(self.state.tolist(), lengths.tolist(), strict=True):
            found.append(p)
            turns = np.roots([j / 2.0, a, v]) if (j, a) != (0.0, 0.0) else np.empty(0)
            within = turns.real[(np.abs(turns.imag) < 1e-12) & (turns.real > 0.0) & (turns.real < length)]
            found += (p + within * (v + within * (a / 2.0 + within * j / 6.0))).tolist()
        return float(min(found)), float(max(found))

    def at(self, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the position at times ((N,)): held at the start before 0 and at the end after the axis rests."""
        piece = np.clip(np.searchsorted(self.start_s, time_s, side="right") - 1, 0, None)
        t = np.maximum(time_s - self.start_s[piece], 0.0)
        p, v, a, j = self.state[piece].T
        return np.where(time_s >= self.duration_s, self.end, p + t * (v + t * (a / 2.0 + t * j / 6.0)))


def brake(position: float, rate: float, acceleration: float, limits: AxisLimits) -> AxisBraking:
    """Return the fastest braking of an axis; its initial acceleration is clipped to the limit."""
    lengths, jerks, acceleration = _pieces(rate, acceleration, limits.acceleration, limits.jerk)
    pieces = zip(lengths, jerks, strict=True)
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


def braking_distances(
    rate: NDArray[np.float64], acceleration: NDArray[np.float64], limits: AxisLimits
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return how far an axis moves back and ahead while it brakes, for many states.

    Args:
        rate: (N,) its rate, unit/s.
        acceleration: (N,) its acceleration, unit/s^2.
        limits: The axis's limits.

    Returns:
        (N,) the lowest (0 or less) and (N,) the highest (0 or more) position while braking, relative to the start.
    """
    return _distances(rate, acceleration, limits.acceleration, limits.jerk)


@kernel
def _pieces(
    rate: float, acceleration: float, most: float, jerk: float
) -> tuple[tuple[float, float, float], tuple[float, float, float], float]:
    """Return lengths (s) and jerks of the three pieces of braking, and the initial acceleration."""
    acceleration = min(max(acceleration, -most), most)
    # The rate that is left once the acceleration is reduced to zero decides in which direction to brake.
    left = rate + acceleration * abs(acceleration) / (2.0 * jerk)
    sign = -copysign(1.0, left)
    now, needed = sign * acceleration, -sign * rate
    peak = min(most, sqrt(max(0.0, jerk * needed + now * now / 2.0)))
    peak = max(peak, now)
    held = max(0.0, (needed - (2.0 * peak * peak - now * now) / (2.0 * jerk)) / peak) if peak > 0.0 else 0.0
    return ((peak - now) / jerk, held, peak / jerk), (sign * jerk, 0.0, -sign * jerk), acceleration


@kernel
def _distances(
    rate: NDArray[np.float64], acceleration: NDArray[np.float64], most: float, jerk: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the extremes; they are at ends of pieces, or where the rate is zero within one."""
    low, high = np.zeros(rate.shape[0]), np.zeros(rate.shape[0])
    for n in range(rate.shape[0]):
        lengths, jerks, a = _pieces(rate[n], acceleration[n], most, jerk)
        p, v = 0.0, rate[n]
        for piece in range(3):
            length, j = lengths[piece], jerks[piece]
            if length <= 0.0:
                continue
            turns = a * a - 2.0 * j * v
            if turns >= 0.0:
                for side in (-1.0, 1.0):
                    at = -1.0
                    if j != 0.0:
                        at = (-a + side * sqrt(turns)) / j
                    elif a != 0.0:
                        at = -v / a
                    if 0.0 < at < length:
                        there = p + at * (v + at * (a / 2.0 + at * j / 6.0))
                        low[n], high[n] = min(low[n], there), max(high[n], there)
            p += length * (v + length * (a / 2.0 + length * j / 6.0))
            v += length * (a + length * j / 2.0)
            a += length * j
            low[n], high[n] = min(low[n], p), max(high[n], p)
    return low, high
