"""Speed, acceleration and jerk limits of one axis."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class AxisLimits:
    """Limits of one axis, in the axis's unit (rad or m) and seconds.

    Attributes:
        rate: Highest speed, unit/s.
        acceleration: Highest acceleration, unit/s^2.
        jerk: Highest rate of change of the acceleration, unit/s^3.
    """

    rate: float
    acceleration: float
    jerk: float
