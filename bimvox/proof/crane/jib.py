"""The proof that a luffing jib and its counterweight hit nothing, tested point by point in raw cells."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.crane.tower_crane import LuffingJib, TowerCrane
from bimvox.proof.moment import Thing
from bimvox.proof.space import way_of
from bimvox.records.proof import Check
from bimvox.site.component import Component
from bimvox.site.site import Site, is_mast_of

_STEP_VOX = 0.5
_NEAR_VOX = 0.25


def check_luffing_jib(
    check: Check,
    name: str,
    site: Site,
    crane: TowerCrane,
    jib: LuffingJib,
    present: Sequence[Thing],
    axes: NDArray[np.float64],
    load: tuple[Component, NDArray[np.int32], NDArray[np.float64]] | None,
) -> None:
    """Check jib, counterweight and, if given, the load below the jib over a whole motion.

    The jib is a band of its own width from pivot to tip; points every half cell along and across it are looked up in
    the occupied cells. The counterweight is the same band behind the axis, from its underside up. The load's corners
    towards the mast must be below the jib.

    Args:
        check: Receives the result.
        name: The lift, for messages.
        site: The site.
        crane: Its crane, with the slings of the load.
        jib: Its jib.
        present: What is on the site.
        axes: (N, 3) slew, radius, height of the samples.
        load: The load, the cells around it at every heading that it may have, and its (M, 3) poses of the hook.
    """
    taken = swept_by_jib(site, crane, jib, axes)
    check.look(True, "", samples=len(axes))
    for thing in present:
        met = not is_mast_of(crane, thing.name) and bool(_any_taken(taken, thing.cells))
        check.look(not met, f"{name}: the jib or its counterweight turns into {thing.name}")
    if load is not None and len(load[2]):
        _check_load(check, name, site, crane, jib, *load)


@kernel
def _any_taken(taken: NDArray[np.bool_], cells: NDArray[np.int32]) -> bool:
    """Return whether any cell is occupied; cells outside the grid are free."""
    nx, ny, nz = taken.shape
    for n in range(cells.shape[0]):
        x, y, z = cells[n, 0], cells[n, 1], cells[n, 2]
        if 0 <= x < nx and 0 <= y < ny and 0 <= z < nz and taken[x, y, z]:
            return True
    return False


def swept_by_jib(site: Site, crane: TowerCrane, jib: LuffingJib, axes: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return the (X, Y, Z) cells that jib and counterweight sweep between samples ((N, 3)).

    Poses are so dense that neither the tip nor the counterweight's end is off by more than a quarter of a cell.
    Checked points are at most half a cell apart, along and across.
    """
    size_m = site.frame.voxel_size_m
    way = way_of(crane, axes, size_m).axes
    taken = np.zeros(site.shape, np.bool_)
    place = np.array([*crane.base_m[:2], *site.frame.origin_m, size_m])
    _mark_jib(
        taken,
        place,
        np.array([jib.pivot_offset_m, jib.pivot_height_m, jib.length_m, jib.width_m]),
        _apart(way[:, :2], np.array([_NEAR_VOX * size_m / jib.radii_m[1], _NEAR_VOX * size_m])),
    )
    _mark_tail(
        taken,
        place,
        np.array([jib.tail_radius_m, jib.tail_low_m, jib.pivot_height_m, jib.tail_width_m]),
        _apart(way[:, :1], np.array([_NEAR_VOX * size_m / jib.tail_radius_m]))[:, 0],
    )
    return taken


def _apart(poses: NDArray[np.float64], step: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return poses ((N, A)) on a grid of steps ((A,)), each once: none is off by more than half a step."""
    return np.asarray(np.unique(np.round(poses / step), axis=0) * step, np.float64)


@kernel
def _mark_jib(
    taken: NDArray[np.bool_], place: NDArray[np.float64], jib: NDArray[np.float64], poses: NDArray[np.float64]
) -> None:
    """Mark the cells of the jib's underside, a band from pivot to tip, at poses ((P, 2) slew, radius)."""
    origin_z, size = place[4], place[5]
    offset, pivot, length, width = jib
    along = int(np.ceil(length / (_STEP_VOX * size)))
    highest_m = origin_z + taken.shape[2] * size
    for p in range(poses.shape[0]):
        slew, radius = poses[p]
        reach = radius - offset
        rise = np.sqrt(max(length * length - reach * reach, 0.0))
        for n in range(along + 1):
            share = n / along
            height = pivot + share * rise
            if height > highest_m:
                break
            _mark_across(taken, place, slew, offset + share * reach, height, width)


@kernel
def _mark_tail(
    taken: NDArray[np.bool_], place: NDArray[np.float64], tail: NDArray[np.float64], slews: NDArray[np.float64]
) -> None:
    """Mark the cells of the counterweight, from its underside up to the pivot, at slewing angles."""
    origin_z, size = place[4], place[5]
    radius, low, pivot, width = tail
    step = _STEP_VOX * size
    back, up = int(np.ceil(radius / step)), max(1, int(np.ceil((pivot - low) / step)))
    highest_m = origin_z + taken.shape[2] * size
    for slew in slews:
        for k in range(up):
            height = low + 1e-6 + k * step
            if height > highest_m:
                break
            for n in range(back + 1):
                _mark_across(taken, place, slew, -min(n * step, radius), height, width)


@kernel
def _mark_across(
    taken: NDArray[np.bool_], place: NDArray[np.float64], slew: float, radius: float, height: float, width: float
) -> None:
    """Mark the cells on a level line across the whole width of a band, at a radius of its middle."""
    base_x, base_y, origin_x, origin_y, origin_z, size = place
    c, s = np.cos(slew), np.sin(slew)
    z = int(np.floor((height - origin_z) / size))
    if z < 0 or z >= taken.shape[2]:
        return
    lines = int(np.ceil(width / (_STEP_VOX * size)))
    for n in range(lines + 1):
        aside = (n / lines - 0.5) * width
        x = int(np.floor((base_x + radius * c - aside * s - origin_x) / size))
        y = int(np.floor((base_y + radius * s + aside * c - origin_y) / size))
        if 0 <= x < taken.shape[0] and 0 <= y < taken.shape[1]:
            taken[x, y, z] = True


def _check_load(
    check: Check,
    name: str,
    site: Site,
    crane: TowerCrane,
    jib: LuffingJib,
    component: Component,
    cells: NDArray[np.int32],
    axes: NDArray[np.float64],
) -> None:
    """Check that no column of the load reaches the jib above it."""
    size_m = site.frame.voxel_size_m
    columns = np.unique(cells[:, :2], axis=0) - np.array(component.hook_line_vox[:2])
    slew, radius, height = axes.T
    share = np.clip((radius - jib.pivot_offset_m) / jib.length_m, -1.0, 1.0)
    slope = np.tan(np.arccos(share))
    top_m = height - crane.sling_m
    along = columns[:, 0] * np.cos(slew)[:, None] + columns[:, 1] * np.sin(slew)[:, None]
    aside = columns[:, 1] * np.cos(slew)[:, None] - columns[:, 0] * np.sin(slew)[:, None]
    # A cell column's radius is that of its nearest corner; it is below the jib if it is within the jib's width.
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
