"""The data of a crane. Its motion is computed in ``kinematics``."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

from bimvox.crane.axis_limits import AxisLimits
from bimvox.crane.load_chart import LoadChart
from bimvox.crane.luffing import LuffingJib
from bimvox.crane.override import Override
from bimvox.crane.working_range import UNLIMITED, SlowZone, WorkingRange
from bimvox.errors import InputError
from bimvox.sparse import SPARSE


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
        """Mass of hook block and rigging, which hang on the rope in addition to the load."""
        return self.hook_block_kg + self.rigging_mass_kg
