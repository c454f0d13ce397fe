"""Default luffing machines: two tower cranes and two mobile cranes on a fixed pad, with typical rates and load charts.

They are not products of a manufacturer. Tower cranes: full luffing range in about two minutes, winch 60 m/min up to
half the largest load, slewing 0.8 rpm. Mobile cranes: boom up in about a minute, slewing 1.5 rpm, winch 30 m/min at the
hook on four falls, wind up to 9 m/s as in their charts. Charts follow a constant tipping moment up to the winch's
limit. A mobile crane's chart is for full counterweight on fully extended outriggers, over 360 degrees.
"""

from __future__ import annotations

from math import pi, radians

from bimvox.crane.axis_limits import AxisLimits
from bimvox.crane.load_chart import LoadChart
from bimvox.crane.luffing import LuffingJib
from bimvox.crane.rigging import with_luffing_jib
from bimvox.crane.tower_crane import Reeving, TowerCrane

_ANY = AxisLimits(1.0, 1.0, 1.0)  # follows from the jib

# Slewing rate, rpm, and the wind speed up to which a machine works, m/s.
_RPM_AND_WIND = {"luffing": (0.8, 20.0), "mobile": (1.5, 9.0)}


def _crane(
    name: str, kind: str, jib: LuffingJib, reeving: Reeving, footing_m: float, sling_m: float, rigging_mass_kg: float
) -> TowerCrane:
    """Return a crane; ``footing_m`` is the edge of its mast section or undercarriage. The rest follows from its jib."""
    rpm, max_wind_m_s = _RPM_AND_WIND[kind]
    crane = TowerCrane(
        name=name,
        base_m=(0.0, 0.0, 0.0),
        mast_size_m=footing_m,
        jib_height_m=jib.highest_tip_m,
        jib_length_m=jib.radii_m[1],
        min_radius_m=jib.radii_m[0],
        sling_m=sling_m,
        rigging_mass_kg=rigging_mass_kg,
        slewing=AxisLimits(rpm * 2.0 * pi / 60.0, radians(0.3), radians(0.3)),
        trolley=_ANY,
        hoist=_ANY,
        chart=reeving.chart,
        falls=reeving.falls,
        hook_block_kg=reeving.hook_block_kg,
        gears=reeving.gears,
        max_wind_m_s=max_wind_m_s,
        kind=kind,
    )
    return with_luffing_jib(crane, jib)


LUFFING_CRANES: tuple[TowerCrane, ...] = (
    _crane(
        "luffing-40", "luffing",
        LuffingJib(
            1.5, 40.0, 40.0, (radians(20.0), radians(83.0)), AxisLimits(0.0105, 0.003, 0.003),
            AxisLimits(0.5, 0.25, 0.25), 7.0, 36.0, 3.0, 1.4,
        ),
        Reeving(2, LoadChart(
            (16.0, 20.0, 25.0, 30.0, 35.0, 39.0), (8000.0, 6300.0, 4900.0, 3950.0, 3250.0, 2850.0)
        ), hook_block_kg=200.0, gears=((4000.0, 1.0), (8000.0, 0.5))),
        footing_m=1.7, sling_m=2.5, rigging_mass_kg=150.0,
    ),
    _crane(
        "luffing-55", "luffing",
        LuffingJib(
            1.8, 50.0, 55.0, (radians(20.0), radians(84.0)), AxisLimits(0.0095, 0.003, 0.003),
            AxisLimits(0.5, 0.25, 0.25), 8.0, 45.0, 3.5, 1.6,
        ),
        Reeving(4, LoadChart(
            (20.0, 25.0, 30.0, 35.0, 40.0, 45.0, 50.0, 53.0),
            (16000.0, 12500.0, 10100.0, 8400.0, 7150.0, 6150.0, 5400.0, 5000.0),
        ), hook_block_kg=450.0, gears=((8000.0, 1.0), (16000.0, 0.5))),
        footing_m=2.1, sling_m=3.0, rigging_mass_kg=300.0,
    ),
)  # fmt: skip
"""Luffing tower cranes, ascending by size."""

MOBILE_CRANES: tuple[TowerCrane, ...] = (
    _crane(
        "mobile-60t", "mobile",
        LuffingJib(
            -1.2, 2.6, 36.0, (radians(25.0), radians(80.0)), AxisLimits(0.02, 0.01, 0.01),
            AxisLimits(0.5, 0.3, 0.3), 3.9, 1.3, 2.6, 1.0,
        ),
        Reeving(4, LoadChart(
            (6.0, 8.0, 10.0, 12.0, 16.0, 20.0, 24.0, 28.0, 31.0),
            (14000.0, 12000.0, 9600.0, 7500.0, 4700.0, 3200.0, 2300.0, 1700.0, 1300.0),
        ), hook_block_kg=250.0, gears=((7000.0, 0.7), (14000.0, 0.5))),
        footing_m=7.0, sling_m=2.5, rigging_mass_kg=100.0,
    ),
    _crane(
        "mobile-100t", "mobile",
        LuffingJib(
            -1.5, 2.9, 50.0, (radians(25.0), radians(81.0)), AxisLimits(0.018, 0.008, 0.008),
            AxisLimits(0.5, 0.3, 0.3), 4.2, 1.4, 2.8, 1.2,
        ),
        Reeving(4, LoadChart(
            (8.0, 10.0, 12.0, 16.0, 20.0, 24.0, 28.0, 34.0, 40.0, 43.5),
            (18000.0, 17000.0, 15000.0, 10200.0, 7200.0, 5400.0, 4100.0, 2800.0, 1900.0, 1500.0),
        ), hook_block_kg=450.0, gears=((9000.0, 0.7), (18000.0, 0.5))),
        footing_m=7.5, sling_m=3.0, rigging_mass_kg=200.0,
    ),
)  # fmt: skip
"""Mobile cranes on a fixed pad, ascending by size."""
