"""Kinematics: hook in the site's frame <-> slewing, radius, height <-> the joints of the machine."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.crane.axis_limits import AxisLimits
from bimvox.crane.luffing import luff_of_radius, radius_of_luff, tip_height_m
from bimvox.crane.tower_crane import CranePose, TowerCrane

Axes = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]
"""slew_rad, radius_m, height_m, of equal shape."""


def pose_of(crane: TowerCrane, hook_m: ArrayLike) -> Axes:
    """Return the axes that put the hook at points of the site (inverse kinematics).

    Args:
        crane: The crane.
        hook_m: (..., 3) points, metres.

    Returns:
        ``slew_rad`` in (-pi, pi], ``radius_m`` and ``height_m``, each of shape (...). On the slewing axis itself, where
        any slewing angle would do, it is 0.
    """
    points = np.asarray(hook_m, dtype=np.float64)
    dx = points[..., 0] - crane.base_m[0]
    dy = points[..., 1] - crane.base_m[1]
    # Adding 0.0 turns -0.0 into 0.0: arctan2 would make -pi of it.
    return np.arctan2(dy + 0.0, dx), np.hypot(dx, dy), points[..., 2].copy()


def hook_of(crane: TowerCrane, slew_rad: ArrayLike, radius_m: ArrayLike, height_m: ArrayLike) -> NDArray[np.float64]:
    """Return where the hook is (forward kinematics).

    Args:
        crane: The crane.
        slew_rad: Angles of the jib.
        radius_m: Trolley positions, broadcastable against the angles.
        height_m: Hook heights, broadcastable against the angles.

    Returns:
        (..., 3) float64 points in the site's frame, metres.
    """
    slew, radius = np.asarray(slew_rad, np.float64), np.asarray(radius_m, np.float64)
    height = np.asarray(height_m, np.float64)
    points = np.empty((*np.broadcast_shapes(slew.shape, radius.shape, height.shape), 3))
    points[..., 0] = crane.base_m[0] + radius * np.cos(slew)
    points[..., 1] = crane.base_m[1] + radius * np.sin(slew)
    points[..., 2] = height
    return points


def crane_pose(crane: TowerCrane, hook_m: ArrayLike, near_slew_rad: float | None = None) -> CranePose:
    """Return the pose that puts the hook at one point.

    Args:
        crane: The crane.
        hook_m: (3,) point, metres.
        near_slew_rad: Where given, the slewing angle is the one of its equals that lies nearest to this.
    """
    slew, radius, height = (float(axis) for axis in pose_of(crane, hook_m))
    return CranePose(slew if near_slew_rad is None else nearest_turn(slew, near_slew_rad), radius, height)


def hook_point(crane: TowerCrane, pose: CranePose) -> tuple[float, float, float]:
    """Return where the hook is at one pose, metres."""
    x, y, z = hook_of(crane, pose.slew_rad, pose.radius_m, pose.height_m).tolist()
    return (x, y, z)


def nearest_turn(slew_rad: float, near_rad: float) -> float:
    """Return the angle equal to ``slew_rad`` up to whole turns that is nearest to ``near_rad``."""
    return slew_rad + 2.0 * np.pi * round((near_rad - slew_rad) / (2.0 * np.pi))


def unwrap_slew(slew_rad: ArrayLike, start_rad: float | None = None) -> NDArray[np.float64]:
    """Return the angles along a path, each on the shortest way from the one before: no hidden turns.

    Args:
        slew_rad: (N,) angles.
        start_rad: Where given, the first angle is moved by whole turns to lie nearest to this.
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

    The rope is what hangs below the trolley's exit, or below the tip of a luffing jib.
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
