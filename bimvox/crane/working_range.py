"""Settings of the crane's limiters on a site: working range and slow zones.

A hook column is within the range if its whole cell is, so the hook never leaves the range between two columns.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi, sin
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.errors import InputError

_ROUNDING_RAD = 1e-9
"""A full turn from an angle to that angle plus 2 pi may differ from 2 pi by rounding."""


@dataclass(frozen=True, slots=True)
class WorkingRange:
    """Working area limitation of the hook (EN 17076).

    Attributes:
        slew_rad: First and last slew angle, counter-clockwise; None: the full circle.
        radius_m: Smallest and largest radius; None: the machine's.
        highest_hook_m: Highest hook above the site's z = 0; None: the machine's.

    Raises:
        InputError: If a range is empty.
    """

    slew_rad: tuple[float, float] | None = None
    radius_m: tuple[float, float] | None = None
    highest_hook_m: float | None = None

    def __post_init__(self) -> None:
        """Raise an error for an empty range."""
        if self.slew_rad is not None and not 0.0 < self.slew_rad[1] - self.slew_rad[0] <= 2.0 * pi + _ROUNDING_RAD:
            raise InputError(
                f"slewing range from {self.slew_rad[0]:g} to {self.slew_rad[1]:g} rad",
                hint="it goes counter-clockwise from the first angle to the second, at most one full turn",
            )
        if self.radius_m is not None and not 0.0 <= self.radius_m[0] < self.radius_m[1]:
            raise InputError(
                f"radius range from {self.radius_m[0]:g} to {self.radius_m[1]:g} m",
                hint="give the smallest radius, then the largest",
            )


UNLIMITED = WorkingRange()
"""No limiters."""


@dataclass(frozen=True, slots=True)
class SlowZone:
    """An area over which all axes are slower.

    Attributes:
        polygon: (x, y) corners, site metres.
        share: Share of the axes' highest rates, 0..1.
    """

    polygon: tuple[tuple[float, float], ...]
    share: float


def columns_in_range(
    given: WorkingRange,
    base_m: tuple[float, float, float],
    origin_m: tuple[float, float, float],
    voxel_size_m: float,
    shape: tuple[int, int],
) -> NDArray[np.bool_]:
    """Return the (X, Y) columns that are within the range of slew and radius at all of their points.

    They are if their four corners are, unless a sector without slewing, narrower than a column, lies between these.

    Args:
        given: The range.
        base_m: Foot of the slewing axis.
        origin_m: Lowest corner of the grid.
        voxel_size_m: Edge of a cell.
        shape: Number of columns.
    """
    x = origin_m[0] - base_m[0] + voxel_size_m * np.arange(shape[0] + 1)
    y = origin_m[1] - base_m[1] + voxel_size_m * np.arange(shape[1] + 1)
    dx, dy = np.meshgrid(x, y, indexing="ij")
    good = np.ones((shape[0] + 1, shape[1] + 1), np.bool_)
    if given.radius_m is not None:
        radius = np.hypot(dx, dy)
        good &= (radius >= given.radius_m[0] - 1e-9) & (radius <= given.radius_m[1] + 1e-9)
    if given.slew_rad is not None:
        low, high = given.slew_rad
        good &= np.remainder(np.arctan2(dy, dx) - low + 1e-9, 2.0 * pi) <= high - low + 2e-9
    every: NDArray[np.bool_] = np.logical_and.reduce(_corners(good))
    if given.slew_rad is not None and given.slew_rad[1] - given.slew_rad[0] < 2.0 * pi - _ROUNDING_RAD:
        for angle in given.slew_rad:
            aside, ahead = _corners(dx * sin(angle) - dy * cos(angle)), _corners(dx * cos(angle) + dy * sin(angle))
            every &= ~((aside.min(axis=0) < -1e-9) & (aside.max(axis=0) > 1e-9) & (ahead.max(axis=0) > 0.0))
    return every


def _corners(of: NDArray[Any]) -> NDArray[Any]:
    """Return (4, X, Y) the values at the corners of each column."""
    return np.stack([of[:-1, :-1], of[1:, :-1], of[:-1, 1:], of[1:, 1:]])
