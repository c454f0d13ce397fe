"""The sub-columns of a cell: where inside its square the vertical lines run that measure the interior."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

SAMPLES = 16
"""Sub-columns of a cell."""

# One sub-column in each of 16 strips in x, in each of 16 strips in y, and in each of the 4 x 4 blocks (a "rotated
# grid", which measures a wall along an axis to a 16th of a cell where a plain 4 x 4 grid measures it to a quarter).
# Found by complete search over the patterns that a quarter turn maps to themselves, for the largest least distance.
_STRIPS = (2, 6, 15, 11, 3, 7, 14, 10, 5, 1, 8, 12, 4, 0, 9, 13)

# Faces of buildings lie on round numbers. Each line is moved off the middle of its strip by an odd amount (in 2^-20 of
# a cell), so that it runs beside such faces, not along them. The half step of the lattice (2^-25 of a cell) keeps every
# line off every vertex: which side of it a line runs is never a tie.
_OFFSETS = (1237, -2411, 3083, -1699, 2777, -3301, 1511, -2053)


def _position(strip: int) -> float:
    mirrored = strip >= SAMPLES // 2
    at = min(strip, SAMPLES - 1 - strip)
    value = (at + 0.5) / SAMPLES + _OFFSETS[at] / 2.0**20 + 2.0**-25
    return 1.0 - value if mirrored else value


_LINES = np.array([(_position(x), _position(y)) for x, y in enumerate(_STRIPS)]).T.copy()


def sample_lines() -> NDArray[np.float64]:
    """Return the (2, 16) float64 positions, x and y, in the unit square; a quarter turn about its centre permutes them.

    Not to be written to.
    """
    return _LINES
