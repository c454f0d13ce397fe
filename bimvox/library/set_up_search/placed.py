"""A site file with its building in the site frame: what there is to lift, and about where each part is picked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.affinity import translate
from shapely.geometry.base import BaseGeometry

from bimvox.bim.building import Building, Element, Role
from bimvox.crane.kinematics import Axes
from bimvox.crane.tower_crane import TowerCrane
from bimvox.crane.travel import Travel
from bimvox.planning.best_place import SAME_S
from bimvox.planning.stacks import is_stacked
from bimvox.planning.yard import gap_vox, storage_poses
from bimvox.records.unloading import Lorries
from bimvox.site.access_guess import proposed_access
from bimvox.site.component import Component
from bimvox.site.config.site_config import Polygon, SiteConfig
from bimvox.site.demand import means_by
from bimvox.site.flip_box import hook_at_vox, raised_size_vox
from bimvox.site.means import Means
from bimvox.site.parts import entries_by_id
from bimvox.site.placement import place_building, top_m
from bimvox.site.site import Site


@dataclass(frozen=True, eq=False)
class PlacedSite:
    """A site file and its building.

    Attributes:
        config: The values of the site file, complete, in the site's frame.
        building: The building as read.
    """

    config: SiteConfig
    building: Building

    @cached_property
    def _placing(self) -> tuple[Building, NDArray[np.float64]]:
        return place_building(self.config, self.building)

    @property
    def placed(self) -> Building:
        """The building in the site frame."""
        return self._placing[0]

    @property
    def site_to_ifc(self) -> NDArray[np.float64]:
        """(4, 4) transform from the site frame to model coordinates."""
        return self._placing[1]

    @cached_property
    def parts(self) -> list[Element]:
        """Everything that is not there already."""
        pinned = {name for name, entry in self.entries.items() if entry.pinned}
        return [one for one in self.placed.elements if one.role is Role.COMPONENT and one.id not in pinned]

    @cached_property
    def lifted(self) -> list[Element]:
        """The parts that cranes lift."""
        return [part for part in self.parts if self.means[part.id] == Means.CRANE.value]

    @cached_property
    def searched(self) -> SiteConfig:
        """The values for which set-ups are searched: an access as `init` gives it moves with yard and cranes."""
        free = _with_areas(self.config, access=None)
        if not self.config.areas.access or self.config.areas.access != self.proposed_access(free):
            return self.config
        return free

    def proposed_access(self, config: SiteConfig) -> tuple[Polygon, ...] | None:
        """Return where lorries stand with other values of the site file; None if there is no such place."""
        return proposed_access(config, self.placed, self.lifted)

    def with_areas_of(self, config: SiteConfig, yard: tuple[Polygon, ...] | None) -> SiteConfig:
        """Return other values of the site file with a yard, and with an access for them if it moves with them."""
        moved = config if yard is None else _with_areas(config, yard=yard)
        if self.searched is self.config:
            return moved
        free = _with_areas(moved, access=None)
        return _with_areas(free, access=self.proposed_access(free))

    @cached_property
    def entries(self) -> Mapping[str, Any]:
        """The ``[[component]]`` table of each part that has one, by element id."""
        return entries_by_id(self.config, self.placed.elements)

    @cached_property
    def means(self) -> dict[str, str]:
        """How each part gets to its place, by id."""
        found = means_by(self.config, self.parts, self.entries)
        return {name: one.means.value for name, one in found.items()}

    @cached_property
    def load_top_m(self) -> float:
        """Height that the top of a load must reach."""
        return top_m(self.placed) + 2 * (self.config.model.voxel_size_m or 0.0)


def _with_areas(config: SiteConfig, **areas: object) -> SiteConfig:
    return config.model_copy(update={"areas": config.areas.model_copy(update=areas)})


# Where each part is picked in a yard, about as the plan places it (:mod:`bimvox.planning.yard`).
#
# A part takes the place with the least travel time from the part before and on to its own place. Those of its delivery
# that are lifted before it have taken as much of the best of the yard as they cover. A part that the crane can pick
# only if it lies turned by a quarter lies so.
#
# One pick is up to 20 s off, half of them by less than 7 s, and all together by 0.4 to 0.7 % of the crane time: only
# placing every part tells where deliveries end and how parts of unequal size fill a yard. A factor for what stays free
# between them does not help: 1.8 suits prefab.ifc (its sum is off by 0.0 instead of 0.4 %), 0.8 suits hall.ifc.


class Picks:
    """The picks of parts in a yard.

    Args:
        yard_m2: Area of the yard.
        points_m: (P, 2) its places, in the plan's order: rows along x, from the lowest y up.
        rooms: (N, 2) of each part, see :func:`rooms_of`.
        taken_m2: (N,) how much of the yard the parts before it take, see :func:`taken_m2`.
    """

    def __init__(
        self,
        yard_m2: float,
        points_m: NDArray[np.float64],
        rooms: NDArray[np.object_],
        taken_m2: NDArray[np.float64],
    ) -> None:
        self._rooms, self._taken = rooms, taken_m2 / max(yard_m2, 1e-9) % 1.0
        self._half_m = 0.5 * float(np.sqrt(yard_m2 / max(len(points_m), 1)))
        self._out_m: dict[tuple[int, bool], NDArray[np.float64]] = {}
        self.points_m = points_m

    def fits(self, points_m: NDArray[np.float64], near_m: float) -> NDArray[np.bool_]:
        """Return (2, N, P) whether each part lies within the yard with its hook within a distance of (P, 2) points.

        First as it is built, then turned by a quarter. A part that is larger than the yard may lie anywhere.
        """
        points = shapely.points(points_m)
        result = np.array([[shapely.distance(room, points) <= near_m for room in some] for some in self._rooms.T])
        result[:, shapely.is_empty(self._rooms).all(axis=1)] = True
        return result

    def is_turned(self, n: int, crane: TowerCrane, far_m: float) -> bool:
        """Return whether a part lies turned by a quarter, since a crane carries it no further than to a radius."""
        as_built, turned = shapely.distance(self._rooms[n], shapely.Point(crane.base_m[:2])) <= far_m
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
            room, points = self._rooms[n, int(turned)], shapely.points(self.points_m)
            self._out_m[n, turned] = np.zeros(len(points)) if room.is_empty else shapely.distance(room, points)
        return self._out_m[n, turned]


def rooms_of(yard: Sequence[Polygon], components: Sequence[Component], cell_m: float) -> NDArray[np.object_]:
    """Return (N, 2) where the hook may be over parts that lie within a yard: as they are built, turned by a quarter.

    Empty if a part is larger than the yard. Both are the same if the site file says how it lies.
    """
    area = shapely.union_all([shapely.Polygon(one) for one in yard])
    known: dict[tuple[float, ...], BaseGeometry] = {}

    def lying(part: Component, turn: int) -> BaseGeometry:
        rooms = []
        for pose in storage_poses(part):
            size = raised_size_vox(part, pose, turn)[:2]
            hook = np.array(hook_at_vox(part, pose, turn)) + 0.5
            around_m = np.stack([-hook, np.array(size) - hook]) * cell_m
            key = tuple(around_m.ravel().tolist())
            if key not in known:
                known[key] = room_in(area, around_m)
            rooms.append(known[key])
        return rooms[0] if len(rooms) == 1 else shapely.union_all(rooms)

    result = np.empty((len(components), 2), np.object_)
    for n, part in enumerate(components):
        given = part.stored_turn
        result[n] = (lying(part, 0), lying(part, 1)) if given is None else (lying(part, given),) * 2
    return result


def room_in(area: BaseGeometry, around_m: NDArray[np.float64]) -> BaseGeometry:
    """Return where the hook may be over a part within an area; its (2, 2) corners are as seen from the hook."""
    room = area
    for x, y in ((0, 0), (0, 1), (1, 0), (1, 1)):
        room = room.intersection(translate(area, -around_m[x, 0], -around_m[y, 1]))
    return room


def around_m(components: Sequence[Component], cell_m: float) -> NDArray[np.float64]:
    """Return (N, 2, 2) lowest and highest corner of parts on plan, as seen from their hooks."""
    hooks = np.array([part.hook_offset_vox[:2] for part in components]).reshape(-1, 2) + 0.5
    sizes = np.array([part.shape.size_vox[:2] for part in components]).reshape(-1, 2)
    return np.stack([-hooks, sizes - hooks], axis=1) * cell_m


def taken_m2(site: Site, components: Sequence[Component]) -> NDArray[np.float64]:
    """Return (N,) how much of the yard the earlier parts of each part's delivery take, in their sequence.

    Those in one stack lie on the first one.
    """
    load, gap, area_vox = Lorries(site), gap_vox(site), 0
    found = []
    for part in components:
        if load.is_full_for(part):
            load, area_vox = Lorries(site), 0
        found.append(area_vox)
        if not (load and is_stacked(site, part)):
            size_x, size_y, _ = raised_size_vox(part, storage_poses(part)[0], 0)
            area_vox += (size_x + gap) * (size_y + gap)
        load.add(part)
    return np.array(found) * site.frame.voxel_size_m**2
