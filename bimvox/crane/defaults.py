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
from bimvox.crane.tower_crane import Reeving, TowerCrane

_PER_MIN = 1.0 / 60.0

SLEWING = AxisLimits(rate=0.8 * 2.0 * pi * _PER_MIN, acceleration=0.3 * pi / 180.0, jerk=0.3 * pi / 180.0)
"""0.8 rpm; 0.3 deg/s^2, built up within one second: braking from full rate takes 17 s and 41 degrees."""

_TROLLEY = {falls: AxisLimits(rate * _PER_MIN, 0.25, 0.25) for falls, rate in ((2, 76.0), (4, 38.0))}
_HOIST_MEDIUM = AxisLimits(rate=43.0 * _PER_MIN, acceleration=0.3, jerk=0.3)
_HOIST_HEAVY = AxisLimits(rate=27.0 * _PER_MIN, acceleration=0.3, jerk=0.3)

HOOK_BLOCK_M = 2.0
"""Room between the highest hook and the rope exit: hook block and limit switch."""


def _reeving(falls: int, hook_block_kg: float, gears: tuple[tuple[float, float], ...], chart: LoadChart) -> Reeving:
    """Return a reeving from gears in (kg, m/min)."""
    rates = tuple((most_kg, round(rate * _PER_MIN, 4)) for most_kg, rate in gears)
    return Reeving(falls, chart, hook_block_kg, _TROLLEY[falls].rate, rates)


DEFAULT_REEVINGS: dict[str, tuple[Reeving, ...]] = {
    "hammerhead-30": (
        _reeving(2, 150.0, ((1250.0, 100.0), (2500.0, 67.0), (5000.0, 43.0)), LoadChart(
            (16.5, 17.5, 20.0, 22.5, 25.0, 27.5, 30.0),
            (5000.0, 4700.0, 4100.0, 3600.0, 3200.0, 2850.0, 2600.0),
        )),
    ),
    "hammerhead-45": (
        _reeving(2, 180.0, ((2000.0, 100.0), (4000.0, 67.0), (8000.0, 43.0)), LoadChart(
            (15.0, 20.0, 25.0, 30.0, 35.0, 40.0, 45.0),
            (8000.0, 6000.0, 4700.0, 3800.0, 3200.0, 2750.0, 2350.0),
        )),
    ),
    "hammerhead-65": (
        _reeving(4, 250.0, ((5000.0, 67.0), (8400.0, 43.0), (10000.0, 27.0)), LoadChart(
            (17.5, 20.0, 25.0, 30.0, 35.0, 40.0, 45.0, 50.0, 55.0, 60.0, 65.0),
            (10000.0, 8600.0, 6750.0, 5450.0, 4550.0, 3900.0, 3350.0, 2950.0, 2600.0, 2300.0, 2100.0),
        )),
        _reeving(2, 150.0, ((2500.0, 134.0), (4200.0, 86.0), (5000.0, 54.0)), LoadChart(
            (32.0, 35.0, 40.0, 45.0, 50.0, 55.0, 60.0, 65.0),
            (5000.0, 4650.0, 4000.0, 3450.0, 3050.0, 2700.0, 2400.0, 2200.0),
        )),
    ),
    "hammerhead-75": (
        _reeving(4, 500.0, ((8400.0, 43.0), (12500.0, 27.0), (20000.0, 17.0)), LoadChart(
            (19.0, 20.0, 25.0, 30.0, 35.0, 40.0, 45.0, 50.0, 55.0, 60.0, 65.0, 70.0, 75.0),
            (
                20000.0, 19400.0, 15200.0, 12400.0, 10400.0, 8900.0, 7700.0, 6800.0, 6000.0, 5400.0, 4850.0, 4400.0,
                4000.0,
            ),
        )),
        _reeving(2, 300.0, ((4200.0, 86.0), (6250.0, 54.0), (10000.0, 34.0)), LoadChart(
            (36.0, 40.0, 45.0, 50.0, 55.0, 60.0, 65.0, 70.0, 75.0),
            (10000.0, 9100.0, 7900.0, 7000.0, 6200.0, 5600.0, 5050.0, 4600.0, 4200.0),
        )),
    ),
}  # fmt: skip
"""All reevings of each machine, the one that carries most first."""


def _crane(name: str, lengths_m: tuple[float, ...], rigging_mass_kg: float, hoist: AxisLimits) -> TowerCrane:
    """Return a machine with its first reeving; ``lengths_m`` are those of ``TowerCrane``, in its order."""
    mast_size_m, jib_height_m, jib_length_m, min_radius_m, sling_m = lengths_m
    reeving = DEFAULT_REEVINGS[name][0]
    return TowerCrane(
        name=name,
        base_m=(0.0, 0.0, 0.0),
        mast_size_m=mast_size_m,
        jib_height_m=jib_height_m,
        jib_length_m=jib_length_m,
        min_radius_m=min_radius_m,
        sling_m=sling_m,
        rigging_mass_kg=rigging_mass_kg,
        slewing=SLEWING,
        trolley=_TROLLEY[reeving.falls],
        hoist=hoist,
        chart=reeving.chart,
        falls=reeving.falls,
        hook_block_kg=reeving.hook_block_kg,
        gears=reeving.gears,
    )


DEFAULT_CRANES: tuple[TowerCrane, ...] = (
    _crane("hammerhead-30", (1.2, 25.0, 30.0, 2.5, 2.5), 100.0, _HOIST_MEDIUM),
    _crane("hammerhead-45", (1.6, 35.0, 45.0, 2.8, 3.0), 120.0, _HOIST_MEDIUM),
    _crane("hammerhead-65", (2.0, 45.0, 65.0, 3.2, 3.0), 200.0, _HOIST_MEDIUM),
    _crane("hammerhead-75", (2.45, 60.0, 75.0, 3.6, 3.5), 400.0, _HOIST_HEAVY),
)
"""Ascending by size, each with the reeving that carries most."""
