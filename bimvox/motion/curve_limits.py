"""How fast the share of a curved line may be driven: by each axis's derivatives at points of the line.

With q(u) an axis along the line and u(t) the share driven, the axis has the rate q' u', the acceleration
q' u'' + q'' u'^2 and the jerk q' u''' + 3 q'' u' u'' + q''' u'^3.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.crane.axis_numbers import AxisNumbers
from bimvox.crane.bound import least_time_s
from bimvox.crane.luffing import luffing_limits

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
def curve_limits(limits: AxisNumbers, ends: NDArray[np.float64], is_arc: bool) -> tuple[float, float, float]:
    """Return rate, acceleration and jerk of the share under which no axis exceeds its limits and a move is quickest.

    A rate leaves some acceleration, and both leave some jerk: those are taken with which the move from rest to rest
    takes the least time.

    Args:
        limits: The crane's.
        ends: (2, 3) slew, radius and height at start and end.
        is_arc: Whether the line is an arc; otherwise it is straight in the site's frame.
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

    Args:
        terms: (6, 3 N): those of q' of the rate; q' and q'' of the acceleration; all three of the jerk.
        derivatives: As ``_derivatives`` returns them.
        limits: The crane's.
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
    found, quarter = np.empty((_POINTS, 4, 3)), np.pi / 2.0
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
        found[n, 0, 0], found[n, 0, 1], found[n, 0, 2] = w1.imag, w2.imag, w3.imag
        found[n, 1, 0], found[n, 1, 1], found[n, 1, 2] = r * a, r * (b + a * a), r * (c + 3.0 * a * b + a**3)
        found[n, 2, 0], found[n, 2, 1], found[n, 2, 2] = z1, z2, z3
        found[n, 3, 0] = r
    return found
