"""A motion as a few keyframes; page and animation interpolate linearly between them."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray

TOLERANCE_M = 0.01
"""Maximum deviation of the page from the log's samples."""

Floats = NDArray[np.float64]


def keyframes(
    times: NDArray[np.integer] | Floats,
    values: Floats,
    always: Iterable[int],
    to_points: Callable[[Floats], Floats],
    tolerance: float = TOLERANCE_M,
    longest: float = np.inf,
) -> NDArray[np.int64]:
    """Return samples such that linear interpolation between them stays within a tolerance of all samples.

    Ramer-Douglas-Peucker over time.

    Args:
        times: (N,) ascending times.
        values: (N, C) what is interpolated.
        always: Times whose samples are always chosen.
        to_points: Maps (..., C) values to (..., D) points, where the tolerance applies.
        tolerance: In the unit of the points.
        longest: Maximum change of a value between two chosen samples. A rotation by more than half a circle would be
            interpolated the other way round.

    Returns:
        (K,) int64 ascending indices, including the first and the last sample.
    """
    points = to_points(values)
    fixed = np.searchsorted(times, [t for t in always if times[0] <= t <= times[-1]])
    chosen = np.unique(np.r_[0, fixed, len(times) - 1].astype(np.int64))
    found, low, high = [chosen], chosen[:-1], chosen[1:]
    while len(low):  # all spans of equal depth at once
        is_wide = high - low > 1
        low, high = low[is_wide], high[is_wide]
        counts = high - low - 1
        first = np.cumsum(counts) - counts
        span = np.repeat(np.arange(len(low)), counts)
        inside = np.arange(len(span)) - first[span] + low[span] + 1
        share = (times[inside] - times[low[span]]) / (times[high[span]] - times[low[span]])
        straight = values[low[span]] + share[:, None] * (values[high[span]] - values[low[span]])
        off = np.linalg.norm(to_points(straight) - points[inside], axis=1)
        most = np.maximum.reduceat(off, first) if len(first) else off
        worst = np.flatnonzero(off == most[span])
        worst = inside[worst[np.searchsorted(worst, first)]]
        is_off = most > tolerance
        parted = is_off | (np.abs(values[high] - values[low]).max(axis=1, initial=0.0) > longest)
        middle = np.where(is_off, worst, (low + high) // 2)[parted]
        found.append(middle)
        low, high = np.concatenate([low[parted], middle]), np.concatenate([middle, high[parted]])
    return np.unique(np.concatenate(found))
