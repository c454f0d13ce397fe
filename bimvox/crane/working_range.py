"""What the crane's own limiters are set to on a site: the working range, and where it slows down.

A hook column is within the range where its whole cell is: between columns the hook is over the cells around it, so it
never leaves the range on its way from one to the other.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

from bimvox.errors import InputError


@dataclass(frozen=True, slots=True)
class WorkingRange:
    """Limits that a limiter holds the hook to (EN 17076: working area limitation).

    Attributes:
        slew_rad: From where to where the jib may turn, counter-clockwise; None: all round.
        radius_m: Smallest and largest radius; None: the machine's.
        highest_hook_m: Highest hook above the site's z = 0; None: the machine's.

    Raises:
        InputError: If a range is empty.
    """

    slew_rad: tuple[float, float] | None = None
    radius_m: tuple[float, float] | None = None
    highest_hook_m: float | None = None

    def __post_init__(self) -> None:
        """Refuse empty ranges."""
        if self.slew_rad is not None and not 0.0 < self.slew_rad[1] - self.slew_rad[0] <= 2.0 * pi:
            raise InputError(
                f"a slewing range from {self.slew_rad[0]:g} to {self.slew_rad[1]:g} rad",
                hint="it goes counter-clockwise from the first angle to the second, at most once round",
            )
        if self.radius_m is not None and not 0.0 <= self.radius_m[0] < self.radius_m[1]:
            raise InputError(
                f"a radius range from {self.radius_m[0]:g} to {self.radius_m[1]:g} m", hint="near, then far"
            )


UNLIMITED = WorkingRange()
"""No limiter is set."""


@dataclass(frozen=True, slots=True)
class SlowZone:
    """An area over which all axes are driven slower.

    Attributes:
        polygon: (x, y) corners, site metres.
        share: Of the axes' highest rates, 0..1.
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
    """Return the (X, Y) columns that lie within the range of slewing and radius with all four corners.

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
    every: NDArray[np.bool_] = good[:-1, :-1] & good[1:, :-1] & good[:-1, 1:] & good[1:, 1:]
    return every
