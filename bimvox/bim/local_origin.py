"""The local origin: a whole-metre point near a model that is far from the file's origin; it keeps numbers small."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

FAR_M = 1000.0
"""A model that is entirely beyond this distance along an axis gets a local origin on that axis."""


def local_origin(bounds_m: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Return the (3,) whole-metre point to subtract; zeros for a model near its origin.

    Whole metres do not shift a lattice whose cells divide a metre. Each axis is judged separately: a georeferenced
    model is usually far away in x and y, and its heights stay as modelled.

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
    """Return the indices of boxes whose centre is more than ``FAR_M`` from the median centre."""
    centres = np.array([box.mean(axis=0) for box in bounds_m]).reshape(-1, 3)
    if not len(centres):
        return np.zeros(0, dtype=np.int64)
    distance = np.linalg.norm(centres - np.median(centres, axis=0), axis=1)
    return np.flatnonzero(distance > FAR_M)
