"""When a plan may end if its times are uncertain: by simulation in the order of the plan."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from bimvox.site.config.uncertainty import UncertaintyConfig
from bimvox.site.work import Work

PERCENTILES = (50, 80, 95)
_AT_ONCE = 64


def added_ns(uncertainty: UncertaintyConfig, lifts: Mapping[Work, Sequence[int]]) -> tuple[int, ...]:
    """Return the working time that the plan takes longer at each of ``PERCENTILES``; negative if it takes less.

    Each lift draws its own factor, triangular between the smallest and the largest of its class; the lifts follow each
    other, so their times add up.

    Args:
        uncertainty: The factors by class.
        lifts: Times of the lifts, ns, by class.
    """
    random = np.random.default_rng(uncertainty.seed)
    total: NDArray[np.float64] = np.zeros(uncertainty.samples)
    for work in Work:
        factors: tuple[float, float, float] | None = getattr(uncertainty, work.value)
        times = np.array(lifts.get(work, ()), np.float64)
        if factors is None or not len(times):
            continue
        low, likely, high = factors
        if low == high:
            total += (low - 1.0) * times.sum()
            continue
        for first in range(0, len(times), _AT_ONCE):
            own = times[first : first + _AT_ONCE]
            total += (random.triangular(low, likely, high, (len(total), len(own))) - 1.0) @ own
    return tuple(int(value) for value in np.percentile(total, PERCENTILES))
