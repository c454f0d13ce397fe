"""Where a mast can stand: around building and yard, clear of both, of the access and of every closed zone.

It also can where the outline of the building leaves room over its whole height, in a court or between two wings; a
mobile crane cannot leave a court. A jib that would sweep over more than the plot has no place.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from bimvox.bim.building import BUILT, Element
from bimvox.crane.reach import MARGIN_M, MAST_CLEARANCE_M
from bimvox.crane.tower_crane import TowerCrane
from bimvox.site.config.site_config import SiteConfig
from bimvox.site.outlines import shadow

_RING_M = 20.0
"""How far from building and yard a mast may stand."""
_LEAST_PITCH_M = 1.0
_OPEN = ("assembly", "slow", "limiter")
"""Kinds of zones in which a mast may stand."""


def ground_plan(elements: Iterable[Element]) -> BaseGeometry:
    """Return what the building covers on plan, every part and what exists already; courts and openings are free."""
    return shapely.union_all([shadow(one.mesh) for one in elements if one.role in BUILT])


class MastPlaces:
    """Where masts can stand on a site.

    Args:
        config: Its yard, access, plot and zones.
        building: Its outline on plan, see :func:`ground_plan`.
    """

    def __init__(self, config: SiteConfig, building: BaseGeometry) -> None:
        yards = [shapely.Polygon(one) for one in config.areas.yard or ()]
        closed = [*(config.areas.access or ()), *(zone.polygon for zone in config.zone if zone.kind not in _OPEN)]
        taken = shapely.union_all([building, *yards, *(shapely.Polygon(one) for one in closed)])
        around = shapely.union_all([building, *yards]).convex_hull.buffer(_RING_M)
        self._free = shapely.difference(around, taken)
        self._outline = building.convex_hull
        self._courts = shapely.difference(_filled(building), building)
        # Loads in transit keep their clearance from the mast, also next to it.
        self._clear_m = max(MAST_CLEARANCE_M, config.rules_in_force.transit_clearance_m + MARGIN_M)
        self._plot = None if config.areas.plot is None else shapely.Polygon(config.areas.plot)
        self._areas: dict[tuple[float, float, bool], BaseGeometry] = {}

    def bases_m(self, crane: TowerCrane, most: int) -> NDArray[np.float64]:
        """Return about ``most`` (B, 2) places of a square lattice for a crane's mast, by y, then x."""
        return _lattice(self._area(crane), self._pitch_m(crane, most))

    def near_m(self, crane: TowerCrane, base_m: NDArray[np.float64], most: int) -> NDArray[np.float64]:
        """Return the (B, 2) places of a lattice of a metre around one of ``most`` places of a crane's mast."""
        pitch_m = self._pitch_m(crane, most)
        around = shapely.box(*(base_m - pitch_m), *(base_m + pitch_m))
        return _lattice(self._area(crane).intersection(around), _LEAST_PITCH_M)

    def inside(self, bases_m: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which of (B, 2) places are within the convex outline of the building.

        There a mast must stay until the end, and its foundation must fit between the parts.
        """
        found: NDArray[np.bool_] = shapely.contains_xy(self._outline, bases_m)
        return found

    def _pitch_m(self, crane: TowerCrane, most: int) -> float:
        return max(_LEAST_PITCH_M, float(np.ceil(np.sqrt(self._area(crane).area / most))))

    def _area(self, crane: TowerCrane) -> BaseGeometry:
        key = self._clear_m + crane.mast_size_m / 2.0, crane.jib_length_m, crane.kind == "mobile"
        if key not in self._areas:
            area = (self._free.difference(self._courts) if key[2] else self._free).buffer(-key[0])
            self._areas[key] = area if self._plot is None else area.intersection(self._plot.buffer(-crane.jib_length_m))
        return self._areas[key]


def _filled(area: BaseGeometry) -> BaseGeometry:
    """Return an area without its holes."""
    shells = [shapely.Polygon(one.exterior) for one in shapely.get_parts(area) if isinstance(one, shapely.Polygon)]
    return shapely.union_all(shells)


def _lattice(area: BaseGeometry, pitch_m: float) -> NDArray[np.float64]:
    if area.is_empty:
        return np.zeros((0, 2))
    x0, y0, x1, y1 = area.bounds
    first = np.ceil(np.array([x0, y0]) / pitch_m) * pitch_m
    y, x = np.meshgrid(np.arange(first[1], y1 + 1e-9, pitch_m), np.arange(first[0], x1 + 1e-9, pitch_m), indexing="ij")
    inside = shapely.intersects_xy(area, x, y)
    return np.column_stack([x[inside], y[inside]])
