"""How an axis brakes from any state, computed from its limits alone.

The axis stops as fast as its limits on acceleration and jerk allow: the deceleration grows to a peak, holds, and fades
to zero. Bisection finds the peak: the highest, up to the limit, at which the braking does not reverse the rate. The
position is the acceleration's trapezium integrated twice, exactly from corner to corner.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.crane.tower_crane import AxisLimits

_HALVINGS = 60


def braked(
    position: float, rate: float, acceleration: float, limits: AxisLimits, time_s: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return (N,) the position of an axis at times after braking starts; at rest it stays in place.

    Args:
        position: Position at time 0, in the axis's unit.
        rate: Rate at time 0, unit/s.
        acceleration: Acceleration at time 0, unit/s^2; clipped to the limit.
        limits: The axis's limits.
        time_s: (N,) ascending, 0 or later.
    """
    most, jerk = limits.acceleration, limits.jerk
    acceleration = float(np.clip(acceleration, -most, most))
    corner_s, corner_a = _trapezium(rate, acceleration, most, jerk)
    return np.asarray(_integrated(position, rate, corner_s, corner_a, np.asarray(time_s, np.float64)), np.float64)


def braking_time_s(rate: float, acceleration: float, limits: AxisLimits) -> float:
    """Return how long an axis takes to stop; arguments as for :func:`braked`."""
    acceleration = float(np.clip(acceleration, -limits.acceleration, limits.acceleration))
    return float(_trapezium(rate, acceleration, limits.acceleration, limits.jerk)[0][-1])


@kernel
def _trapezium(
    rate: float, acceleration: float, most: float, jerk: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Corners of the acceleration over time: (4,) seconds and (4,) values, the last one 0."""
    # The rate that remains if the acceleration fades at once determines the braking direction.
    way = 1.0 if rate + acceleration * abs(acceleration) / (2.0 * jerk) >= 0.0 else -1.0
    v, a = way * rate, way * acceleration
    low, high = max(0.0, -a), most
    if _remains(v, a, high, jerk) < 0.0:
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            if _remains(v, a, middle, jerk) < 0.0:
                high = middle
            else:
                low = middle
        peak = 0.5 * (low + high)
    else:
        peak = high
    held = max(_remains(v, a, peak, jerk), 0.0) / peak if peak > 0.0 else 0.0
    seconds, values = np.zeros(4), np.zeros(4)
    seconds[1] = (a + peak) / jerk
    seconds[2] = seconds[1] + held
    seconds[3] = seconds[2] + peak / jerk
    values[0], values[1], values[2] = acceleration, -way * peak, -way * peak
    return seconds, values


@kernel
def _remains(rate: float, acceleration: float, peak: float, jerk: float) -> float:
    """Return the remaining rate if the deceleration rises to a peak and fades without being held."""
    rising_s, fading_s = (acceleration + peak) / jerk, peak / jerk
    return rate + 0.5 * (acceleration - peak) * rising_s - 0.5 * peak * fading_s


@kernel
def _integrated(
    position: float,
    rate: float,
    corner_s: NDArray[np.float64],
    corner_a: NDArray[np.float64],
    time_s: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return positions at ascending times for an acceleration that is linear between corners, then constant."""
    reached = np.empty(time_s.shape[0])
    at, v, p = 0, rate, position
    for n in range(time_s.shape[0]):
        while at < 3 and corner_s[at + 1] <= time_s[n]:
            span = corner_s[at + 1] - corner_s[at]
            p += v * span + (2.0 * corner_a[at] + corner_a[at + 1]) * span * span / 6.0
            v += 0.5 * (corner_a[at] + corner_a[at + 1]) * span
            at += 1
        reached[n] = p
        if at < 3:
            since = time_s[n] - corner_s[at]
            slope = (corner_a[at + 1] - corner_a[at]) / (corner_s[at + 1] - corner_s[at])
            reached[n] = p + since * (v + since * (0.5 * corner_a[at] + since * slope / 6.0))
    return reached
