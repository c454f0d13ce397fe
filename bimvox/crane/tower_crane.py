"""A hammerhead tower crane: what it is, in numbers. The motion maths is in ``kinematics``."""

from __future__ import annotations

from dataclasses import dataclass

from bimvox.errors import InputError


@dataclass(frozen=True, slots=True)
class AxisLimits:
    """Limits of one axis, in the axis's unit (rad or m) and seconds.

    Attributes:
        rate: Highest speed, unit/s.
        acceleration: Highest acceleration, unit/s^2.
        jerk: Highest change of acceleration, unit/s^3.
    """

    rate: float
    acceleration: float
    jerk: float


@dataclass(frozen=True, slots=True)
class LoadChart:
    """Capacity over radius, as data sheets give it.

    Attributes:
        radius_m: Radii, ascending.
        capacity_kg: Capacity at each radius (load and rigging together), descending.

    Raises:
        InputError: If it is empty, its lists differ in length, a number is not positive and finite, the radii do not
            ascend, or the capacity grows with the radius.
    """

    radius_m: tuple[float, ...]
    capacity_kg: tuple[float, ...]

    def __post_init__(self) -> None:
        """Refuse a chart that cannot be read."""
        if len(self.radius_m) != len(self.capacity_kg) or not self.radius_m:
            raise InputError(
                f"a load chart with {len(self.radius_m)} radii and {len(self.capacity_kg)} capacities",
                hint="give one capacity per radius, at least one pair",
            )
        for name, values in (("radius_m", self.radius_m), ("capacity_kg", self.capacity_kg)):
            bad = [value for value in values if not 0.0 < value < float("inf")]
            if bad:
                raise InputError(f"load chart: {name} holds {bad[0]:g}", hint="every value must be positive and finite")
        for i in range(1, len(self.radius_m)):
            if self.radius_m[i] <= self.radius_m[i - 1]:
                raise InputError(f"load chart: radius {self.radius_m[i]:g} m does not ascend", hint="sort it by radius")
            if self.capacity_kg[i] > self.capacity_kg[i - 1]:
                raise InputError(
                    f"load chart: capacity grows to {self.capacity_kg[i]:g} kg at {self.radius_m[i]:g} m",
                    hint="capacity cannot grow with the radius; check the pairs",
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
    """A hammerhead tower crane in the site's frame.

    Attributes:
        name: Name of the machine.
        base_m: (x, y, z) foot of the slewing axis, metres.
        mast_size_m: Edge of the square mast section.
        jib_height_m: Height of the trolley's rope exit above the site's z = 0.
        jib_length_m: Largest hook radius.
        min_radius_m: Smallest hook radius.
        sling_m: Height of the slings: hook above the load's top.
        rigging_mass_kg: Hook block, slings and spreader, counted with every load.
        slewing: Limits of the slewing axis, rad.
        trolley: Limits of the trolley, m.
        hoist: Limits of the hoist, m.
        chart: Capacity over radius.
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
