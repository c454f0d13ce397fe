"""A move of the crane from rest to rest along one known line, and how fast it may be driven.

Along a joint line the axes keep their ratio; along a site line the hook goes straight in the site's frame (last moves
sideways in contact); along an arc it follows the head of a component that is upended about its foot.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import inline_kernel, leaf_kernel
from bimvox.crane.axis_limits import AxisLimits
from bimvox.crane.axis_numbers import AxisNumbers, axis_numbers
from bimvox.crane.bound import least_time_s, rest_to_rest_s
from bimvox.crane.luffing import luffing_limits
from bimvox.crane.tower_crane import CranePose, TowerCrane
from bimvox.motion.curve_limits import curve_limits

AXES = 3


class Line(StrEnum):
    """The line that the hook follows."""

    JOINT = "joint"
    """Straight in (slew, radius, height)."""
    SITE = "site"
    """Straight in the site's frame."""
    ARC = "arc"
    """A quarter of an ellipse in a vertical plane: off horizontally, turning upright, at rest above the foot."""


LINES = tuple(Line)
"""The lines as kernels number them."""


@dataclass(frozen=True, slots=True)
class Move:
    """A move from rest to rest.

    Attributes:
        start: Where it starts.
        end: Where it ends; the slewing angle is unwrapped, so that the difference has the direction.
        line: The line that the hook follows.
        least_s: It takes this long or longer: a crew guides the load meanwhile.
    """

    start: CranePose
    end: CranePose
    line: Line = Line.JOINT
    least_s: float = 0.0

    @property
    def difference(self) -> tuple[float, float, float]:
        """Slew (rad), radius (m) and height (m) from start to end."""
        return (
            self.end.slew_rad - self.start.slew_rad,
            self.end.radius_m - self.start.radius_m,
            self.end.height_m - self.start.height_m,
        )

    @property
    def moving(self) -> tuple[bool, bool, bool]:
        """Which axes move (slewing, trolley, hoist); along a site line or an arc slewing and trolley always count."""
        slew, radius, height = (difference != 0.0 for difference in self.difference)
        flat = self.line is not Line.JOINT
        return (slew or flat, radius or flat, height)

    @property
    def swings(self) -> bool:
        """Whether it moves the load sideways; a part that is being upended stands on its foot."""
        return not self.is_vertical and self.line is not Line.ARC

    @property
    def is_vertical(self) -> bool:
        """Whether only the hoist moves."""
        return self.moving == (False, False, True)


def axes_along(crane: TowerCrane, move: Move, share: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the axes at (N,) shares of a move, 0 at its start and 1 at its end; for an arc the share of the angle.

    Returns:
        (N, 3) float64 slew (rad, unwrapped), radius (m), height (m).
    """
    axes = np.empty((len(share), AXES))
    x_m, y_m, _ = crane.base_m
    write_along(axes, share, np.array([axes_of(move.start), axes_of(move.end)]), LINES.index(move.line), x_m, y_m)
    return axes


@leaf_kernel
def write_along(
    axes: NDArray[np.float64],
    shares: NDArray[np.float64],
    ends: NDArray[np.float64],
    line: int,
    x_m: float,
    y_m: float,
) -> None:
    """Write what ``axes_along`` returns to axes ((N, 3)).

    Args:
        axes: The axes.
        shares: (N,) the shares.
        ends: (2, 3) slew, radius and height at start and end.
        line: The line, its place in ``LINES``.
        x_m: The slewing axis.
        y_m: The slewing axis.
    """
    if line == 0:
        for i in range(shares.shape[0]):
            for k in range(3):
                axes[i, k] = ends[0, k] + shares[i] * (ends[1, k] - ends[0, k])
        return
    slew = ends[0, 0]
    x0, y0 = x_m + ends[0, 1] * np.cos(slew), y_m + ends[0, 1] * np.sin(slew)
    x1, y1 = x_m + ends[1, 1] * np.cos(ends[1, 0]), y_m + ends[1, 1] * np.sin(ends[1, 0])
    z0, z1 = ends[0, 2], ends[1, 2]
    for i in range(shares.shape[0]):
        if line == 1:
            u = shares[i]
            x, y, z = x0 + u * (x1 - x0), y0 + u * (y1 - y0), z0 + u * (z1 - z0)
        else:
            cos, sin = np.cos(shares[i] * (np.pi / 2.0)), np.sin(shares[i] * (np.pi / 2.0))
            x, y, z = x1 + cos * (x0 - x1), y1 + cos * (y0 - y1), z0 + sin * (z1 - z0)
        # Neither line goes around the mast, so the hook always takes the short way from the start.
        turned = np.arctan2(y - y_m + 0.0, x - x_m) - slew + np.pi
        axes[i, 0] = slew + turned - 2.0 * np.pi * np.floor(turned / (2.0 * np.pi)) - np.pi
        axes[i, 1] = np.hypot(x - x_m, y - y_m)
        axes[i, 2] = z


def share_limits(crane: TowerCrane, move: Move) -> AxisLimits:
    """Return the limits on the share driven (1/s, 1/s^2, 1/s^3) under which no axis of the crane exceeds its own.

    Along a joint line they are exact; along a curved line they are those of ``curve_limits``.
    """
    if move.line is Line.JOINT:
        return _joint_limits(crane, move.start, move.end)
    ends = np.array([axes_of(move.start), axes_of(move.end)])
    return AxisLimits(*curve_limits(axis_numbers(crane), ends, move.line is Line.ARC))


def _joint_limits(crane: TowerCrane, start: CranePose, end: CranePose) -> AxisLimits:
    return AxisLimits(*_line_limits(axis_numbers(crane), axes_of(start), axes_of(end)))


@inline_kernel
def _line_limits(axes: AxisNumbers, start: NDArray[np.float64], end: NDArray[np.float64]) -> tuple[float, float, float]:
    """Return rate, acceleration and jerk of the share driven between two poses ((3,) axes); infinite at rest."""
    radial = axes.trolley
    if axes.luffs:  # its limits depend on the radius
        radial = luffing_limits(axes.luffing, min(start[1], end[1]), max(start[1], end[1]))
    rate, acceleration, jerk = np.inf, np.inf, np.inf
    for axis, limits in enumerate((axes.slewing, radial, axes.hoist)):
        if start[axis] != end[axis]:
            travel = abs(end[axis] - start[axis])
            rate = min(rate, limits[0] / travel)
            acceleration = min(acceleration, limits[1] / travel)
            jerk = min(jerk, limits[2] / travel)
    return rate, acceleration, jerk


@inline_kernel
def line_time_s(axes: AxisNumbers, start: NDArray[np.float64], end: NDArray[np.float64]) -> float:
    """Return the shortest time along a joint line between two poses ((3,) axes), from rest to rest; 0 at rest."""
    rate, acceleration, jerk = _line_limits(axes, start, end)
    return 0.0 if rate == np.inf else least_time_s(1.0, rate, acceleration, jerk)


def slowed(limits: AxisLimits, share: float) -> AxisLimits:
    """Return limits with a share of their rate."""
    return limits if share == 1.0 else replace(limits, rate=limits.rate * share)


def no_shorter(limits: AxisLimits, least_s: float) -> AxisLimits:
    """Return limits on the share driven under which a move from rest to rest takes no less than a time."""
    pace = min(1.0, rest_to_rest_s(1.0, limits) / least_s) if least_s > 0.0 else 1.0
    if pace == 1.0:
        return limits
    return AxisLimits(limits.rate * pace, limits.acceleration * pace**2, limits.jerk * pace**3)


def move_time_s(crane: TowerCrane, move: Move) -> float:
    """Return the shortest time of a move from rest to rest; 0 if nothing moves."""
    if move.line is Line.JOINT:
        return float(line_time_s(axis_numbers(crane), axes_of(move.start), axes_of(move.end)))
    return rest_to_rest_s(1.0, share_limits(crane, move))


def axes_of(pose: CranePose) -> NDArray[np.float64]:
    """(3,) float64 slew, radius, height."""
    return np.array([pose.slew_rad, pose.radius_m, pose.height_m])
