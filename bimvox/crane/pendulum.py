"""The load as a pendulum: how long it is, and how long it takes to swing."""

from __future__ import annotations

from math import pi, sqrt

from bimvox.crane.tower_crane import TowerCrane

GRAVITY_M_S2 = 9.80665
_SHORTEST_M = 0.5


def pendulum_length_m(crane: TowerCrane, height_m: float, below_hook_m: float) -> float:
    """Return how far below the rope's exit the middle of a load hangs, half a metre at least.

    Args:
        crane: The crane.
        height_m: Height of the hook above the site's z = 0.
        below_hook_m: From the hook down to the middle of the load.
    """
    return max(_SHORTEST_M, crane.jib_height_m - height_m + below_hook_m)


def half_period_s(length_m: float) -> float:
    """Return half the period of a pendulum of a length, for small angles."""
    return pi * sqrt(length_m / GRAVITY_M_S2)
