"""Kinematics: hook in the site frame <-> slew, radius, height <-> the joints of the machine."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.compiled import leaf_kernel
from bimvox.crane.axis_limits import AxisLimits
from bimvox.crane.luffing import luff_of_radius, radius_of_luff, tip_height_m
from bimvox.crane.tower_crane import TowerCrane

Axes = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]
"""slew_rad, radius_m, height_m, of equal shape."""


def pose_of(crane: TowerCrane, hook_m: ArrayLike) -> Axes:
    """Return the axes that bring the hook to points of the site (inverse kinematics).

    Args:
        crane: The crane.
        hook_m: (..., 3) points, metres.

    Returns:
        ``slew_rad`` in (-pi, pi], ``radius_m`` and ``height_m``, each of shape (...). On the slewing axis itself, the
        slew angle is 0.
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
