"""Kinematics: hook in the site frame <-> slew, radius, height <-> the joints of the machine, as it is rigged."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.compiled import leaf_kernel
from bimvox.crane.tower_crane import (
    HOIST_SHARE,
    AxisLimits,
    LuffingJib,
    LuffingNumbers,
    Reeving,
    TowerCrane,
    luff_of_radius,
    luffing_numbers,
    radius_limits,
    radius_of_luff,
    tip_height_m,
)

Axes = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]
"""slew_rad, radius_m, height_m, of equal shape."""


def pose_of(crane: TowerCrane, hook_m: ArrayLike) -> Axes:
    """Return the axes that bring the hook to points of the site (inverse kinematics).

    ``hook_m``: (..., 3) points, metres. Returns ``slew_rad`` in (-pi, pi], ``radius_m`` and ``height_m``, each of shape
    (...). On the slewing axis itself, the slew angle is 0.
    """
    points = np.asarray(hook_m, dtype=np.float64)
    dx = points[..., 0] - crane.base_m[0]
    dy = points[..., 1] - crane.base_m[1]
    # Adding 0.0 turns -0.0 into 0.0, for which arctan2 would give -pi.
    return np.arctan2(dy + 0.0, dx), np.hypot(dx, dy), points[..., 2].copy()


def hook_of(crane: TowerCrane, slew_rad: ArrayLike, radius_m: ArrayLike, height_m: ArrayLike) -> NDArray[np.float64]:
    """Return the position of the hook (forward kinematics).

    Args:
        crane: The crane.
        slew_rad: Slew angles.
        radius_m: Radii, broadcastable against the angles.
        height_m: Hook heights, broadcastable against the angles.

    Returns:
        (..., 3) float64 points in the site frame, metres.
    """
    axes = [np.asarray(axis, np.float64) for axis in (slew_rad, radius_m, height_m)]
    shape = axes[0].shape
    if not shape == axes[1].shape == axes[2].shape:
        axes = list(np.broadcast_arrays(*axes))
        shape = axes[0].shape
    slew, radius, height = (axis.ravel() for axis in axes)
    points = np.empty((slew.size, 3))
    _write_hooks(points, slew, radius, height, crane.base_m[0], crane.base_m[1])
    return points.reshape(*shape, 3)


@leaf_kernel
def _write_hooks(
    points_m: NDArray[np.float64],
    slew_rad: NDArray[np.float64],
    radius_m: NDArray[np.float64],
    height_m: NDArray[np.float64],
    x_m: float,
    y_m: float,
) -> None:
    """Write what ``hook_of`` returns for (N,) axes to points ((N, 3))."""
    slew, cos, sin = np.nan, 1.0, 0.0
    for i in range(points_m.shape[0]):
        if slew_rad[i] != slew:  # mostly the jib rests
            slew = slew_rad[i]
            cos, sin = np.cos(slew), np.sin(slew)
        points_m[i, 0] = x_m + radius_m[i] * cos
        points_m[i, 1] = y_m + radius_m[i] * sin
        points_m[i, 2] = height_m[i]


def nearest_turn(slew_rad: float, near_rad: float) -> float:
    """Return ``slew_rad`` plus the whole turns that bring it nearest to ``near_rad``."""
    return slew_rad + 2.0 * np.pi * round((near_rad - slew_rad) / (2.0 * np.pi))


def unwrap_slew(slew_rad: ArrayLike, start_rad: float | None = None) -> NDArray[np.float64]:
    """Return the angles along a path, unwrapped: each within half a turn of the previous one.

    Args:
        slew_rad: (N,) angles.
        start_rad: If given, the first angle is moved by whole turns to lie nearest to this.
    """
    angles = np.asarray(slew_rad, dtype=np.float64)
    unwrapped: NDArray[np.float64] = np.unwrap(angles)
    if start_rad is not None and len(angles):
        unwrapped = unwrapped + (nearest_turn(float(unwrapped[0]), start_rad) - unwrapped[0])
    return unwrapped


def joint_names(crane: TowerCrane) -> tuple[str, str, str]:
    """Return the names of the joints, as in the URDF and the log's joint states."""
    return ("slewing", "trolley" if crane.luffing is None else "luffing", "hoist")


def joints_of(crane: TowerCrane, axes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return joint positions: (N, 3) slew, radius, height -> slewing (rad), trolley (m) or luffing (rad), rope (m).

    The rope length is measured from the trolley's rope exit, or from the tip of a luffing jib.
    """
    slew, radius, height = np.asarray(axes, np.float64).T
    if crane.luffing is None:
        return np.stack([slew, radius, crane.jib_height_m - height], axis=1)
    rope = tip_height_m(crane.luffing, radius) - height
    return np.stack([slew, luff_of_radius(crane.luffing, radius), rope], axis=1)


def axes_of_joints(crane: TowerCrane, joints: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (N, 3) slew, radius, height at joint positions: the way back from :func:`joints_of`."""
    slewing, second, rope = np.asarray(joints, np.float64).T
    if crane.luffing is None:
        return np.stack([slewing, second, crane.jib_height_m - rope], axis=1)
    radius = radius_of_luff(crane.luffing, second)
    height = crane.luffing.pivot_height_m + crane.luffing.length_m * np.sin(second) - rope
    return np.stack([slewing, radius, height], axis=1)


def joint_limits(crane: TowerCrane) -> tuple[AxisLimits, AxisLimits, AxisLimits]:
    """Return the limits of the joints, of the hoist without a load in mind (see ``rigging.winch_limits``)."""
    if crane.luffing is None:
        return crane.slewing, crane.trolley, crane.hoist
    return crane.slewing, crane.luffing.limits, crane.luffing.winch


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


# The crane as rigged: its reeving, and the speed and height of the hook with a load.
#
# One reeving is used for a whole job. To change it, the hook goes to the foot of the jib, a fitter couples or uncouples
# the second sheave block, and a test run follows. On site that is done between phases, never between the lifts of a
# cycle and never with a load. So the reeving is a key of the site (``[crane] falls``), and its load chart applies to
# every lift.


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

    ``load_kg``: mass of the load, without rigging and hook block; 0 for the empty hook.
    """
    winch = crane.hoist if crane.luffing is None else crane.luffing.winch
    on_the_rope_kg = load_kg + crane.hook_block_kg + crane.rigging_mass_kg
    for most_kg, rate_m_s in crane.gears:
        if on_the_rope_kg <= most_kg:
            return replace(winch, rate=rate_m_s)
    return replace(winch, rate=min([winch.rate, *(rate for _, rate in crane.gears[-1:])]))


def hoist_limits(crane: TowerCrane, load_kg: float) -> AxisLimits:
    """Return the limits of the hook's height with a load: the winch's, for a luffing jib its hoisting share."""
    winch = winch_limits(crane, load_kg)
    return winch if crane.luffing is None else _hook_limits(winch)


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


def raised(crane: TowerCrane, by_m: float) -> TowerCrane:
    """Return a crane whose pivot and counterweight are higher: a mobile crane's are as high above its foot as ever."""
    jib = crane.luffing
    if jib is None or by_m == 0.0:
        return crane
    higher = replace(jib, pivot_height_m=jib.pivot_height_m + by_m, tail_low_m=jib.tail_low_m + by_m)
    return replace(crane, luffing=higher, jib_height_m=crane.jib_height_m + by_m)


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
        hoist=_hook_limits(winch),
    )


def pose_limits(crane: TowerCrane) -> tuple[AxisLimits, AxisLimits, AxisLimits]:
    """Return limits of slew, radius and height that no motion of the crane exceeds, in any gear, at any radius."""
    if crane.luffing is None:
        return crane.slewing, crane.trolley, crane.hoist
    jib, winch = crane.luffing, crane.luffing.winch
    fastest = AxisLimits(max([winch.rate, *(rate for _, rate in crane.gears)]), winch.acceleration, winch.jerk)
    near_m = jib.radii_m[0]
    return crane.slewing, radius_limits(jib, fastest, near_m, near_m), _hook_limits(fastest)


def _hook_limits(winch: AxisLimits) -> AxisLimits:
    """Return the limits of the hook's height: the winch's share for hoisting."""
    return AxisLimits(HOIST_SHARE * winch.rate, HOIST_SHARE * winch.acceleration, HOIST_SHARE * winch.jerk)
