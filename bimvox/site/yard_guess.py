"""Candidate yards: rectangles next to the building, large enough for a truckload or two."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from bimvox.bim.building import Element
from bimvox.site.config.site_config import Polygon
from bimvox.site.parts import is_erected

TYPICAL_PARTS = 25
"""Parts that the yard should hold at once, because parts come in truckloads."""

_PACKING = 1.6  # rows of unequal parts, racks and the places of parts that lie turned leave much of it unused
_MOST_AREA = 1.1  # of the construction area: full lorries find room for what they bring
_LANE_M = 4.0  # a truck of 2.55 m, and room for a person
_SIDES = 4  # of a box
_PLACES = 5  # of the yard along each axis, to compare lanes
LORRY_M = 16.5
"""Length of an articulated vehicle (Directive 96/53/EC)."""
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
    # Not much more than the construction area: fewer parts come at a time if they are as large as whole floors.
    area_m2 = min(need.area_m2, _MOST_AREA * float(np.prod(high - low)))
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


def accesses_beside(
    yard: Sequence[Polygon],
    construction: Polygon | None,
    taken: BaseGeometry,
    masts_m: Sequence[Sequence[float]],
    *,
    short: bool = False,
) -> list[Polygon]:
    """Return lanes along yard and construction area on which a lorry can stand, the best first.

    Those along the yard come first: from another side, parts are carried past the building or over it. Of these, and of
    the others, the best is the one nearest to the yard's places and to a mast. A lane is as long as the side, and at
    least as long as a lorry; then it may reach beyond either end.

    Args:
        yard: The yard; lanes are along the sides of its first polygon's box, and of the construction area's.
        construction: The construction area.
        taken: Where no lorry drives.
        masts_m: Feet of the masts.
        short: Whether a lane for one lorry anywhere along a side will do, too.
    """
    low, high = _box_of(yard[0])
    boxes = [(low, high)]
    if construction is not None:
        first, last = _box_of(construction)
        boxes.append((first - _WAY_M, last + _WAY_M))
    sides = [(*box, axis, end) for box in boxes for axis in (0, 1) for end in (False, True)]
    lanes = [[_lane(*side, at) for at in (0.5, 0.0, 1.0)] for side in sides]
    found = [(n, lane) for n, some in enumerate(lanes) if (lane := _first_free(some, taken)) is not None]
    if short:
        for n, (begin, stop, axis, end) in enumerate(sides):
            parts = (_part_of(begin, stop, 1 - axis, at) for at in np.linspace(0.0, 1.0, _PLACES))
            every = (_lane(*part, axis, end, 0.5) for part in parts)
            found += [(n, lane) for lane in every if not lane.intersection(taken).area]
    masts = [shapely.Point(*foot[:2]) for foot in masts_m]
    places = shapely.points(np.stack(np.meshgrid(*np.linspace(low, high, _PLACES).T), axis=-1))

    def far(number: int, lane: shapely.Polygon) -> tuple[bool, float]:
        mast_m = min((lane.distance(mast) for mast in masts), default=0.0)
        return number >= _SIDES, round(mast_m + float(shapely.distance(places, lane).mean()), 6)

    ranked = sorted(found, key=lambda one: (*far(*one), one[0], one[1].bounds))
    return list(dict.fromkeys(_polygon(lane) for _, lane in ranked))


def _first_free(lanes: Iterable[shapely.Polygon], taken: BaseGeometry) -> shapely.Polygon | None:
    return next((lane for lane in lanes if not lane.intersection(taken).area), None)


def _part_of(
    low: NDArray[np.float64], high: NDArray[np.float64], along: int, at: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the part of a box that is as long as a lorry; what is left over lies before it by the share ``at``."""
    low, high = low.copy(), high.copy()
    low[along] += np.floor(2.0 * at * max(0.0, float(high[along] - low[along]) - _half_up(LORRY_M))) / 2.0
    high[along] = min(high[along], low[along] + _half_up(LORRY_M))
    return low, high


def _box_of(polygon: Polygon) -> NDArray[np.float64]:
    """Return the (2, 2) lowest and highest corner of a polygon."""
    corners = np.array(polygon)
    return np.stack([corners.min(axis=0), corners.max(axis=0)])


def access_away(yard: Sequence[Polygon], construction: Polygon) -> Polygon:
    """Return a lane along the side of the first yard's box that is away from the building."""
    (low, high), middle = _box_of(yard[0]), np.array(construction).mean(axis=0)
    offset = (low + high) / 2.0 - middle
    axis = int(np.argmax(np.abs(offset) - (high - low) / 2.0))
    return _polygon(_lane(low, high, axis, bool(offset[axis] > 0), 0.5))


def _lane(low: NDArray[np.float64], high: NDArray[np.float64], axis: int, is_high: bool, at: float) -> shapely.Polygon:
    """Return a lane along one side of a box; what it is longer than the side lies before it by the share ``at``."""
    low, high, along = low.copy(), high.copy(), 1 - axis
    if is_high:
        low[axis], high[axis] = high[axis], high[axis] + _LANE_M
    else:
        low[axis], high[axis] = low[axis] - _LANE_M, low[axis]
    more_m = max(0.0, _half_up(LORRY_M) - float(high[along] - low[along]))
    before_m = _half_up(at * more_m)
    low[along] -= before_m
    high[along] += more_m - before_m
    return shapely.box(*low.tolist(), *high.tolist())


def _polygon(box: shapely.Polygon) -> Polygon:
    x0, y0, x1, y1 = box.bounds
    return ((x0, y0), (x1, y0), (x1, y1), (x0, y1))
