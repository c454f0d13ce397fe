"""Keep numbers small: a model far from its origin is read relative to a whole-metre point near it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

FAR_M = 1000.0
"""A model that lies wholly beyond this distance along an axis gets a local origin on that axis."""


def local_origin(bounds_m: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Return the (3,) whole-metre point to subtract, zeros for a model near its origin.

    Whole metres, so that a lattice of cells that divide a metre is not shifted. Each axis is judged alone: a
    georeferenced model usually is far in x and y, and its heights stay as drawn.

    Args:
        bounds_m: (2, 3) boxes of the elements, lowest and highest corner.
    """
    if not bounds_m:
        return np.zeros(3)
    low = np.min([box[0] for box in bounds_m], axis=0)
    high = np.max([box[1] for box in bounds_m], axis=0)
    far = (low > FAR_M) | (high < -FAR_M)
    return np.where(far, np.floor(low), 0.0)


def stray(bounds_m: Sequence[NDArray[np.float64]]) -> NDArray[np.int64]:
    """Return the indices of boxes whose centre lies more than ``FAR_M`` from the median centre."""
    centres = np.array([box.mean(axis=0) for box in bounds_m]).reshape(-1, 3)
    if not len(centres):
        return np.zeros(0, dtype=np.int64)
    distance = np.linalg.norm(centres - np.median(centres, axis=0), axis=1)
    return np.flatnonzero(distance > FAR_M)
