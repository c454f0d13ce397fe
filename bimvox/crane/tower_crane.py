"""A crane: what it is, in numbers. The motion maths is in ``kinematics``."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

from bimvox.crane.axis_limits import AxisLimits
from bimvox.crane.load_chart import LoadChart
from bimvox.crane.luffing import LuffingJib
from bimvox.crane.working_range import UNLIMITED, SlowZone, WorkingRange
from bimvox.errors import InputError


@dataclass(frozen=True, slots=True)
class Reeving:
    """One way in which the hoist rope is reeved: what it carries, and how fast.

    Attributes:
        falls: Parts of rope that carry the hook (2 or 4).
        chart: Capacity over radius with this reeving: load, rigging and hook block together.
        hook_block_kg: Mass of its hook block.
        trolley_rate_m_s: Highest speed of the trolley with it; None where it is the crane's.
        gears: (mass, rate) pairs, masses ascending: up to that mass on the rope (kg) it hoists at that rate (m/s).
            Above the last one, and where there are none, the crane's own hoist rate holds.

    Raises:
        InputError: If a number makes no sense, or a gear carries more at a higher rate.
    """

    falls: int
    chart: LoadChart
    hook_block_kg: float = 0.0
    trolley_rate_m_s: float | None = None
    gears: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        """Refuse gears that cannot be read."""
        if self.falls < 1:
            raise InputError(f"a reeving of {self.falls} falls", hint="give 1, 2, 4 ...")
        for (less_kg, fast), (more_kg, slow) in pairwise(self.gears):
            if more_kg <= less_kg or slow > fast:
                raise InputError(
                    f"reeving of {self.falls} falls: {slow:g} m/s up to {more_kg:g} kg after {fast:g} m/s up to "
                    f"{less_kg:g} kg",
                    hint="sort the gears by mass; a heavier load is never hoisted faster",
                )


@dataclass(frozen=True, slots=True)
class CranePose:
    """Where the three axes are.

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
    """A crane in the site's frame: a hammerhead unless ``luffing`` says otherwise.

    Attributes:
        name: Name of the machine.
        base_m: (x, y, z) foot of the slewing axis, metres.
        mast_size_m: Edge of the square mast section.
        jib_height_m: Height of the trolley's rope exit above the site's z = 0.
        jib_length_m: Largest hook radius.
        min_radius_m: Smallest hook radius.
        sling_m: Height of the slings: hook above the load's top.
        rigging_mass_kg: Slings and spreader, counted with every load.
        slewing: Limits of the slewing axis, rad.
        trolley: Limits of the trolley, m.
        hoist: Limits of the hoist, m; its rate holds for every mass that no gear is for.
        chart: Capacity over radius: load, rigging and hook block together.
        falls: Parts of rope that carry the hook.
        hook_block_kg: Mass of the hook block; 0 where it is counted with the rigging.
        gears: (mass, rate) pairs as in :class:`Reeving`: how fast up to which mass on the rope.
        max_wind_m_s: Wind speed (gust of 3 s) up to which it works.
        working_range: What its limiters are set to on this site.
        slow_zones: Where it slows down.
        kind: ``hammerhead``, ``luffing`` or ``mobile``.
        luffing: The jib, where it luffs. ``trolley`` and ``hoist`` are then limits on the hook's radius and height that
            keep the luffing axis and the winch within theirs; ``jib_height_m`` is the tip's at the steepest,
            ``jib_length_m`` and ``min_radius_m`` are its radii.
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

    @property
    def highest_hook_m(self) -> float:
        """Highest hook above the site's z = 0, of the machine and its limiter."""
        limit = self.working_range.highest_hook_m
        return self.jib_height_m if limit is None else min(limit, self.jib_height_m)

    @property
    def tackle_kg(self) -> float:
        """Hook block and rigging: what hangs on the rope beside the load, and counts with it."""
        return self.hook_block_kg + self.rigging_mass_kg
