"""Areas on plan: the grid columns that a polygon covers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray

from bimvox.grid.frame import GridFrame

Corners = Sequence[tuple[float, float]]

# An edge along a cell border does not count for the next column (metres).
_TOLERANCE_M = 1e-4


def columns_centred_in(polygons: Sequence[Corners], frame: GridFrame, shape: tuple[int, int]) -> NDArray[np.bool_]:
    """Return the (X, Y) columns whose centre lies inside one of the polygons (site metres)."""
    i, j = np.indices(shape)
    centres_m = frame.centre_of(np.stack([i, j, np.zeros_like(i)], axis=-1))
    inside = np.zeros(shape, np.bool_)
    for corners in polygons:
        inside |= shapely.contains_xy(shapely.Polygon(corners), centres_m[..., 0], centres_m[..., 1])
    return inside


def columns_met_by(polygons: Sequence[Corners], frame: GridFrame, shape: tuple[int, int]) -> NDArray[np.bool_]:
    """Return the (X, Y) columns that overlap one of the polygons (site metres)."""
    i, j = np.indices(shape)
    low_m = frame.corner_of(np.stack([i, j, np.zeros_like(i)], axis=-1))[..., :2] + _TOLERANCE_M
    high_m = low_m + frame.voxel_size_m - 2 * _TOLERANCE_M
    squares = shapely.box(low_m[..., 0], low_m[..., 1], high_m[..., 0], high_m[..., 1])
    met = np.zeros(shape, np.bool_)
    for corners in polygons:
        polygon = shapely.Polygon(corners)
        shapely.prepare(polygon)
        met |= shapely.intersects(polygon, squares)
    return met
