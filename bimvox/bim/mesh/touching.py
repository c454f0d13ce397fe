"""Group boxes that touch, for triangle soups with very many loose pieces."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel


def touching_groups(low_m: NDArray[np.float64], high_m: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return, for each of N boxes, the lowest box that it is connected to through boxes that touch.

    Args:
        low_m: (N, 3) lowest corners.
        high_m: (N, 3) highest corners.
    """
    # Sweeps along the longest axis, where a box meets the fewest others.
    sweep = int(np.argmax(high_m.max(axis=0) - low_m.min(axis=0)))
    order = np.argsort(low_m[:, sweep], kind="stable")
    return _groups(low_m[order], high_m[order], order, sweep)


@kernel
def _groups(
    low_m: NDArray[np.float64], high_m: NDArray[np.float64], order: NDArray[np.int64], sweep: int
) -> NDArray[np.int64]:
    """Return the groups of boxes sorted by their low side: compares each with those that begin before it ends."""
    count = len(order)
    root = np.arange(count)
    for one in range(count):
        for other in range(one + 1, count):
            if low_m[other, sweep] > high_m[one, sweep]:
                break
            touch = True
            for axis in range(3):
                touch = touch and low_m[one, axis] <= high_m[other, axis] and low_m[other, axis] <= high_m[one, axis]
            if not touch:
                continue
            a, b = order[one], order[other]
            while root[a] != a:
                root[a] = root[root[a]]
                a = root[a]
            while root[b] != b:
                root[b] = root[root[b]]
                b = root[b]
            root[max(a, b)] = min(a, b)
    for box in range(count):
        while root[box] != root[root[box]]:
            root[box] = root[root[box]]
    return root
