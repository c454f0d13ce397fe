"""Areas on plan: the grid columns that a polygon covers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import shapely
from numpy.typing import NDArray

from bimvox.grid.frame import GridFrame

Corners = Sequence[tuple[float, float]]

_BLOCK = 8
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
    met = np.zeros(shape, np.bool_)
    for own in columns_met_by_each(polygons, frame, shape):
        met |= own
    return met


def columns_met_by_each(
    polygons: Sequence[Corners], frame: GridFrame, shape: tuple[int, int]
) -> Iterator[NDArray[np.bool_]]:
    """Yield the (X, Y) columns that overlap a polygon (site metres), for one polygon after the other.

    Blocks of columns are tested first; the columns of a block are tested if the polygon's outline is in it.
    """
    i, j = np.indices(shape)
    low_m = frame.corner_of(np.stack([i, j, np.zeros_like(i)], axis=-1))[..., :2] + _TOLERANCE_M
    high_m = low_m + frame.voxel_size_m - 2 * _TOLERANCE_M
    squares = shapely.box(low_m[..., 0], low_m[..., 1], high_m[..., 0], high_m[..., 1])
    ends = (np.minimum(np.arange(0, size, _BLOCK) + _BLOCK, size) - 1 for size in shape)
    first_m, last_m = low_m[::_BLOCK, ::_BLOCK], high_m[np.ix_(*ends)]
    blocks = shapely.box(first_m[..., 0], first_m[..., 1], last_m[..., 0], last_m[..., 1])
    for corners in polygons:
        polygon = shapely.Polygon(corners)
        shapely.prepare(polygon)
        met = np.zeros(shape, np.bool_)
        for x, y in np.argwhere(shapely.intersects(polygon, blocks)) * _BLOCK:
            window = (slice(x, x + _BLOCK), slice(y, y + _BLOCK))
            inside = shapely.contains(polygon, blocks[x // _BLOCK, y // _BLOCK])
            met[window] = inside or shapely.intersects(polygon, squares[window])
        yield met
