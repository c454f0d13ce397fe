"""How an axis brakes from any state, worked out from its limits alone.

The axis stops as fast as its limits on acceleration and jerk allow: the deceleration grows to a peak, holds, and fades
to nothing. The peak is found by bisection: the highest, up to the limit, at which the braking does not take away more
rate than there is. Position is the acceleration's trapezium integrated twice, exactly from corner to corner.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.crane.axis_limits import AxisLimits

_HALVINGS = 60


def braked(
    position: float, rate: float, acceleration: float, limits: AxisLimits, time_s: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return (N,) where an axis is at times after its brakes take hold; at rest it stays where it is.

    Args:
        position: Where it is at time 0, in the axis's unit.
        rate: Its rate then, unit/s.
        acceleration: Its acceleration then, unit/s^2; one beyond the limit counts as the limit.
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
    # The rate that remains if the acceleration fades at once gives the direction to brake in.
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
    """The rate that is left after braking with a peak that is not held: rise of the deceleration, then its fade."""
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
    """Positions at ascending times under an acceleration that is straight between corners, constant after the last."""
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
