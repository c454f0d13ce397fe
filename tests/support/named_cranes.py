"""Built-in machines by name, and poses of single points."""

from __future__ import annotations

from dataclasses import replace

from numpy.typing import ArrayLike

from bimvox.crane.catalogue import BUILT_IN
from bimvox.crane.kinematics import hook_of, nearest_turn, pose_of
from bimvox.crane.tower_crane import CranePose, TowerCrane


def default_crane(
    name: str, base_m: tuple[float, float, float] = (0.0, 0.0, 0.0), jib_height_m: float | None = None
) -> TowerCrane:
    """Return a built-in hammerhead on a base."""
    crane = default_luffing_crane(name)
    return replace(crane, base_m=base_m, jib_height_m=jib_height_m or crane.jib_height_m)


def default_luffing_crane(name: str) -> TowerCrane:
    """Return a built-in crane as it is, on the origin."""
    (crane,) = (crane for crane in BUILT_IN if crane.name == name)
    return crane


def crane_pose(crane: TowerCrane, hook_m: ArrayLike, near_slew_rad: float | None = None) -> CranePose:
    """Return the pose that brings the hook to one point; its slew angle near a given one."""
    slew, radius, height = (float(axis) for axis in pose_of(crane, hook_m))
    return CranePose(slew if near_slew_rad is None else nearest_turn(slew, near_slew_rad), radius, height)


def hook_point(crane: TowerCrane, pose: CranePose) -> tuple[float, float, float]:
    """Return the position of the hook at one pose, metres."""
    x, y, z = hook_of(crane, pose.slew_rad, pose.radius_m, pose.height_m).tolist()
    return (x, y, z)
