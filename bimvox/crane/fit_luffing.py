"""The luffing jib in the choice of a base: height of its pivot, height of its hook, and what it would touch."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.crane.jib_map import jib_blocked
from bimvox.crane.luffing import LuffingJib, tip_height_m
from bimvox.crane.reach import LUFFING_HOOK_ROOM_M
from bimvox.crane.rigging import with_luffing_jib
from bimvox.crane.tower_crane import TowerCrane


class BuiltHeights(NamedTuple):
    """Height map of the finished building.

    Attributes:
        origin_m: Lowest corner on plan.
        size_m: Edge of a column, and height of a step.
        top: (X, Y) int32 height of each column, in steps above z = 0.
    """

    origin_m: tuple[float, float]
    size_m: float
    top: NDArray[np.int32]


def built_heights(boxes_m: ArrayLike, size_m: float = 0.5) -> BuiltHeights:
    """Return the height map of boxes ((N, 2, 3) lowest and highest corners)."""
    boxes = np.asarray(boxes_m, np.float64).reshape(-1, 2, 3)
    low = np.floor(boxes[:, 0, :2].min(axis=0) / size_m).astype(int)
    first = np.floor(boxes[:, 0, :2] / size_m + 1e-6).astype(int) - low
    last = np.maximum(np.ceil(boxes[:, 1, :2] / size_m - 1e-6).astype(int) - low, first + 1)
    heights = np.maximum(np.ceil(boxes[:, 1, 2] / size_m - 1e-6), 0).astype(np.int32)
    top = np.zeros(last.max(axis=0), np.int32)
    for (i, j), (k, n), height in zip(first.tolist(), last.tolist(), heights.tolist(), strict=True):
        np.maximum(top[i:k, j:n], height, out=top[i:k, j:n])
    return BuiltHeights((float(low[0] * size_m), float(low[1] * size_m)), size_m, top)


def pivoted(crane: TowerCrane, jib: LuffingJib, height_under_hook_m: float) -> TowerCrane:
    """Return a luffing tower crane on a mast so high that jib and counterweight slew above everything.

    A mobile crane is returned unchanged.
    """
    if crane.kind == "mobile":
        return crane
    below_m = jib.pivot_height_m - jib.tail_low_m
    low_m = float(np.ceil(2.0 * height_under_hook_m) / 2.0)
    return with_luffing_jib(crane, replace(jib, pivot_height_m=low_m + below_m, tail_low_m=low_m))


def highest_hooks_m(jib: LuffingJib, radii_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the highest hook at radii, metres; -inf beyond the jib's reach."""
    high = tip_height_m(jib, radii_m) - LUFFING_HOOK_ROOM_M
    low_m, far_m = jib.radii_m
    return np.where((radii_m >= low_m) & (radii_m <= far_m), high, -np.inf)


def points_blocked(crane: TowerCrane, jib: LuffingJib, points_m: NDArray[np.float64], built: BuiltHeights) -> int:
    """Return at how many of (N, 2) points the finished building blocks the jib."""
    size = built.size_m
    blocked = jib_blocked(
        jib,
        crane.base_m,
        (*built.origin_m, 0.0),
        size,
        built.top,
        crane.mast_size_m / 2.0,
        (max(0.0, crane.min_radius_m), crane.jib_length_m),
    )
    cells = np.floor((points_m - np.array(built.origin_m)) / size).astype(int)
    inside = ((cells >= 0) & (cells < blocked.shape)).all(axis=1)
    return int(blocked[tuple(cells[inside].T)].sum())
