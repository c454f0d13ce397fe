"""The load as a pendulum: its length and its period."""

from __future__ import annotations

from math import pi, sqrt

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.tower_crane import TowerCrane, tip_height_m

GRAVITY_M_S2 = 9.80665
SHORTEST_M = 0.5
"""No pendulum is shorter."""


def pendulum_length_m(crane: TowerCrane, height_m: float, below_hook_m: float, radius_m: float | None = None) -> float:
    """Return the distance from the rope exit down to the middle of the load, at least 0.5 m.

    Args:
        crane: The crane.
        height_m: Height of the hook above the site's z = 0.
        below_hook_m: From the hook down to the middle of the load.
        radius_m: Radius of the hook, which determines the height of a luffing jib's tip; None: the highest tip.
    """
    exit_m = crane.jib_height_m
    if crane.luffing is not None and radius_m is not None:
        exit_m = float(tip_height_m(crane.luffing, np.array([radius_m]))[0])
    return max(SHORTEST_M, exit_m - height_m + below_hook_m)


def pendulum_lengths_m(crane: TowerCrane, axes: NDArray[np.float64], below_hook_m: float) -> NDArray[np.float64]:
    """Return the (N,) pendulum lengths at (N, 3) hook poses (slew, radius, height); see :func:`pendulum_length_m`."""
    exit_m = crane.jib_height_m if crane.luffing is None else tip_height_m(crane.luffing, axes[:, 1])
    lengths: NDArray[np.float64] = np.maximum(SHORTEST_M, exit_m - axes[:, 2] + below_hook_m)
    return lengths


def half_period_s(length_m: float) -> float:
    """Return half the period of a pendulum, for small angles."""
    return pi * sqrt(length_m / GRAVITY_M_S2)
