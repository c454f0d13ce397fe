"""The crane as it is rigged: which reeving, and how fast and how high the hook goes with a load.

One reeving is used for a whole job. Changing it takes the hook to the foot of the jib, a fitter to couple or uncouple
the second sheave block and a test run: on site that is done between phases, never between the lifts of a cycle, and
never with a load. So the reeving is a key of the site (``[crane] falls``): the load chart of that reeving holds for
every lift, and there is no reeving to choose, or to get wrong, in between.
"""

from __future__ import annotations

from dataclasses import replace

from bimvox.crane.tower_crane import AxisLimits, Reeving, TowerCrane


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


def reeving_of(crane: TowerCrane) -> Reeving:
    """Return the reeving that a crane has now."""
    return Reeving(crane.falls, crane.chart, crane.hook_block_kg, crane.trolley.rate, crane.gears)


def hoist_limits(crane: TowerCrane, load_kg: float) -> AxisLimits:
    """Return the limits of the hoist with a load: the rate of the first gear that takes it.

    Above the last gear the hoist's own rate holds, or the last gear's where that is slower.

    Args:
        crane: The crane.
        load_kg: Mass of the load, without rigging and hook block; 0 for the empty hook.
    """
    on_the_rope_kg = load_kg + crane.tackle_kg
    for most_kg, rate_m_s in crane.gears:
        if on_the_rope_kg <= most_kg:
            return replace(crane.hoist, rate=rate_m_s)
    slowest = min([crane.hoist.rate, *(rate for _, rate in crane.gears[-1:])])
    return replace(crane.hoist, rate=slowest)


def rigged(crane: TowerCrane, load_kg: float, sling_rise_m: float = 0.0) -> TowerCrane:
    """Return the crane as it is for one load: the hoist in its gear, the slings as high as that load needs.

    Args:
        crane: The crane.
        load_kg: Mass of the load, without rigging and hook block; 0 for the empty hook.
        sling_rise_m: How much higher than usual the slings are.
    """
    return replace(crane, hoist=hoist_limits(crane, load_kg), sling_m=crane.sling_m + sling_rise_m)
