"""Between which heights the body of a part lies: what is small at its top or foot does not count.

The railing of a stair, the upstand of a slab and the bolts under a column hold little of its volume, and little of it
at any height. They say nothing about the floor to which the part belongs.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.kept import kept

_SLICES = 64
_SMALL = 0.1
"""What is left out at one end holds no more than this share of the volume ..."""
_THIN = 0.25
"""... and its section is less than this share of the mean section, in every slice."""
_OPEN = 1e-3
"""Surfaces seen from above whose area differs by more than this share from that seen from below enclose no volume."""


@kept
def body_m(mesh: TriangleMesh) -> tuple[float, float]:
    """Return the lowest and the highest height of the body of a part, metres; of an open mesh, of all of it."""
    low_m, high_m = mesh.bounds_m[:, 2].tolist()
    slices_m3 = _slices_m3(mesh.triangles_m, np.linspace(low_m, high_m, _SLICES + 1))
    first, last = (_left_out(slices) for slices in (slices_m3, slices_m3[::-1]))
    if first > _SLICES // 2:
        first = 0  # long legs are what it stands on
    step_m = (high_m - low_m) / _SLICES
    return low_m + first * step_m, high_m - last * step_m


def _left_out(slices_m3: NDArray[np.float64]) -> int:
    """Return how many slices from the first one on hold nothing but a small piece."""
    total_m3 = float(slices_m3.sum())
    small = (slices_m3 < _THIN * total_m3 / _SLICES) & (slices_m3.cumsum() <= _SMALL * total_m3)
    return int(np.argmin(small))


def _slices_m3(triangles_m: NDArray[np.float64], heights_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the volume between neighbouring heights, (N,) from (N + 1,); zeros if the mesh is open above or below."""
    one, two = triangles_m[:, 1, :2] - triangles_m[:, 0, :2], triangles_m[:, 2, :2] - triangles_m[:, 0, :2]
    above_m2 = 0.5 * (one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0])  # seen from above positive, from below negative
    seen = above_m2 != 0.0
    if abs(above_m2.sum()) > _OPEN * np.abs(above_m2).sum():
        return np.zeros(len(heights_m) - 1)
    below_m3 = -above_m2[seen] @ _depths_m(triangles_m[seen, :, 2], heights_m)
    slices_m3: NDArray[np.float64] = np.abs(np.diff(below_m3))
    return slices_m3


def _depths_m(corners_m: NDArray[np.float64], heights_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how far triangles are below heights, (F, N) from (F, 3) and (N,): the mean over each; zero above them.

    The share of a triangle below a height grows with the square of the height over its lowest corner, up to the middle
    one, and then likewise to one. This is its integral.
    """
    low, middle, high = (column[:, None] for column in np.sort(corners_m, axis=1).T)
    at, mean = np.clip(heights_m, low, high), (low + middle + high) / 3.0
    with np.errstate(divide="ignore", invalid="ignore"):
        lower = (at - low) ** 3 / (3.0 * (high - low) * (middle - low))
        upper = at - mean + (high - at) ** 3 / (3.0 * (high - low) * (high - middle))
    within = np.where(at < middle, lower, np.where(at < high, upper, at - mean))
    depths_m: NDArray[np.float64] = within + np.maximum(heights_m - high, 0.0)
    return depths_m
