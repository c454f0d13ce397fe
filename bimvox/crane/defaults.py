"""Default machines: four hammerhead tower cranes with typical rates and load charts.

They are not products of a manufacturer. The rates are typical of data sheets of that size (hoist 43 m/min up to about
8 t, 27 m/min up to about 12 t, 67 m/min up to 5 t; trolley 76 m/min on two falls, 38 m/min on four; slewing 0.8 rpm).
The charts follow a constant tipping moment, rounded down to 50 kg. The two large cranes can also be reeved with two
falls: half the load, twice as fast (``DEFAULT_REEVINGS``). Replace them with the real machine's data in the site file.
"""

from __future__ import annotations

from math import pi

from bimvox.crane.axis_limits import AxisLimits
from bimvox.crane.load_chart import LoadChart
from bimvox.crane.rigging import reeving_of
from bimvox.crane.tower_crane import Reeving, TowerCrane

_PER_MIN = 1.0 / 60.0

SLEWING = AxisLimits(rate=0.8 * 2.0 * pi * _PER_MIN, acceleration=0.3 * pi / 180.0, jerk=0.3 * pi / 180.0)
"""0.8 rpm; 0.3 deg/s^2, built up within one second: braking from full rate takes 17 s and 41 degrees."""

TROLLEY_2_FALLS = AxisLimits(rate=76.0 * _PER_MIN, acceleration=0.25, jerk=0.25)
TROLLEY_4_FALLS = AxisLimits(rate=38.0 * _PER_MIN, acceleration=0.25, jerk=0.25)
HOIST_MEDIUM = AxisLimits(rate=43.0 * _PER_MIN, acceleration=0.3, jerk=0.3)
HOIST_HEAVY = AxisLimits(rate=27.0 * _PER_MIN, acceleration=0.3, jerk=0.3)

HOOK_BLOCK_M = 2.0
"""Room between the highest hook and the rope exit: hook block and limit switch."""


def _gears(*pairs: tuple[float, float]) -> tuple[tuple[float, float], ...]:
    """Return gears in (kg, m/s) from (kg, m/min)."""
    return tuple((most_kg, round(rate * _PER_MIN, 4)) for most_kg, rate in pairs)


DEFAULT_CRANES: tuple[TowerCrane, ...] = (
    TowerCrane(
        name="hammerhead-30",
        base_m=(0.0, 0.0, 0.0),
        mast_size_m=1.2,
        jib_height_m=25.0,
        jib_length_m=30.0,
        min_radius_m=2.5,
        sling_m=2.5,
        rigging_mass_kg=100.0,
        hook_block_kg=150.0,
        falls=2,
        gears=_gears((1250.0, 100.0), (2500.0, 67.0), (5000.0, 43.0)),
        slewing=SLEWING,
        trolley=TROLLEY_2_FALLS,
        hoist=HOIST_MEDIUM,
        chart=LoadChart(
            (16.5, 17.5, 20.0, 22.5, 25.0, 27.5, 30.0),
            (5000.0, 4700.0, 4100.0, 3600.0, 3200.0, 2850.0, 2600.0),
        ),
    ),
    TowerCrane(
        name="hammerhead-45",
        base_m=(0.0, 0.0, 0.0),
        mast_size_m=1.6,
        jib_height_m=35.0,
        jib_length_m=45.0,
        min_radius_m=2.8,
        sling_m=3.0,
        rigging_mass_kg=120.0,
        hook_block_kg=180.0,
        falls=2,
        gears=_gears((2000.0, 100.0), (4000.0, 67.0), (8000.0, 43.0)),
        slewing=SLEWING,
        trolley=TROLLEY_2_FALLS,
        hoist=HOIST_MEDIUM,
        chart=LoadChart(
            (15.0, 20.0, 25.0, 30.0, 35.0, 40.0, 45.0),
            (8000.0, 6000.0, 4700.0, 3800.0, 3200.0, 2750.0, 2350.0),
        ),
    ),
    TowerCrane(
        name="hammerhead-65",
        base_m=(0.0, 0.0, 0.0),
        mast_size_m=2.0,
        jib_height_m=45.0,
        jib_length_m=65.0,
        min_radius_m=3.2,
        sling_m=3.0,
        rigging_mass_kg=200.0,
        hook_block_kg=250.0,
        falls=4,
        gears=_gears((5000.0, 67.0), (8400.0, 43.0), (10000.0, 27.0)),
        slewing=SLEWING,
        trolley=TROLLEY_4_FALLS,
        hoist=HOIST_MEDIUM,
        chart=LoadChart(
            (17.5, 20.0, 25.0, 30.0, 35.0, 40.0, 45.0, 50.0, 55.0, 60.0, 65.0),
            (10000.0, 8600.0, 6750.0, 5450.0, 4550.0, 3900.0, 3350.0, 2950.0, 2600.0, 2300.0, 2100.0),
        ),
    ),
    TowerCrane(
        name="hammerhead-75",
        base_m=(0.0, 0.0, 0.0),
        mast_size_m=2.45,
        jib_height_m=60.0,
        jib_length_m=75.0,
        min_radius_m=3.6,
        sling_m=3.5,
        rigging_mass_kg=400.0,
        hook_block_kg=500.0,
        falls=4,
        gears=_gears((8400.0, 43.0), (12500.0, 27.0), (20000.0, 17.0)),
        slewing=SLEWING,
        trolley=TROLLEY_4_FALLS,
        hoist=HOIST_HEAVY,
        chart=LoadChart(
            (19.0, 20.0, 25.0, 30.0, 35.0, 40.0, 45.0, 50.0, 55.0, 60.0, 65.0, 70.0, 75.0),
            (
                20000.0,
                19400.0,
                15200.0,
                12400.0,
                10400.0,
                8900.0,
                7700.0,
                6800.0,
                6000.0,
                5400.0,
                4850.0,
                4400.0,
                4000.0,
            ),
        ),
    ),
)
"""Ascending by size, each with the reeving that carries most."""

_TWO_FALLS: dict[str, Reeving] = {
    "hammerhead-65": Reeving(
        falls=2,
        chart=LoadChart(
            (32.0, 35.0, 40.0, 45.0, 50.0, 55.0, 60.0, 65.0),
            (5000.0, 4650.0, 4000.0, 3450.0, 3050.0, 2700.0, 2400.0, 2200.0),
        ),
        hook_block_kg=150.0,
        trolley_rate_m_s=TROLLEY_2_FALLS.rate,
        gears=_gears((2500.0, 134.0), (4200.0, 86.0), (5000.0, 54.0)),
    ),
    "hammerhead-75": Reeving(
        falls=2,
        chart=LoadChart(
            (36.0, 40.0, 45.0, 50.0, 55.0, 60.0, 65.0, 70.0, 75.0),
            (10000.0, 9100.0, 7900.0, 7000.0, 6200.0, 5600.0, 5050.0, 4600.0, 4200.0),
        ),
        hook_block_kg=300.0,
        trolley_rate_m_s=TROLLEY_2_FALLS.rate,
        gears=_gears((4200.0, 86.0), (6250.0, 54.0), (10000.0, 34.0)),
    ),
}

DEFAULT_REEVINGS: dict[str, tuple[Reeving, ...]] = {
    crane.name: (reeving_of(crane), *((_TWO_FALLS[crane.name],) if crane.name in _TWO_FALLS else ()))
    for crane in DEFAULT_CRANES
}
"""Per machine all its reevings, the one that carries most first."""
