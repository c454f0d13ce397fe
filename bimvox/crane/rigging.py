"""The crane as rigged: its reeving, and the speed and height of the hook with a load.

One reeving is used for a whole job. To change it, the hook goes to the foot of the jib, a fitter couples or uncouples
the second sheave block, and a test run follows. On site that is done between phases, never between the lifts of a cycle
and never with a load. So the reeving is a key of the site (``[crane] falls``), and its load chart applies to every
lift.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

from bimvox.crane.axis_limits import AxisLimits
from bimvox.crane.luffing import LuffingJib, hook_limits, radius_limits
from bimvox.crane.tower_crane import Reeving, TowerCrane


def with_reeving(crane: TowerCrane, reeving: Reeving) -> TowerCrane:
    """Return the crane with a reeving: its chart, hook block, gears and trolley rate."""
    trolley = crane.trolley
    if reeving.trolley_rate_m_s is not None:
        trolley = replace(trolley, rate=reeving.trolley_rate_m_s)
    return replace(
        crane,
        falls=reeving.falls,
        chart=reeving.chart,
        hook_block_kg=reeving.hook_block_kg,
        gears=reeving.gears,
        trolley=trolley,
    )


def winch_limits(crane: TowerCrane, load_kg: float) -> AxisLimits:
    """Return the limits of the winch with a load: the rate of the first gear that carries it.

    Above the last gear, the lower of the winch's own rate and the last gear's rate applies.

    Args:
        crane: The crane.
        load_kg: Mass of the load, without rigging and hook block; 0 for the empty hook.
    """
    winch = crane.hoist if crane.luffing is None else crane.luffing.winch
    on_the_rope_kg = load_kg + crane.tackle_kg
    for most_kg, rate_m_s in crane.gears:
        if on_the_rope_kg <= most_kg:
            return replace(winch, rate=rate_m_s)
    return replace(winch, rate=min([winch.rate, *(rate for _, rate in crane.gears[-1:])]))


def hoist_limits(crane: TowerCrane, load_kg: float) -> AxisLimits:
    """Return the limits of the hook's height with a load: the winch's, for a luffing jib its hoisting share."""
    winch = winch_limits(crane, load_kg)
    return winch if crane.luffing is None else hook_limits(winch)


@lru_cache(maxsize=256)
def rigged(crane: TowerCrane, load_kg: float, sling_rise_m: float = 0.0, rigging_kg: float | None = None) -> TowerCrane:
    """Return the crane as rigged for one load: the hoist in its gear, the slings as high as the load needs.

    Args:
        crane: The crane.
        load_kg: Mass of the load, without rigging and hook block; 0 for the empty hook.
        sling_rise_m: Additional height of the slings.
        rigging_kg: Mass of the load's own rigging; None: the crane's usual one.
    """
    if rigging_kg is not None:
        crane = replace(crane, rigging_mass_kg=rigging_kg)
    crane = replace(crane, hoist=hoist_limits(crane, load_kg), sling_m=crane.sling_m + sling_rise_m)
    if crane.luffing is None:
        return crane
    jib = replace(crane.luffing, winch=winch_limits(crane, load_kg))
    return replace(crane, luffing=jib, trolley=radius_limits(jib, jib.winch, *jib.radii_m))


def with_luffing_jib(crane: TowerCrane, jib: LuffingJib) -> TowerCrane:
    """Return the crane with a luffing jib: radii, height and limits of the hook follow from it."""
    near_m, far_m = jib.radii_m
    winch = winch_limits(replace(crane, luffing=jib), crane.chart.capacity_kg[0])
    return replace(
        crane,
        luffing=jib,
        jib_height_m=jib.highest_tip_m,
        jib_length_m=far_m,
        min_radius_m=near_m,
        trolley=radius_limits(jib, winch, near_m, far_m),
        hoist=hook_limits(winch),
    )


def pose_limits(crane: TowerCrane) -> tuple[AxisLimits, AxisLimits, AxisLimits]:
    """Return limits of slew, radius and height that no motion of the crane exceeds, in any gear, at any radius."""
    if crane.luffing is None:
        return crane.slewing, crane.trolley, crane.hoist
    jib, winch = crane.luffing, crane.luffing.winch
    fastest = AxisLimits(max([winch.rate, *(rate for _, rate in crane.gears)]), winch.acceleration, winch.jerk)
    near_m = jib.radii_m[0]
    return crane.slewing, radius_limits(jib, fastest, near_m, near_m), hook_limits(fastest)
