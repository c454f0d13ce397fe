"""The positions of the vertical lines of a cell, along which the interior is measured."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

SAMPLES = 16
"""Vertical lines per cell."""

# One line in each of 16 strips in x, in each of 16 strips in y, and in each of the 4 x 4 blocks: a "rotated grid". It
# measures a wall along an axis to 1/16 of a cell, a plain 4 x 4 grid to 1/4. Found by complete search over the patterns
# that a quarter turn maps to themselves, for the largest minimum distance.
_STRIPS = (2, 6, 15, 11, 3, 7, 14, 10, 5, 1, 8, 12, 4, 0, 9, 13)

# Faces of buildings lie on round numbers. Each line is offset from the middle of its strip by an odd amount (in 2^-20
# of a cell), so that it does not run along such faces. The half step of the lattice (2^-25 of a cell) keeps every line
# off every vertex, so there are no ties.
_OFFSETS = (1237, -2411, 3083, -1699, 2777, -3301, 1511, -2053)


def _position(strip: int) -> float:
    mirrored = strip >= SAMPLES // 2
    at = min(strip, SAMPLES - 1 - strip)
    value = (at + 0.5) / SAMPLES + _OFFSETS[at] / 2.0**20 + 2.0**-25
    return 1.0 - value if mirrored else value


_LINES = np.array([(_position(x), _position(y)) for x, y in enumerate(_STRIPS)]).T.copy()


def sample_lines() -> NDArray[np.float64]:
    """Return the (2, 16) float64 positions, x and y, in the unit square; a quarter turn about its centre permutes them.

    Do not write to the array.
    """
    return _LINES
