"""Prioritized replay: transitions with larger errors are drawn more often (Schaul et al. 2016)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

LEAST_ERROR = 0.01
"""Added to every error, so that a transition without error is still drawn sometimes."""


class Priorities:
    """The shares by which the rows of a memory are drawn.

    Args:
        rows: Of the memory.
        exponent: 0 draws evenly, 1 in proportion to the error.
    """

    def __init__(self, rows: int, exponent: float) -> None:
        self._exponent = exponent
        self._shares = np.zeros(rows, np.float64)
        self._filled = 0

    def fill(self, filled: int, latest: slice) -> None:
        """Give new rows the greatest share of all, because their errors are unknown.

        Args:
            filled: Number of filled rows.
            latest: The rows written last, new or overwritten.
        """
        greatest = self._shares[: self._filled].max() if self._filled else 1.0
        self._shares[self._filled : filled] = greatest
        self._shares[latest] = greatest
        self._filled = filled

    def draw(self, random: np.random.Generator, steps: int, count: int) -> NDArray[np.int64]:
        """Return (steps, count) rows, drawn with replacement."""
        sums = np.cumsum(self._shares[: self._filled])
        drawn = np.searchsorted(sums, random.random((steps, count)) * sums[-1], side="right")
        return np.asarray(np.minimum(drawn, self._filled - 1), np.int64)

    def importance(self, rows: NDArray[np.int64], beta: float) -> NDArray[np.float32]:
        """Return a weight per row that corrects for uneven drawing: (N p)^-beta, the largest of them 1."""
        shares = self._shares[rows]
        return np.asarray((shares / shares.min()) ** -beta, np.float32)

    def put(self, rows: NDArray[np.int64], errors: NDArray[np.float32]) -> None:
        """Set the shares of some rows from their errors."""
        self._shares[rows] = (errors.astype(np.float64) + LEAST_ERROR) ** self._exponent
