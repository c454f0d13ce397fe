"""A motion as a few keyframes; page and animation interpolate linearly between them."""

from __future__ import annotations

import itertools
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
    chosen = set(np.r_[0, fixed, len(times) - 1].tolist())
    spans = list(itertools.pairwise(sorted(chosen)))
    while spans:
        low, high = spans.pop()
        if high - low < 2:
            continue
        inside = slice(low + 1, high)
        share = (times[inside] - times[low]) / (times[high] - times[low])
        straight = to_points(values[low] + share[:, None] * (values[high] - values[low]))
        off = np.linalg.norm(straight - points[inside], axis=1)
        worst = int(np.argmax(off))
        if off[worst] > tolerance or np.abs(values[high] - values[low]).max() > longest:
            middle = low + 1 + worst if off[worst] > tolerance else (low + high) // 2
            chosen.add(middle)
            spans += [(low, middle), (middle, high)]
    return np.array(sorted(chosen), np.int64)
