"""The data of a crane: trolley or luffing jib, limits of axes, limiters. Its motion is computed in ``kinematics``."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from math import cos, pi, sin, sqrt
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import inline_kernel
from bimvox.crane.auxiliary import Auxiliary
from bimvox.crane.carrier import Carrier, Stand
from bimvox.crane.load_chart import LoadChart
from bimvox.errors import InputError
from bimvox.sparse import SPARSE


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


@dataclass(frozen=True, slots=True)
class Override:
    """One value of a crane that is not the machine's.

    Attributes:
        key: Key of the site file: ``chart``.
        name: The same in words: ``hook block``.
        catalogue: The machine's value, with its unit.
        site: The site's value, with its unit.
        change: Difference in percent: ``+12 %``; empty if there is none to give.
    """

    key: str
    name: str
    catalogue: str
    site: str
    change: str = ""

    def __str__(self) -> str:
        return f"{self.name} {self.site} instead of {self.catalogue}" + (f" ({self.change})" if self.change else "")

    def to_dict(self) -> dict[str, str]:
        """Return it for JSON documents."""
        return {"key": self.key, "catalogue": self.catalogue, "site": self.site}


# Luffing jib: the second axis is the luff angle, and the hoist compensates the height of the tip.
#
# Motions are planned in slew, radius and height of the hook, whatever the machine. For a luffing jib of length L with
# its pivot at radius o and height h, radius and luff angle correspond one to one, ``r = o + L cos(phi)``; the rope
# below the tip is ``h + L sin(phi) - z``. So luffing uses the winch: the hoist keeps the hook level while the jib moves
# (level luffing). The winch's limits are divided in fixed shares, ``HOIST_SHARE`` for hoisting and the rest for
# luffing, so that no overlap of the two exceeds the winch.

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


# Settings of the crane's limiters on a site: working range and slow zones.
#
# A hook column is within the range if its whole cell is, so the hook never leaves the range between two columns.

_ROUNDING_RAD = 1e-9
"""A full turn from an angle to that angle plus 2 pi may differ from 2 pi by rounding."""


@dataclass(frozen=True, slots=True)
class WorkingRange:
    """Working area limitation of the hook (EN 17076).

    Attributes:
        slew_rad: First and last slew angle, counter-clockwise; None: the full circle.
        radius_m: Smallest and largest radius; None: the machine's.
        highest_hook_m: Highest hook above the site's z = 0; None: the machine's.

    Raises:
        InputError: If a range is empty.
    """

    slew_rad: tuple[float, float] | None = None
    radius_m: tuple[float, float] | None = None
    highest_hook_m: float | None = None

    def __post_init__(self) -> None:
        """Raise an error for an empty range."""
        if self.slew_rad is not None and not 0.0 < self.slew_rad[1] - self.slew_rad[0] <= 2.0 * pi + _ROUNDING_RAD:
            raise InputError(
                f"slewing range from {self.slew_rad[0]:g} to {self.slew_rad[1]:g} rad",
                hint="it goes counter-clockwise from the first angle to the second, at most one full turn",
            )
        if self.radius_m is not None and not 0.0 <= self.radius_m[0] < self.radius_m[1]:
            raise InputError(
                f"radius range from {self.radius_m[0]:g} to {self.radius_m[1]:g} m",
                hint="give the smallest radius, then the largest",
            )


UNLIMITED = WorkingRange()
"""No limiters."""


@dataclass(frozen=True, slots=True)
class SlowZone:
    """An area over which all axes are slower.

    Attributes:
        polygon: (x, y) corners, site metres.
        share: Share of the axes' highest rates, 0..1.
    """

    polygon: tuple[tuple[float, float], ...]
    share: float


def columns_in_range(
    given: WorkingRange,
    base_m: tuple[float, float, float],
    origin_m: tuple[float, float, float],
    voxel_size_m: float,
    shape: tuple[int, int],
) -> NDArray[np.bool_]:
    """Return the (X, Y) columns that are within the range of slew and radius at all of their points.

    They are if their four corners are, unless a sector without slewing, narrower than a column, lies between these.

    Args:
        given: The range.
        base_m: Foot of the slewing axis.
        origin_m: Lowest corner of the grid.
        voxel_size_m: Edge of a cell.
        shape: Number of columns.
    """
    x = origin_m[0] - base_m[0] + voxel_size_m * np.arange(shape[0] + 1)
    y = origin_m[1] - base_m[1] + voxel_size_m * np.arange(shape[1] + 1)
    dx, dy = np.meshgrid(x, y, indexing="ij")
    good = np.ones((shape[0] + 1, shape[1] + 1), np.bool_)
    if given.radius_m is not None:
        radius = np.hypot(dx, dy)
        good &= (radius >= given.radius_m[0] - 1e-9) & (radius <= given.radius_m[1] + 1e-9)
    if given.slew_rad is not None:
        low, high = given.slew_rad
        good &= np.remainder(np.arctan2(dy, dx) - low + 1e-9, 2.0 * pi) <= high - low + 2e-9
    every: NDArray[np.bool_] = np.logical_and.reduce(_corners(good))
    if given.slew_rad is not None and given.slew_rad[1] - given.slew_rad[0] < 2.0 * pi - _ROUNDING_RAD:
        for angle in given.slew_rad:
            aside, ahead = _corners(dx * sin(angle) - dy * cos(angle)), _corners(dx * cos(angle) + dy * sin(angle))
            every &= ~((aside.min(axis=0) < -1e-9) & (aside.max(axis=0) > 1e-9) & (ahead.max(axis=0) > 0.0))
    return every


def _corners(of: NDArray[Any]) -> NDArray[Any]:
    """Return (4, X, Y) the values at the corners of each column."""
    return np.stack([of[:-1, :-1], of[1:, :-1], of[:-1, 1:], of[1:, 1:]])


@dataclass(frozen=True, slots=True)
class Reeving:
    """One reeving of the hoist rope: its capacity and its speeds.

    Attributes:
        falls: Parts of rope that carry the hook (2 or 4).
        chart: Capacity over radius with this reeving: load, rigging and hook block together.
        hook_block_kg: Mass of its hook block.
        trolley_rate_m_s: Highest speed of the trolley with it; None for the crane's own.
        gears: (mass, rate) pairs, masses ascending: up to that mass on the rope (kg) it hoists at that rate (m/s).
            Above the last one, and without gears, the crane's own hoist rate applies.

    Raises:
        InputError: If there are no falls, or if a gear carries more at a higher rate.
    """

    falls: int
    chart: LoadChart
    hook_block_kg: float = 0.0
    trolley_rate_m_s: float | None = None
    gears: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        """Raise an error for an invalid reeving."""
        if self.falls < 1:
            raise InputError(f"reeving of {self.falls} falls", hint="give 1, 2, 4 ...")
        for (less_kg, fast), (more_kg, slow) in pairwise(self.gears):
            if more_kg <= less_kg or slow > fast:
                raise InputError(
                    f"reeving of {self.falls} falls: {slow:g} m/s up to {more_kg:g} kg after {fast:g} m/s up to "
                    f"{less_kg:g} kg",
                    hint="sort the gears by mass; a heavier load is never hoisted faster",
                )


@dataclass(frozen=True, slots=True)
class CranePose:
    """Positions of the three axes.

    Attributes:
        slew_rad: Angle of the jib from the site's +x axis, counter-clockwise.
        radius_m: Distance of the hook from the slewing axis (trolley position).
        height_m: Height of the hook above the site's z = 0.
    """

    slew_rad: float
    radius_m: float
    height_m: float


@dataclass(frozen=True, slots=True)
class TowerCrane:
    """A crane in the site frame: a hammerhead, or a luffing crane if it has ``luffing``.

    Attributes:
        name: Name of the machine.
        base_m: (x, y, z) foot of the slewing axis, metres.
        mast_size_m: Edge of the square mast section.
        jib_height_m: Height of the trolley's rope exit above the site's z = 0.
        jib_length_m: Largest hook radius.
        min_radius_m: Smallest hook radius.
        sling_m: Height of the slings: hook above the load's top.
        rigging_mass_kg: Mass of slings and spreader, added to every load.
        slewing: Limits of the slewing axis, rad.
        trolley: Limits of the trolley, m.
        hoist: Limits of the hoist, m; its rate applies to masses above all gears.
        chart: Capacity over radius: load, rigging and hook block together.
        falls: Parts of rope that carry the hook.
        hook_block_kg: Mass of the hook block; 0 if it is part of the rigging mass.
        gears: (mass, rate) pairs as in :class:`Reeving`.
        max_wind_m_s: Wind speed (gust of 3 s) up to which it works.
        working_range: Settings of its limiters on this site.
        slow_zones: Areas in which it slows down.
        kind: ``hammerhead``, ``luffing`` or ``mobile``.
        luffing: The luffing jib; None for a hammerhead. With it, ``trolley`` and ``hoist`` are limits of the hook's
            radius and height that keep the luffing axis and the winch within their limits. ``jib_height_m`` is the
            highest tip; ``jib_length_m`` and ``min_radius_m`` are the jib's radii.
        machine: Name of the machine, if ``name`` is the site's own; empty if ``name`` is the machine's.
        overrides: What the site file changes in the machine.
        foundation_m2: Area of the foundation of a tower crane, a square; None if nobody states it.
        carrier: How a mobile crane is set up; None if its machine file describes neither outriggers nor sectors. With
            sectors, ``chart`` holds in every direction in which a load may hang.
        stand: How a tower crane stands; None if its machine file does not say.
        auxiliary: Its second hook; None: it has none, or no part of the site is turned over with it.
    """

    name: str
    base_m: tuple[float, float, float]
    mast_size_m: float
    jib_height_m: float
    jib_length_m: float
    min_radius_m: float
    sling_m: float
    rigging_mass_kg: float
    slewing: AxisLimits
    trolley: AxisLimits
    hoist: AxisLimits
    chart: LoadChart
    falls: int = 2
    hook_block_kg: float = 0.0
    gears: tuple[tuple[float, float], ...] = ()
    max_wind_m_s: float = 20.0
    working_range: WorkingRange = UNLIMITED
    slow_zones: tuple[SlowZone, ...] = ()
    kind: str = "hammerhead"
    luffing: LuffingJib | None = None
    machine: str = field(default="", metadata=SPARSE)
    overrides: tuple[Override, ...] = field(default=(), metadata=SPARSE)
    foundation_m2: float | None = field(default=None, metadata=SPARSE)
    carrier: Carrier | None = field(default=None, metadata=SPARSE)
    stand: Stand | None = field(default=None, metadata=SPARSE)
    auxiliary: Auxiliary | None = field(default=None, metadata=SPARSE)

    @property
    def highest_hook_m(self) -> float:
        """Highest hook above the site's z = 0, by the machine and its limiter."""
        limit = self.working_range.highest_hook_m
        return self.jib_height_m if limit is None else min(limit, self.jib_height_m)

    @property
    def jib_own_m(self) -> float:
        """Length of the jib itself; of a luffing one from its pivot."""
        return self.jib_length_m if self.luffing is None else self.luffing.length_m

    @property
    def tackle_kg(self) -> float:
        """Mass of hook block and rigging, which hang on the rope in addition to the load, with the second hook's block.

        The second one hangs from the same boom in every lift, so the load chart carries it too.
        """
        return self.hook_block_kg + self.rigging_mass_kg + self.second_block_kg

    @property
    def second_block_kg(self) -> float:
        """Mass of the auxiliary hook's block; 0 if none is fitted."""
        return self.auxiliary.hook_block_kg if self.auxiliary is not None and self.auxiliary.fitted else 0.0
