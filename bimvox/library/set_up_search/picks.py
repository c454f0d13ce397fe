"""Where each part is picked in a yard, about as the plan places it (:mod:`bimvox.planning.yard`).

A part takes the place with the least travel time from the part before and on to its own place. Those of its delivery
that are lifted before it have taken as much of the best of the yard as they cover. A part that the crane can pick only
if it lies turned by a quarter lies so.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.affinity import translate
from shapely.geometry.base import BaseGeometry

from bimvox.crane.kinematics import Axes
from bimvox.crane.tower_crane import TowerCrane
from bimvox.crane.travel import Travel
from bimvox.planning.best_place import SAME_S
from bimvox.planning.stacks import is_stacked
from bimvox.planning.truckload import Truckload
from bimvox.planning.yard import gap_vox, storage_poses
from bimvox.site.component import Component
from bimvox.site.config.site_config import Polygon
from bimvox.site.shape import erection_size_vox
from bimvox.site.site import Site


class Picks:
    """The picks of parts in a yard.

    Args:
        yard: The yard.
        points_m: (P, 2) its places, in the plan's order: rows along x, from the lowest y up.
        around_m: (N, 2, 2) lowest and highest corner of each part on plan, as seen from its hook.
        taken_m2: (N,) how much of the yard the parts before it take, see :func:`taken_m2`.
        turns: (N,) whether it may lie turned.
    """

    def __init__(
        self,
        yard: Sequence[Polygon],
        points_m: NDArray[np.float64],
        around_m: NDArray[np.float64],
        taken_m2: NDArray[np.float64],
        turns: NDArray[np.bool_],
    ) -> None:
        self._area = shapely.union_all([shapely.Polygon(one) for one in yard])
        self._around_m, self._turns, self._taken = around_m, turns, taken_m2 / max(self._area.area, 1e-9) % 1.0
        self._half_m = 0.5 * float(np.sqrt(self._area.area / max(len(points_m), 1)))
        self._out_m: dict[tuple[int, bool], NDArray[np.float64]] = {}
        self._rooms: dict[tuple[int, bool], BaseGeometry] = {}
        self.points_m = points_m

    def fits(self, points_m: NDArray[np.float64], near_m: float) -> NDArray[np.bool_]:
        """Return (2, N, P) whether each part lies within the yard with its hook within a distance of (P, 2) points.

        First as it is built, then turned by a quarter. A part that is larger than the yard may lie anywhere.
        """
        points, count = shapely.points(points_m), len(self._around_m)
        rooms = [[self._room(n, turned) for n in range(count)] for turned in (False, True)]
        found = np.array([[shapely.distance(room, points) <= near_m for room in some] for some in rooms])
        found[:, np.array([[room.is_empty for room in some] for some in rooms]).all(axis=0)] = True
        return found

    def is_turned(self, n: int, crane: TowerCrane, far_m: float) -> bool:
        """Return whether a part lies turned by a quarter, since a crane carries it no further than to a radius."""
        if not self._turns[n]:
            return False
        mast = shapely.Point(crane.base_m[:2])
        as_built, turned = (shapely.distance(self._room(n, turned), mast) <= far_m for turned in (False, True))
        return bool(turned and not as_built)

    def of(
        self,
        n: int,
        able: NDArray[np.bool_],
        travel: Travel,
        axes: tuple[Axes, Axes, Axes],
        aside: float = 0.0,
        *,
        turned: bool = False,
    ) -> int:
        """Return the place of the yard where a part is picked.

        Args:
            n: The part.
            able: (P,) whether the crane can pick it there; somewhere it can.
            travel: The crane's travel times.
            axes: The hook's axes at the part before, over the (P,) places, and at the part's own place.
            aside: Share of the places that are taken besides.
            turned: Whether the part lies turned by a quarter.
        """
        before, hook, place = axes
        out_m = self._beyond_m(n, turned)
        at = np.flatnonzero(able & (out_m <= max(self._half_m, out_m[able].min())))
        seconds = travel.between_s(before, hook) + travel.between_s(hook, place)
        ascending = np.argsort(np.floor(seconds[at] / SAME_S), kind="stable")
        return int(at[ascending[int((self._taken[n] + aside) % 1.0 * len(at))]])

    def _beyond_m(self, n: int, turned: bool) -> NDArray[np.float64]:
        """Return how far each place is from where a part lies within the yard; 0 if it is larger than the yard."""
        if (n, turned) not in self._out_m:
            room, points = self._room(n, turned), shapely.points(self.points_m)
            self._out_m[n, turned] = np.zeros(len(points)) if room.is_empty else shapely.distance(room, points)
        return self._out_m[n, turned]

    def _room(self, n: int, turned: bool) -> BaseGeometry:
        """Return where the hook may be over a part that lies within the yard."""
        if (n, turned) not in self._rooms:
            around_m = turned_m(self._around_m[n]) if turned else self._around_m[n]
            room = self._area
            for x, y in ((0, 0), (0, 1), (1, 0), (1, 1)):
                room = room.intersection(translate(self._area, -around_m[x, 0], -around_m[y, 1]))
            self._rooms[n, turned] = room
        return self._rooms[n, turned]


def turned_m(around_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (2, 2) lowest and highest corner of a part that is turned by a quarter about its hook."""
    (low_x, low_y), (high_x, high_y) = around_m
    return np.array([[-high_y, low_x], [-low_y, high_x]])


def around_m(components: Sequence[Component], cell_m: float) -> NDArray[np.float64]:
    """Return (N, 2, 2) lowest and highest corner of parts on plan, as seen from their hooks."""
    hooks = np.array([part.hook_offset_vox[:2] for part in components]).reshape(-1, 2) + 0.5
    sizes = np.array([part.shape.size_vox[:2] for part in components]).reshape(-1, 2)
    return np.stack([-hooks, sizes - hooks], axis=1) * cell_m


def taken_m2(site: Site, components: Sequence[Component]) -> NDArray[np.float64]:
    """Return (N,) how much of the yard the earlier parts of each part's delivery take, in their sequence.

    Those in one stack lie on the first one.
    """
    load, gap, area_vox = Truckload(site), gap_vox(site), 0
    found = []
    for part in components:
        if load.is_full_for(part):
            load, area_vox = Truckload(site), 0
        found.append(area_vox)
        if not (load and is_stacked(site, part)):
            size_x, size_y, _ = erection_size_vox(part.shape, storage_poses(part)[0])
            area_vox += (size_x + gap) * (size_y + gap)
        load.add(part)
    return np.array(found) * site.frame.voxel_size_m**2
