"""A motion as a few keyframes; the page interpolates linearly in the crane's axes."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray

TOLERANCE_M = 0.01
"""Maximum deviation of the page from the log's samples."""

Floats = NDArray[np.float64]


def keyframes(
    time_ns: NDArray[np.int64],
    values: Floats,
    always_ns: Iterable[int],
    to_points_m: Callable[[Floats], Floats],
    tolerance_m: float = TOLERANCE_M,
) -> NDArray[np.int64]:
    """Return samples such that linear interpolation between them stays within a tolerance of all samples.

    Args:
        time_ns: (N,) ascending times.
        values: (N, C) what is interpolated.
        always_ns: Times whose samples are always chosen.
        to_points_m: Maps (..., C) values to (..., 3) points in metres, where the tolerance applies.
        tolerance_m: The tolerance.

    Returns:
        (K,) int64 ascending indices, including the first and the last sample.
    """
    points_m = to_points_m(values)
    fixed = np.searchsorted(time_ns, [t for t in always_ns if time_ns[0] <= t <= time_ns[-1]])
    chosen = set(np.r_[0, fixed, len(time_ns) - 1].tolist())
    borders = sorted(chosen)
    spans = list(itertools.pairwise(borders))
    while spans:
        low, high = spans.pop()
        if high - low < 2:
            continue
        inside = slice(low + 1, high)
        share = (time_ns[inside] - time_ns[low]) / (time_ns[high] - time_ns[low])
        straight = to_points_m(values[low] + share[:, None] * (values[high] - values[low]))
        off_m = np.linalg.norm(straight - points_m[inside], axis=1)
        worst = int(np.argmax(off_m))
        if off_m[worst] > tolerance_m:
            middle = low + 1 + worst
            chosen.add(middle)
            spans += [(low, middle), (middle, high)]
    return np.array(sorted(chosen), np.int64)
