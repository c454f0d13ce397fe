"""Loads on the outriggers of a mobile crane, by the statics of a rigid body on four pads."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.crane.carrier import Carrier, Outriggers
from bimvox.crane.tower_crane import LuffingJib

G_M_S2 = 9.80665
PADS = ("front left", "front right", "rear left", "rear right")

_TOUCHES_N = 1.0
"""Below this a pad carries nothing: it has lifted off."""


def crane_kg(carrier: Carrier) -> float | None:
    """Return the mass of a mobile crane without load and hook block; None if nobody states it."""
    own, weight_kg = carrier.masses, carrier.counterweight_kg
    if own is None or weight_kg is None:
        return None
    return own.carrier_kg + own.superstructure_kg + own.boom_kg + weight_kg


def pad_loads_n(
    carrier: Carrier, jib: LuffingJib, slew_rad: ArrayLike, radius_m: ArrayLike, hung_kg: ArrayLike
) -> NDArray[np.float64] | None:
    """Return (N, 4) the vertical load on each pad (:data:`PADS`), newtons; infinite where the crane would tip.

    Carrier, superstructure, counterweight, boom and load act at their centres. The four pads are equally stiff under a
    rigid carrier: their loads lie in one plane over the plan. A pad whose load would be negative has lifted off, and
    the other three carry all.

    Args:
        carrier: Set-up with outriggers, counterweight and masses; None is returned if one is not stated.
        jib: The boom.
        slew_rad: (N,) slewing angles of the boom from the site's x axis.
        radius_m: (N,) radii of the hook.
        hung_kg: (N,) what hangs on the rope: load, rigging and hook block.
    """
    base, own, weight_kg = carrier.outriggers, carrier.masses, carrier.counterweight_kg
    if base is None or own is None or weight_kg is None:
        return None
    given = (np.atleast_1d(np.asarray(value, np.float64)) for value in (slew_rad, radius_m, hung_kg))
    slew, radius, hung = np.broadcast_arrays(*given)
    boom_m = jib.pivot_offset_m + own.boom_share * (radius - jib.pivot_offset_m)
    # Moment of what slews about the axis, in the direction of the boom.
    slews = own.superstructure_kg * own.superstructure_ahead_m - weight_kg * own.counterweight_behind_m
    slews = slews + own.boom_kg * boom_m + hung * radius
    turned = slew - carrier.heading_rad
    mass = own.carrier_kg + own.superstructure_kg + own.boom_kg + weight_kg + hung
    ahead, aside = own.carrier_kg * own.carrier_ahead_m + slews * np.cos(turned), slews * np.sin(turned)
    return _on_pads(base, G_M_S2 * np.stack([mass, ahead, aside], axis=1))


def _on_pads(base: Outriggers, wrench: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (N, 4) pad loads for (N, 3) weight and moments about the slewing axis, ahead and to the left."""
    x = np.array([base.front_m, base.front_m, -base.rear_m, -base.rear_m])
    y = np.array([base.left_m, -base.right_m, base.left_m, -base.right_m])
    arms = np.stack([np.ones(4), x, y])
    loads: NDArray[np.float64] = wrench @ np.linalg.pinv(arms).T
    lifted = loads.min(axis=1) < 0.0
    if lifted.any():
        loads[lifted] = _on_three(arms, wrench[lifted])
    return loads


def _on_three(arms: NDArray[np.float64], wrench: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (N, 4) pad loads where three pads carry all; infinite where no three of them can.

    Two choices of three are in balance; pads that only push take the one with the least energy, so the least squares.
    """
    result, energy = np.full((len(wrench), 4), np.inf), np.full(len(wrench), np.inf)
    for three in combinations(range(4), 3):
        own = np.zeros((len(wrench), 4))
        own[:, three] = np.linalg.solve(arms[:, three], wrench.T).T
        squares = (own**2).sum(axis=1)
        better = (own >= -1e-9 * wrench[:, :1]).all(axis=1) & (squares < energy)
        result[better], energy[better] = np.maximum(own[better], 0.0), squares[better]
    return result


def touches(loads_n: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which pads carry something."""
    carried: NDArray[np.bool_] = loads_n > _TOUCHES_N
    return carried
