"""Candidate yards: rectangles next to the building, large enough for a truckload or two."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from bimvox.bim.building import Element
from bimvox.crane.reach import MAST_CLEARANCE_M
from bimvox.site.config.site_config import Polygon
from bimvox.site.default_rules import TRUCK_M
from bimvox.site.parts import is_erected

TYPICAL_PARTS = 25
"""Parts that the yard should hold at once, because parts come in truckloads."""

_PACKING = 1.3  # rows of unequal parts leave about a quarter of the yard unused
_LANE_M = 4.0  # a truck of 2.55 m, and room for a person
_WAY_M = 1.0  # between the construction area and the yard


@dataclass(frozen=True, slots=True)
class YardNeed:
    """Least size of a yard.

    Attributes:
        width_m: Least size along x.
        depth_m: Least size along y.
        longest_m: Least length of the longer side.
        area_m2: Least area.
    """

    width_m: float
    depth_m: float
    longest_m: float
    area_m2: float


def yard_need(
    components: Sequence[Element], voxel_size_m: float, *, gap_m: float = 0.0, truckload_kg: float = 0.0
) -> YardNeed:
    """Return the least size of a yard for these parts: it holds the largest part, and about 25 typical ones.

    If deliveries are limited, it holds two of them, if these are fewer parts. Parts have their orientation in the
    building; columns lie along the longer side. The gap, at least a cell, and two partly filled cells are added.
    """
    pad_m = max(gap_m, voxel_size_m) + 2 * voxel_size_m
    sizes = np.array([np.ptp(element.mesh.bounds_m, axis=0) for element in components])
    erected = np.array([is_erected(element) for element in components])
    lying = np.hypot(sizes[:, 2], sizes[:, :2].max(axis=1)) + pad_m
    across = sizes[:, :2].max(axis=1) + pad_m
    padded = sizes[:, :2] + pad_m
    areas = np.where(erected, lying * across, padded.prod(axis=1))
    as_built = padded[~erected] if not erected.all() else np.zeros((1, 2))
    narrowest = float(across[erected].max()) if erected.any() else 0.0
    return YardNeed(
        width_m=max(float(as_built[:, 0].max()), narrowest) + pad_m,
        depth_m=max(float(as_built[:, 1].max()), narrowest) + pad_m,
        longest_m=(float(lying[erected].max()) if erected.any() else 0.0) + pad_m,
        area_m2=_PACKING * float(areas.mean()) * min(TYPICAL_PARTS, _two_loads(components, truckload_kg)),
    )


def _two_loads(components: Sequence[Element], truckload_kg: float) -> int:
    """Return about how many parts come with two deliveries; all if these are not limited."""
    typical_kg = float(np.mean([element.mass_kg for element in components]))
    loads = int(np.ceil(2.0 * truckload_kg / typical_kg)) if truckload_kg > 0.0 else len(components)
    return min(max(2, loads), len(components))


def yards_next_to(construction_m: NDArray[np.float64], need: YardNeed) -> list[Polygon]:
    """Return a yard on each side of the construction area's box, the longer sides first.

    Args:
        construction_m: (2, 2) lowest and highest corner of the construction area.
        need: Least size.
    """
    low, high = construction_m
    size = high - low
    sides = [(1, -1), (1, 1), (0, -1), (0, 1)] if size[0] >= size[1] else [(0, -1), (0, 1), (1, -1), (1, 1)]
    return [_outside(low, high, axis, direction, need) for axis, direction in sides]


def yard_beside(
    construction_m: NDArray[np.float64], need: YardNeed, side: tuple[int, int], along: float, longer: float
) -> Polygon:
    """Return a yard at any place along a side of the construction area's box.

    Args:
        construction_m: (2, 2) lowest and highest corner of the construction area.
        need: Least size.
        side: The axis, 0 or 1, at whose end it lies, and the end: -1 or 1.
        along: From -1 to 1: from beyond one end of the side to beyond the other; 0 is its middle.
        longer: How much longer it is than usual, with the same area; below 1 it is shorter and deeper.
    """
    low, high = construction_m
    return _outside(low, high, *side, need, along, longer)


def _outside(
    low: NDArray[np.float64],
    high: NDArray[np.float64],
    axis: int,
    direction: int,
    need: YardNeed,
    at: float = 0.0,
    longer: float = 1.0,
) -> Polygon:
    """Return the yard outside the box at the ``direction`` end of ``axis``; see :func:`yard_beside`."""
    along = 1 - axis
    least = (need.width_m, need.depth_m)
    # At most the size of the construction area: fewer parts come at a time if they are as large as whole floors.
    area_m2 = min(need.area_m2, float(np.prod(high - low)))
    usual = max(least[along], need.longest_m, min(high[along] - low[along], area_m2 / least[axis]))
    length = max(least[along], need.longest_m, longer * usual)
    depth = max(least[axis], area_m2 / length)
    length, depth = _half_up(length), _half_up(depth)
    start = np.zeros(2)
    start[along] = np.floor(low[along] + high[along] - length) / 2
    start[along] += np.round(at * (high[along] - low[along] + length)) / 2
    start[axis] = _half_up(high[axis] + _WAY_M) if direction > 0 else -_half_up(_WAY_M - low[axis]) - depth
    end = start.copy()
    end[along] += length
    end[axis] += depth
    x0, y0, x1, y1 = (float(value) for value in (*start, *end))
    return ((x0, y0), (x1, y0), (x1, y1), (x0, y1))


def _half_up(value: float) -> float:
    """Return a value rounded up to half a metre."""
    return float(np.ceil(value * 2 - 1e-6) / 2)


def access_beside(yard: Sequence[Polygon], construction: Polygon, masts_m: Sequence[Sequence[float]] = ()) -> Polygon:
    """Return a strip along a side of the first yard's box, as wide as a lane.

    It is the side nearest to a mast of those on which a truck can stand, clear of building and masts: there the crane
    unloads the heaviest parts. Without one it is the side away from the building.

    ``construction``: outline of the construction area.
    """
    corners, middle = np.array(yard[0]), np.array(construction).mean(axis=0)
    low, high = corners.min(axis=0), corners.max(axis=0)
    offset = (low + high) / 2.0 - middle
    axis = int(np.argmax(np.abs(offset) - (high - low) / 2.0))
    away = _strip(low, high, axis, offset[axis] > 0)
    masts = [shapely.Point(*foot[:2]) for foot in masts_m]
    sides = [_strip(low, high, axis, is_high) for axis in (0, 1) for is_high in (False, True)]
    free = [
        one
        for one in sides
        if max(one.bounds[2] - one.bounds[0], one.bounds[3] - one.bounds[1]) >= TRUCK_M[0]
        and not one.intersection(shapely.Polygon(construction)).area
        and min((one.distance(mast) for mast in masts), default=0.0) >= _WAY_M + MAST_CLEARANCE_M
    ]
    best = min([away, *free], key=lambda one: min(one.distance(mast) for mast in masts)) if masts and free else away
    x0, y0, x1, y1 = best.bounds
    return ((x0, y0), (x1, y0), (x1, y1), (x0, y1))


def _strip(low: NDArray[np.float64], high: NDArray[np.float64], axis: int, is_high: bool) -> shapely.Polygon:
    """Return a lane along one side of a box."""
    low, high = low.copy(), high.copy()
    if is_high:
        low[axis], high[axis] = high[axis], high[axis] + _LANE_M
    else:
        low[axis], high[axis] = low[axis] - _LANE_M, low[axis]
    return shapely.box(*low.tolist(), *high.tolist())
