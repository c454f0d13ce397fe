"""The proof that a luffing jib and its counterweight meet nothing: the jib itself, point by point, in raw cells."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.luffing import LuffingJib
from bimvox.crane.tower_crane import TowerCrane
from bimvox.planning.moment import Thing
from bimvox.planning.proof import Check
from bimvox.site.component import Component
from bimvox.site.site import CRANE_ID, Site
from bimvox.trajectory.verify_space import way_of

_STEP_VOX = 0.5
_LINES = 5


def check_luffing_jib(
    check: Check,
    name: str,
    site: Site,
    crane: TowerCrane,
    jib: LuffingJib,
    present: Sequence[Thing],
    axes: NDArray[np.float64],
    load: tuple[Component, NDArray[np.float64]] | None,
) -> None:
    """Check jib, counterweight and, where given, the load below the jib over a whole motion.

    The jib is a band as wide as itself from pivot to tip; every half cell along it, and on lines across it, is looked
    up in the cells of what stands there. The counterweight is the same band behind the axis, from its underside up. The
    load's corners towards the mast have to be below the jib.

    Args:
        check: Where the result goes.
        name: The lift, for messages.
        site: The site.
        crane: Its crane, with the slings of the load.
        jib: Its jib.
        present: What stands there.
        axes: (N, 3) slew, radius, height of the samples.
        load: The load and its (M, 3) poses of the hook.
    """
    taken = swept_by_jib(site, crane, jib, axes)
    check.look(True, "", samples=len(axes))
    for thing in present:
        met = thing.name != CRANE_ID and bool(taken[tuple(thing.cells.T)].any())
        check.look(not met, f"{name}: the jib or its counterweight turns into {thing.name}")
    if load is not None and len(load[1]):
        _check_load(check, name, site, crane, jib, *load)


def swept_by_jib(site: Site, crane: TowerCrane, jib: LuffingJib, axes: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return the (X, Y, Z) cells that jib and counterweight come through between samples ((N, 3))."""
    way = way_of(crane, axes, site.frame.voxel_size_m).axes
    poses = np.unique(np.round(way[:, :2], 4), axis=0)
    points = np.concatenate([_jib_points(crane, jib, site, poses), _tail_points(crane, jib, site, poses)])
    cells = np.unique(np.floor((points - np.array(site.frame.origin_m)) / site.frame.voxel_size_m).astype(int), axis=0)
    cells = cells[((cells >= 0) & (cells < site.shape)).all(axis=1)]
    taken = np.zeros(site.shape, np.bool_)
    taken[tuple(cells.T)] = True
    return taken


def _jib_points(crane: TowerCrane, jib: LuffingJib, site: Site, poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """(K, 3) points of the jib's underside at poses ((P, 2) slew, radius), within the grid's height."""
    step_m = _STEP_VOX * site.frame.voxel_size_m
    along = np.linspace(0.0, 1.0, int(np.ceil(jib.length_m / step_m)) + 1)
    reach = poses[:, 1] - jib.pivot_offset_m
    rise = np.sqrt(np.maximum(jib.length_m**2 - reach**2, 0.0))
    radius = jib.pivot_offset_m + along * reach[:, None]
    height = jib.pivot_height_m + along * rise[:, None]
    highest_m = site.frame.origin_m[2] + site.shape[2] * site.frame.voxel_size_m
    which, n = np.nonzero(height <= highest_m)
    return _across(crane, poses[which, 0], radius[which, n], height[which, n], jib.width_m)


def _tail_points(crane: TowerCrane, jib: LuffingJib, site: Site, poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """(K, 3) points of the counterweight, from its underside up to the pivot, at poses."""
    step_m = _STEP_VOX * site.frame.voxel_size_m
    slew = np.unique(np.round(poses[:, 0], 3))
    back = np.arange(0.0, jib.tail_radius_m + step_m, step_m)
    up = np.arange(jib.tail_low_m + 1e-6, max(jib.pivot_height_m, jib.tail_low_m + step_m), step_m)
    s, b, u = (values.ravel() for values in np.meshgrid(slew, -np.minimum(back, jib.tail_radius_m), up, indexing="ij"))
    return _across(crane, s, b, u, jib.tail_width_m)


def _across(
    crane: TowerCrane,
    slew: NDArray[np.float64],
    radius: NDArray[np.float64],
    height: NDArray[np.float64],
    width_m: float,
) -> NDArray[np.float64]:
    """Points on lines across a band, (K,) each -> (K * lines, 3)."""
    lines = []
    for aside in np.linspace(-0.5, 0.5, _LINES) * width_m:
        x = crane.base_m[0] + radius * np.cos(slew) - aside * np.sin(slew)
        y = crane.base_m[1] + radius * np.sin(slew) + aside * np.cos(slew)
        lines.append(np.stack([x, y, height], axis=1))
    return np.concatenate(lines)


def _check_load(
    check: Check,
    name: str,
    site: Site,
    crane: TowerCrane,
    jib: LuffingJib,
    component: Component,
    axes: NDArray[np.float64],
) -> None:
    """No column of the load is as high as the jib above it."""
    size_m = site.frame.voxel_size_m
    columns = np.unique(component.shape.cells[:, :2], axis=0) - np.array(component.hook_offset_vox[:2])
    slew, radius, height = axes.T
    share = np.clip((radius - jib.pivot_offset_m) / jib.length_m, -1.0, 1.0)
    slope = np.tan(np.arccos(share))
    top_m = height - crane.sling_m
    along = columns[:, 0] * np.cos(slew)[:, None] + columns[:, 1] * np.sin(slew)[:, None]
    aside = columns[:, 1] * np.cos(slew)[:, None] - columns[:, 0] * np.sin(slew)[:, None]
    # A column of a cell is as far in as its nearest corner, and below the jib where it is within its width.
    at = radius[:, None] + (along - 0.5 * np.sqrt(2.0)) * size_m
    under = (np.abs(aside) - 0.5 * np.sqrt(2.0)) * size_m <= jib.width_m / 2.0
    jib_m = jib.pivot_height_m + (np.minimum(at, radius[:, None]) - jib.pivot_offset_m) * slope[:, None]
    bad = (under & (at > jib.pivot_offset_m) & (top_m[:, None] > jib_m)).any(axis=1)
    worst = int(np.argmax(bad))
    check.look(
        not bad.any(),
        f"{name}: at radius {radius[worst]:.2f} m the load reaches up into the jib",
        samples=len(axes),
    )
