"""A crane's limits as kernels take them."""

from __future__ import annotations

from typing import NamedTuple

from bimvox.crane.luffing import LuffingNumbers, luffing_numbers
from bimvox.crane.tower_crane import TowerCrane


class AxisNumbers(NamedTuple):
    """A crane's limits as kernels take them: rate, acceleration and jerk of each axis.

    Attributes:
        slewing: rad.
        trolley: m; of a luffing jib the limits of the radius depend on the radius.
        hoist: m.
        luffs: Whether it has a luffing jib.
        luffing: Its numbers; of another crane they mean nothing.
    """

    slewing: tuple[float, float, float]
    trolley: tuple[float, float, float]
    hoist: tuple[float, float, float]
    luffs: bool
    luffing: LuffingNumbers


_NO_JIB = LuffingNumbers(0.0, 1.0, 0.0, (1.0, 1.0, 1.0), (1.0, 1.0, 1.0))


def axis_numbers(crane: TowerCrane) -> AxisNumbers:
    """Return a crane's limits as kernels take them."""
    slewing, trolley, hoist = (
        (float(axis.rate), float(axis.acceleration), float(axis.jerk))
        for axis in (crane.slewing, crane.trolley, crane.hoist)
    )
    jib = crane.luffing
    return AxisNumbers(
        slewing, trolley, hoist, jib is not None, _NO_JIB if jib is None else luffing_numbers(jib, jib.winch)
    )
