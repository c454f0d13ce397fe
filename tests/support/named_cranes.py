"""Built-in machines by name, and poses of single points."""

from __future__ import annotations

from dataclasses import replace

from numpy.typing import ArrayLike

from bimvox.crane.kinematics import hook_of, nearest_turn, pose_of
from bimvox.crane.tower_crane import CranePose, Reeving, TowerCrane
from bimvox.site.catalogue import catalogue, machine_called

HAMMERHEADS = tuple(machine_called(f"hammerhead-{length}").usual for length in (30, 45, 65, 75))
LUFFING_CRANES = tuple(machine_called(f"luffing-{length}").usual for length in (40, 55))
MOBILE_CRANES = tuple(machine_called(f"mobile-{size}t").usual for size in (60, 100))
BUILT_IN = tuple(machine.usual for machine in catalogue())
"""Machines of the catalogue with their longest jib, and the reeving that carries most."""


def reevings(name: str) -> tuple[Reeving, ...]:
    """Return the reevings of a machine with its longest jib, the one that carries most first."""
    machine = machine_called(name)
    cranes = sorted(machine.with_jib(max(machine.lengths_m)), key=lambda crane: -crane.chart.capacity_kg[0])
    return tuple(
        Reeving(crane.falls, crane.chart, crane.hook_block_kg, crane.trolley.rate, crane.gears) for crane in cranes
    )


def default_crane(
    name: str, base_m: tuple[float, float, float] = (0.0, 0.0, 0.0), jib_height_m: float | None = None
) -> TowerCrane:
    """Return a built-in hammerhead on a base."""
    crane = default_luffing_crane(name)
    return replace(crane, base_m=base_m, jib_height_m=jib_height_m or crane.jib_height_m)


def default_luffing_crane(name: str) -> TowerCrane:
    """Return a built-in crane as it is, on the origin, without its auxiliary hook, which few sites use."""
    return replace(machine_called(name).usual, auxiliary=None)


def crane_pose(crane: TowerCrane, hook_m: ArrayLike, near_slew_rad: float | None = None) -> CranePose:
    """Return the pose that brings the hook to one point; its slew angle near a given one."""
    slew, radius, height = (float(axis) for axis in pose_of(crane, hook_m))
    return CranePose(slew if near_slew_rad is None else nearest_turn(slew, near_slew_rad), radius, height)


def hook_point(crane: TowerCrane, pose: CranePose) -> tuple[float, float, float]:
    """Return the position of the hook at one pose, metres."""
    x, y, z = hook_of(crane, pose.slew_rad, pose.radius_m, pose.height_m).tolist()
    return (x, y, z)
