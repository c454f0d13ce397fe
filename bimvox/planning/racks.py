"""Racks in the yard: walls stand one behind the other against a frame, the one that is lifted first outermost.

Walls get their places in the order of their lifts, so a rack grows away from its outer side: the next wall stands
behind the last one, and the frame moves behind that. The frame needs room behind the last wall, as long as the longest
and in proportion to the highest.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bimvox.grid.frame import whole_cells
from bimvox.planning.stacks import Rectangle, Taken, are_apart, columns_of, height_m, is_stored_as_built, width_m
from bimvox.records.lift import YardPlace
from bimvox.site.component import Component
from bimvox.site.site import Site
from bimvox.site.work import Work, kind_of
from bimvox.site.yard_rules import RACKED_THINNESS, YardRules

_LEAST_VOX = 1


@dataclass(slots=True)
class _Rack:
    axis: int  # across the walls
    side: int  # of the frame: 1 or -1 along that axis
    members: list[Component]  # in the order of their lifts: the outermost first
    last: Rectangle  # of the last wall
    room: Rectangle  # of everything, with the frame


class Racks:
    """The racks of one delivery.

    Args:
        site: The site.
        taken: The places of the delivery, which stacks and racks share.
    """

    def __init__(self, site: Site, taken: Taken) -> None:
        self._site, self._taken = site, taken
        rules, self._size_m = site.rules.yard, site.frame.voxel_size_m
        self._rules = YardRules() if rules is None else rules
        self._between_vox = max(_LEAST_VOX, whole_cells(self._rules.dunnage_m, self._size_m))
        self._racks: list[_Rack] = []
        self._offered: dict[Rectangle, tuple[_Rack, Rectangle]] = {}

    def room_behind(self, component: Component, size: tuple[int, int], free: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return (X, Y) where a wall, stored with this size, stands in a rack that is there; nowhere if in none.

        Args:
            component: The wall.
            size: Its columns along x and y.
            free: The yard without this delivery.
        """
        room = np.zeros_like(free)
        self._offered.clear()
        for rack in self._racks:
            axis = rack.axis
            if (
                len(rack.members) >= self._rules.rack_parts
                or component.crane != rack.members[0].crane
                or thin_axis(size) != axis
            ):
                continue
            for own in self._behind(rack, size):
                whole = _around(rack.room, self._with_frame(own, rack, component))
                if not self._taken.fits(whole, rack.room, free):
                    continue
                if all(are_apart(own, other, _LEAST_VOX) for other in self._offered):
                    room[columns_of(own)] = True
                    self._offered[own] = (rack, whole)
                    break
        return room

    def room_for_new(
        self, component: Component, size: tuple[int, int], free: NDArray[np.bool_], side: int
    ) -> NDArray[np.bool_]:
        """Return (X, Y) the columns on which a wall may stand as the first of a rack with its frame on a side."""
        deep, axis = self._deep_vox(component, []), thin_axis(size)
        found = free.copy()
        for step in range(1, deep + 1):
            moved = np.zeros_like(free)
            here, there = [slice(None)] * 2, [slice(None)] * 2
            here[axis], there[axis] = (slice(None, -step), slice(step, None))[:: 1 if side > 0 else -1]
            moved[tuple(here)] = free[tuple(there)]
            found &= moved
        return found

    def add(self, component: Component, place: Rectangle, side: int) -> Rectangle:
        """Add a wall that has got its place: behind the rack there, or as the first of a new one.

        Returns:
            What the rack takes now.
        """
        offered = self._offered.get(place)
        self._offered.clear()
        if offered is not None:
            rack, whole = offered
            self._taken.replace(rack.room, whole)
            rack.members.append(component)
            rack.last, rack.room = place, whole
            return whole
        rack = _Rack(thin_axis(place[2:]), side, [], place, place)
        rack.room = self._with_frame(place, rack, component)
        rack.members.append(component)
        self._taken.add(rack.room)
        self._racks.append(rack)
        return rack.room

    def settle(self, places: list[YardPlace | None]) -> None:
        """Write the number of every rack into the places of its walls."""
        for number, rack in enumerate(self._racks, start=1):
            for component in rack.members:
                place = places[component.index]
                assert place is not None
                places[component.index] = replace(place, rack=number * rack.side)

    def _behind(self, rack: _Rack, size: tuple[int, int]) -> list[Rectangle]:
        """Return where a wall of this size may stand behind a rack: at its middle, or flush with an end."""
        axis, along = rack.axis, 1 - rack.axis
        at, length = rack.last[axis], rack.last[axis + 2]
        across = at + length + self._between_vox if rack.side > 0 else at - self._between_vox - size[axis]
        spare = rack.last[along + 2] - size[along]
        found = []
        for shift in dict.fromkeys((spare // 2, 0, spare)):
            low = [0, 0]
            low[axis], low[along] = across, rack.last[along] + shift
            found.append((low[0], low[1], *size))
        return found

    def _with_frame(self, own: Rectangle, rack: _Rack, component: Component) -> Rectangle:
        deep, axis, along = self._deep_vox(component, rack.members), rack.axis, 1 - rack.axis
        low, size = [own[0], own[1]], [own[2], own[3]]
        if rack.members:
            first, last = rack.room[along], rack.room[along] + rack.room[along + 2]
            end = max(last, low[along] + size[along])
            low[along] = min(first, low[along])
            size[along] = end - low[along]
        low[axis] -= deep if rack.side < 0 else 0
        size[axis] += deep
        return (low[0], low[1], size[0], size[1])

    def _deep_vox(self, component: Component, members: list[Component]) -> int:
        highest_m = max(height_m(one) for one in (*members, component))
        return max(_LEAST_VOX, whole_cells(self._rules.rack_depth * highest_m, self._size_m))


def is_racked(site: Site, component: Component) -> bool:
    """Return whether a part stands in a rack: an upright wall with a place that the planner chooses."""
    rules = site.rules.yard
    return (
        rules is not None
        and rules.rack_parts > 0
        and is_stored_as_built(component)
        and kind_of(component) is Work.WALL
        and height_m(component) >= RACKED_THINNESS * width_m(component)
    )


def thin_axis(size: tuple[int, ...]) -> int:
    """Return the axis across a wall of this size on plan."""
    return 0 if size[0] < size[1] else 1


def _around(one: Rectangle, other: Rectangle) -> Rectangle:
    low = min(one[0], other[0]), min(one[1], other[1])
    high = max(one[0] + one[2], other[0] + other[2]), max(one[1] + one[3], other[1] + other[3])
    return (*low, high[0] - low[0], high[1] - low[1])
