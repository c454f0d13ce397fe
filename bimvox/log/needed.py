"""Which samples of a motion viewers need: a straight line between two of them stays close to those in between."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import leaf_kernel
from bimvox.units import NS_PER_S

OFF_M = 0.01
"""How far what is shown may be from the motion between two shown samples, in each coordinate of hook and load."""
OFF_QUATERNION = 1e-3
"""The same for each component of a quaternion: about 0.1 degrees."""
APART_S = 2.0
"""Shown samples with others in between are at most this far apart."""


def needed(
    time_ns: NDArray[np.int64],
    values: NDArray[np.float64],
    limits: NDArray[np.float64],
    always_ns: NDArray[np.int64],
) -> NDArray[np.bool_]:
    """Return (N,) which samples are needed: the first, the last, and after each the last one that a line may reach.

    Args:
        time_ns: (N,) int64 times, ascending.
        values: (N, K) float64.
        limits: (K,) how far a line between two needed samples may be from the values of those in between.
        always_ns: (M,) int64 times at which a sample is needed in any case.
    """
    keep = np.isin(time_ns, always_ns)
    if len(keep):
        keep[0] = keep[-1] = True
        time_s = (time_ns - time_ns[0]) / NS_PER_S
        low, high = np.empty_like(limits), np.empty_like(limits)
        _keep_needed(time_s, np.ascontiguousarray(values), limits, APART_S, (low, high), keep)
    return keep


@leaf_kernel
def _keep_needed(
    time_s: NDArray[np.float64],
    values: NDArray[np.float64],
    limits: NDArray[np.float64],
    apart_s: float,
    slopes: tuple[NDArray[np.float64], NDArray[np.float64]],
    keep: NDArray[np.bool_],
) -> None:
    """Set ``keep`` where a sample is needed; ``slopes`` is room for the slopes that a line may have."""
    low, high = slopes
    first = 0
    low[:] = -np.inf
    high[:] = np.inf
    for at in range(1, len(time_s)):
        step_s = time_s[at] - time_s[first]
        reaches = at == first + 1 or step_s <= apart_s
        for column in range(len(limits)):
            slope = (values[at, column] - values[first, column]) / step_s
            reaches = reaches and low[column] <= slope <= high[column]
        if not reaches:
            keep[at - 1] = True
            first = at - 1
            low[:] = -np.inf
            high[:] = np.inf
            step_s = time_s[at] - time_s[first]
        if keep[at]:
            first = at
            low[:] = -np.inf
            high[:] = np.inf
            continue
        for column in range(len(limits)):
            slope, room = (values[at, column] - values[first, column]) / step_s, limits[column] / step_s
            low[column] = max(low[column], slope - room)
            high[column] = min(high[column], slope + room)
