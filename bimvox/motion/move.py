"""A move of the crane from rest to rest along one known line, and how fast it may be driven.

Along a joint line the axes keep their ratio; along a site line the hook goes straight in the site's frame (last moves
sideways in contact); along an arc it follows the head of a component that is upended about its foot.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import inline_kernel, kernel, leaf_kernel
from bimvox.crane.kinematics import AxisNumbers, axis_numbers, hook_of
from bimvox.crane.reach import distance_to_polygon_m
from bimvox.crane.tower_crane import AxisLimits, CranePose, TowerCrane, luffing_limits
from bimvox.crane.travel import least_time_s, rest_to_rest_s

# How fast the share of a curved line may be driven: by each axis's derivatives at points of the line.
#
# With q(u) an axis along the line and u(t) the share driven, the axis has the rate q' u', the acceleration q' u'' + q''
# u'^2 and the jerk q' u''' + 3 q'' u' u'' + q''' u'^3.

_POINTS = 65
"""Points of a line at which its derivatives are taken."""
_MARGIN = 1.005
"""Between two of these points an axis takes less than this multiple of what it takes at them."""
_NEAREST_M = 1e-3
"""A line is taken to be no nearer to the slewing axis."""
_ROUNDS, _STEPS, _FIRST, _APART = 3, 9, -1.5, 0.375
"""Rounds of the search, rates and accelerations tried in each, the middle of the first round and its steps: logarithms
of the rate as a share of the highest, and of the acceleration as a share of what the rate leaves."""


@kernel
def _curve_limits(limits: AxisNumbers, ends: NDArray[np.float64], is_arc: bool) -> tuple[float, float, float]:
    """Return rate, acceleration and jerk of the share under which no axis exceeds its limits and a move is quickest.

    A rate leaves some acceleration, and both leave some jerk: those are taken with which the move from rest to rest
    takes the least time.

    ``limits``: the crane's; ``ends``: (2, 3) slew, radius and height at start and end; ``is_arc``: whether the line is
    an arc; otherwise it is straight in the site's frame.
    """
    terms = np.empty((6, 3 * _POINTS))
    _write_terms(terms, _derivatives(ends, is_arc), limits)
    # The highest rate, if nothing is left for acceleration and jerk.
    first, second, third = max(terms[0].max(), 1e-30), max(terms[2].max(), 1e-30), max(terms[5].max(), 1e-30)
    most = min(1.0 / first, 1.0 / np.sqrt(second), 1.0 / np.cbrt(third))
    best_s, rate, acceleration, jerk = np.inf, 0.0, 0.0, 0.0
    middle_v, middle_a, apart = _FIRST, _FIRST, _APART
    for _ in range(_ROUNDS):
        first_v, first_a = middle_v - apart * (_STEPS // 2), middle_a - apart * (_STEPS // 2)
        for i in range(_STEPS):
            log_v = min(first_v + apart * i, 0.0)
            v = most * np.exp(log_v)
            if v * best_s <= 1.0:
                continue
            left = _left(terms, 1, v * v, 0.0)
            if left <= 0.0:
                continue
            for k in range(_STEPS):
                log_a = min(first_a + apart * k, 0.0)
                a = left * np.exp(log_a)
                if a * best_s**2 <= 4.0:  # too slow, whatever the jerk
                    continue
                j = _left(terms, 3, 3.0 * v * a, v**3)
                if j <= 0.0:
                    break
                time_s = least_time_s(1.0, v, a, j)
                if time_s < best_s:
                    best_s, rate, acceleration, jerk, middle_v, middle_a = time_s, v, a, j, log_v, log_a
        apart *= 0.25
    return rate, acceleration, jerk


@leaf_kernel
def _left(terms: NDArray[np.float64], row: int, second: float, third: float) -> float:
    """Return what the limits of acceleration (row 1) or jerk (row 3) leave for q', given the factors of the others."""
    left = np.inf
    for n in range(terms.shape[1]):
        if terms[row, n] > 0.0:
            taken = terms[row + 1, n] * second
            if third > 0.0:
                taken += terms[5, n] * third
            left = min(left, (1.0 - taken) / terms[row, n])
    return left


@leaf_kernel
def _write_terms(terms: NDArray[np.float64], derivatives: NDArray[np.float64], limits: AxisNumbers) -> None:
    """Write the shares of each axis's limits that its derivatives take at points of a line.

    ``terms``: (6, 3 N): those of q' of the rate; q' and q'' of the acceleration; all three of the jerk;
    ``derivatives``: as ``_derivatives`` returns them; ``limits``: the crane's.
    """
    points = derivatives.shape[0]
    radial = limits.trolley
    if limits.luffs:
        nearest_m, furthest_m = np.inf, 0.0
        for n in range(points):
            nearest_m, furthest_m = min(nearest_m, derivatives[n, 3, 0]), max(furthest_m, derivatives[n, 3, 0])
        radial = luffing_limits(limits.luffing, nearest_m, furthest_m)
    for axis, (rate, acceleration, jerk) in enumerate((limits.slewing, radial, limits.hoist)):
        for n in range(points):
            at = axis * points + n
            first, second = _MARGIN * abs(derivatives[n, axis, 0]), _MARGIN * abs(derivatives[n, axis, 1])
            third = _MARGIN * abs(derivatives[n, axis, 2])
            terms[0, at] = first / rate
            terms[1, at], terms[2, at] = first / acceleration, second / acceleration
            terms[3, at], terms[4, at], terms[5, at] = first / jerk, second / jerk, third / jerk


@kernel
def _derivatives(ends: NDArray[np.float64], is_arc: bool) -> NDArray[np.float64]:
    """Return (N, 4, 3) q', q'' and q''' of slew, radius and height by the share, and the radius, at points of a line.

    On the plan the hook is at the complex number p = r exp(i slew), so that (ln p)' = r' / r + i slew'.
    """
    result, quarter = np.empty((_POINTS, 4, 3)), np.pi / 2.0
    start = ends[0, 1] * np.exp(1j * ends[0, 0])
    way = ends[1, 1] * np.exp(1j * ends[1, 0]) - start
    rise = ends[1, 2] - ends[0, 2]
    length_m = max(abs(way), 1e-9)
    foot = start * way.conjugate() / length_m
    aside_m = max(abs(foot.imag), _NEAREST_M)
    first, last = np.arctan2(foot.real, aside_m), np.arctan2(foot.real + length_m, aside_m)
    for n in range(_POINTS):
        part = n / (_POINTS - 1)
        if n % 2 == 0:  # at equal steps of the slewing angle
            share = (aside_m * np.tan(first + part * (last - first)) - foot.real) / length_m
            part = min(max(share, 0.0), 1.0)
            if is_arc:
                part = np.arccos(1.0 - part) / quarter
        if is_arc:
            cos, sin = np.cos(part * quarter), np.sin(part * quarter)
            p, p1 = start + (1.0 - cos) * way, quarter * sin * way
            p2, p3 = quarter**2 * cos * way, -(quarter**3) * sin * way
            z1, z2, z3 = quarter * cos * rise, -(quarter**2) * sin * rise, -(quarter**3) * cos * rise
        else:
            p, p1, p2, p3 = start + part * way, way, 0.0 * way, 0.0 * way
            z1, z2, z3 = rise, 0.0, 0.0
        r = max(abs(p), _NEAREST_M)
        w1 = p1 * p.conjugate() / r**2
        w2 = p2 * p.conjugate() / r**2 - w1 * w1
        w3 = p3 * p.conjugate() / r**2 - 3.0 * w1 * w2 - w1 * w1 * w1
        a, b, c = w1.real, w2.real, w3.real
        result[n, 0, 0], result[n, 0, 1], result[n, 0, 2] = w1.imag, w2.imag, w3.imag
        result[n, 1, 0], result[n, 1, 1], result[n, 1, 2] = r * a, r * (b + a * a), r * (c + 3.0 * a * b + a**3)
        result[n, 2, 0], result[n, 2, 1], result[n, 2, 2] = z1, z2, z3
        result[n, 3, 0] = r
    return result


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

    Returns (N, 3) float64 slew (rad, unwrapped), radius (m), height (m).
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

    Along a joint line they are exact; along a curved line they are those of ``_curve_limits``.
    """
    if move.line is Line.JOINT:
        return AxisLimits(*_line_limits(axis_numbers(crane), axes_of(move.start), axes_of(move.end)))
    ends = np.array([axes_of(move.start), axes_of(move.end)])
    return AxisLimits(*_curve_limits(axis_numbers(crane), ends, move.line is Line.ARC))


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


def move_time_s(crane: TowerCrane, move: Move) -> float:
    """Return the shortest time of a move from rest to rest; 0 if nothing moves."""
    if move.line is Line.JOINT:
        return float(line_time_s(axis_numbers(crane), axes_of(move.start), axes_of(move.end)))
    return rest_to_rest_s(1.0, share_limits(crane, move))


def axes_of(pose: CranePose) -> NDArray[np.float64]:
    """(3,) float64 slew, radius, height."""
    return np.array([pose.slew_rad, pose.radius_m, pose.height_m])


_SPACING_M = 0.5
_NEAR_M = 1.0
"""Distance from a zone that counts as over it: half the spacing, and room for rounded corners."""


def _slow_share(crane: TowerCrane, move: Move) -> float:
    """Return the share of the axes' highest rates that a move may use; 1 if no slow zone is near."""
    if not crane.slow_zones:
        return 1.0
    slew, radius, _ = (abs(difference) for difference in move.difference)
    travel_m = slew * max(move.start.radius_m, move.end.radius_m) + radius
    count = 2 + int(np.ceil(travel_m * 2.0 / _SPACING_M))
    axes = axes_along(crane, move, np.linspace(0.0, 1.0, count))
    points_m = hook_of(crane, *axes.T)[:, :2]
    shares = [
        zone.share
        for zone in crane.slow_zones
        if float(distance_to_polygon_m(points_m, np.array(zone.polygon)).min()) <= _NEAR_M
    ]
    return min(shares, default=1.0)


def slow_shares(crane: TowerCrane, moves: Sequence[Move]) -> list[float]:
    """Return the share of each move of a motion; a move is as slow as its neighbours, since corners may be rounded."""
    own = [_slow_share(crane, move) for move in moves]
    return [min(own[max(0, i - 1) : i + 2]) for i in range(len(own))]
