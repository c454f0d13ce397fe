"""Luffing jib: the second axis is the luff angle, and the hoist compensates the height of the tip.

Motions are planned in slew, radius and height of the hook, whatever the machine. For a luffing jib of length L with its
pivot at radius o and height h, radius and luff angle correspond one to one, ``r = o + L cos(phi)``; the rope below the
tip is ``h + L sin(phi) - z``. So luffing uses the winch: the hoist keeps the hook level while the jib moves (level
luffing). The winch's limits are divided in fixed shares, ``HOIST_SHARE`` for hoisting and the rest for luffing, so
that no overlap of the two exceeds the winch.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import inline_kernel
from bimvox.crane.axis_limits import AxisLimits
from bimvox.errors import InputError

HOIST_SHARE = 0.6
"""Share of the winch's rate, acceleration and jerk for hoisting; the rest is for luffing."""


@dataclass(frozen=True, slots=True)
class LuffingJib:
    """A luffing jib, or the boom of a mobile crane.

    Attributes:
        pivot_offset_m: Radius of the pivot, in front of (positive) or behind the slewing axis.
        pivot_height_m: Height of the pivot above the site's z = 0.
        length_m: From the pivot to the rope's exit at the tip.
        luff_rad: Smallest and largest angle to the horizontal.
        limits: Limits of the luffing axis, rad.
        winch: Limits of the hoist winch, m of rope at the hook.
        tail_radius_m: How far the counterweight reaches back from the slewing axis.
        tail_low_m: Height of its underside above the site's z = 0.
        tail_width_m: Its width.
        width_m: Width of the jib.

    Raises:
        InputError: If the luffing range is not valid, or the tip is behind the slewing axis.
    """

    pivot_offset_m: float
    pivot_height_m: float
    length_m: float
    luff_rad: tuple[float, float]
    limits: AxisLimits
    winch: AxisLimits
    tail_radius_m: float
    tail_low_m: float
    tail_width_m: float
    width_m: float

    def __post_init__(self) -> None:
        """Raise an error for an invalid jib."""
        low, high = self.luff_rad
        if not 0.0 < low < high < np.pi / 2.0:
            raise InputError(
                f"luffing range of {low:g} to {high:g} rad",
                hint="give two angles between 0 and pi/2, the smaller first",
            )
        if self.pivot_offset_m + self.length_m * cos(high) <= 0.0:
            raise InputError(
                f"the jib's tip is behind the slewing axis at {high:g} rad", hint="give a smaller largest luff angle"
            )

    @property
    def radii_m(self) -> tuple[float, float]:
        """Smallest and largest radius of the hook."""
        low, high = self.luff_rad
        return self.pivot_offset_m + self.length_m * cos(high), self.pivot_offset_m + self.length_m * cos(low)

    @property
    def highest_tip_m(self) -> float:
        """Height of the tip at the largest angle."""
        return self.pivot_height_m + self.length_m * sin(self.luff_rad[1])


def luff_of_radius(jib: LuffingJib, radius_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the luff angles (rad) for radii of the hook; 0 beyond the jib's length."""
    share = (np.asarray(radius_m, np.float64) - jib.pivot_offset_m) / jib.length_m
    angle: NDArray[np.float64] = np.arccos(np.clip(share, -1.0, 1.0))
    return angle


def radius_of_luff(jib: LuffingJib, luff_rad: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the radii of the hook at luff angles."""
    radius: NDArray[np.float64] = jib.pivot_offset_m + jib.length_m * np.cos(luff_rad)
    return radius


def tip_height_m(jib: LuffingJib, radius_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the height of the tip above the site's z = 0 with the hook at radii."""
    far_m = np.asarray(radius_m, np.float64) - jib.pivot_offset_m
    height: NDArray[np.float64] = jib.pivot_height_m + np.sqrt(np.maximum(jib.length_m**2 - far_m * far_m, 0.0))
    return height


def radius_limits(jib: LuffingJib, winch: AxisLimits, nearest_m: float, furthest_m: float) -> AxisLimits:
    """Return limits of the radius that keep the luffing axis and the winch's luffing share within their limits.

    With x = r - o and s = sqrt(L^2 - x^2): phi' = -x'/s, phi'' = -x''/s - x x'^2/s^3 and so on, and the tip's height
    T = h + s likewise. Each derivative's limit is split evenly over its terms, at the worst radius in the range.

    Args:
        jib: The jib.
        winch: Limits of the winch in its gear.
        nearest_m: Smallest radius of the motion.
        furthest_m: Largest radius.
    """
    return AxisLimits(*luffing_limits(luffing_numbers(jib, winch), nearest_m, furthest_m))


class LuffingNumbers(NamedTuple):
    """What the limits of the radius follow from, as kernels take it.

    Attributes:
        pivot_offset_m: Radius of the pivot.
        length_m: Length of the jib.
        flattest_m: Reach of the jib in front of its pivot at the smallest luff angle.
        luff: Rate, acceleration and jerk of the luffing axis, rad.
        rope: The same of the winch's share for luffing, m of rope.
    """

    pivot_offset_m: float
    length_m: float
    flattest_m: float
    luff: tuple[float, float, float]
    rope: tuple[float, float, float]


def luffing_numbers(jib: LuffingJib, winch: AxisLimits) -> LuffingNumbers:
    """Return the numbers of a jib with its winch in its gear."""
    luff, left = jib.limits, 1.0 - HOIST_SHARE
    return LuffingNumbers(
        jib.pivot_offset_m,
        jib.length_m,
        jib.length_m * cos(jib.luff_rad[0]),
        (luff.rate, luff.acceleration, luff.jerk),
        (left * winch.rate, left * winch.acceleration, left * winch.jerk),
    )


@inline_kernel
def luffing_limits(jib: LuffingNumbers, nearest_m: float, furthest_m: float) -> tuple[float, float, float]:
    """Return what ``radius_limits`` does: rate, acceleration and jerk."""
    far, length = furthest_m - jib.pivot_offset_m, jib.length_m
    x = max(abs(far), abs(nearest_m - jib.pivot_offset_m), 1e-3)
    x = min(x, jib.flattest_m)
    s = sqrt(length * length - x * x)
    luff_rate, luff_acceleration, luff_jerk = jib.luff
    rope_rate, rope_acceleration, rope_jerk = jib.rope
    rate = min(
        luff_rate * s,
        rope_rate * s / x,
        sqrt(luff_acceleration * s**3 / (2.0 * x)),
        sqrt(rope_acceleration * s**3 / (2.0 * length**2)),
        np.cbrt(luff_jerk / (3.0 * (1.0 / s**3 + 3.0 * x * x / s**5))),
        np.cbrt(rope_jerk * s**5 / (9.0 * length**2 * x)),
    )
    acceleration = min(
        luff_acceleration * s / 2.0,
        rope_acceleration * s / (2.0 * x),
        luff_jerk * s**3 / (9.0 * x * rate),
        rope_jerk * s**3 / (9.0 * length**2 * rate),
    )
    return rate, acceleration, min(luff_jerk * s / 3.0, rope_jerk * s / (3.0 * x))


def hook_limits(winch: AxisLimits) -> AxisLimits:
    """Return the limits of the hook's height: the winch's share for hoisting."""
    return AxisLimits(HOIST_SHARE * winch.rate, HOIST_SHARE * winch.acceleration, HOIST_SHARE * winch.jerk)
