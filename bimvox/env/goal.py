"""The offset to the goal, as every observation encodes it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import leaf_kernel

GOAL_SIZE = 12
"""Per axis: sign, offset clipped at four cells, logarithm of the offset, share of the Manhattan distance."""

LOG_FARTHEST = float(np.log(1024.0))


@leaf_kernel
def write_goal(dx: int, dy: int, dz: int, out: NDArray[np.float32]) -> None:
    """Write the offset to the goal, ``GOAL_SIZE`` entries: precise nearby, an order of magnitude far away."""
    total = max(1, abs(dx) + abs(dy) + abs(dz))
    for axis, d in enumerate((dx, dy, dz)):
        sign = 1.0 if d > 0 else (-1.0 if d < 0 else 0.0)
        out[axis] = sign
        out[3 + axis] = max(-1.0, min(1.0, d / 4.0))
        out[6 + axis] = sign * min(1.0, np.log(1.0 + abs(d)) / LOG_FARTHEST)
        out[9 + axis] = d / total
